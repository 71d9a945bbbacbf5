"""The command lines that do what was done on the page, and the model files that they name."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from ee_dist.effects.catalogue import Hypothesis
from ee_dist.effects.model_file import write_model
from ee_dist.tasks.config import Config
from ee_dist.tasks.measurements import Measurements
from ee_dist.tasks.results.commands import asked as words
from ee_dist.tasks.results.commands import command, setting

CALIBRATION = ".calibration.yaml"


def written(
    path: Path, measured: Measurements, terms: Hypothesis, began: str | None, notes: Sequence[str] = ()
) -> None:
    """A model file of these terms. ``began``: the model file that the session was opened with, whose calibration goes along:
    without it the same model would be compared otherwise."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write_model(path, measured.source, measured.folder, terms, notes)
    beside = None if began is None else Path(began).with_suffix(CALIBRATION)
    if beside is not None and beside.is_file() and beside.resolve() != path.with_suffix(CALIBRATION).resolve():
        shutil.copyfile(beside, path.with_suffix(CALIBRATION))


def asked(config: Config, measured: Measurements, model: Path | str | None) -> Config:
    """The settings of a verb on these measurements and that model file."""
    return replace(config, measured=[str(f) for f in measured.files], model=None if model is None else str(model))


def line(task: str, config: Config, by: str, *more: str) -> str:
    """The command line of a verb, as a shell takes it."""
    return command(words(task, config, by, *more))


def going_on(folder: Path) -> str:
    """The command line that goes on with the session kept in a folder."""
    return command(["task=workbench", setting("log", folder)])
