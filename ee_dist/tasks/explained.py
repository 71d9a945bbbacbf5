"""A finished run of explain or improve, read again: what it measured with, its best explanation and what is tied with it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ee_dist.discrepancy.contenders import with_one_exchanged
from ee_dist.effects.catalogue import EffectError, Hypothesis, apply, term
from ee_dist.effects.plugins import load_plugin
from ee_dist.robots.model import Robot
from ee_dist.robots.untrusted import UntrustedError, json_of, text_of, yaml_of
from ee_dist.tasks.config import Config, ConfigError, EngineConfig
from ee_dist.tasks.folder import SETTINGS

KEY = "task.explained"


@dataclass(frozen=True)
class Explained:
    """``explanations``: (name, all terms of the model with it), the best first; one alone where nothing is tied with it, or
    nothing was found (then the model as it is). ``way``: of comparing; ``config``: settings that look at the same again."""

    folder: Path
    task: str
    verdict: str
    way: str
    explanations: tuple[tuple[str, Hypothesis], ...]
    config: Config


def summary_of(path: Path) -> Mapping[str, Any]:
    """The summary.json in a folder, or that file. Raises ConfigError."""
    file = path / "summary.json" if path.is_dir() else path
    try:
        found = json_of(text_of(file, 2**28))
    except (OSError, UntrustedError):
        found = None
    if not isinstance(found, dict):
        raise ConfigError(f"{KEY}={path}: no summary.json of explain or improve there")
    return found


def explained(path: str | None, config: Config) -> Explained:
    """What a run found. ``measured``, ``model`` and engine are those of that run, unless ``config`` names others. Raises
    ConfigError."""
    if not path:
        raise ConfigError(
            f"{KEY}=: which run? name the folder of a finished explain or improve, such as {KEY}=logs/explain"
        )
    given = Path(path)
    if not given.exists():
        raise ConfigError(f"{KEY}={path}: no such folder; name that of a finished explain or improve")
    summary = summary_of(given)
    folder = given if given.is_dir() else given.parent
    read = {"explain": _of_explanation, "improve": _of_model}
    task = str(summary.get("task"))
    if task not in read:
        raise ConfigError(
            f"{KEY}={path}: a run of task={task}, which names no explanations; expected explain or improve"
        )
    settings = _settings(folder, config)
    try:
        found = read[task](summary)
        verdict, way, engine = str(summary["verdict"]), str(summary["way"]), str(summary["engine"])
        settings = settings if settings.engine.name == engine else replace(settings, engine=EngineConfig(engine))
    except (EffectError, KeyError, TypeError, ValueError, IndexError, AttributeError):
        raise ConfigError(
            f"{KEY}={path}: its summary is not as task={task} writes it; it was changed, or is of another version: run it again"
        ) from None
    return Explained(folder, task, verdict, way, tuple(found), settings)


def fitting(found: Explained, robot: Robot) -> None:
    """Raises ConfigError where an explanation is none of this robot: the log is another one now."""
    for name, terms in found.explanations:
        try:
            apply(robot, terms)
        except EffectError as error:
            raise ConfigError(f"{KEY}={found.folder}: {name} does not fit the robot of the log: {error}") from None


def _of_explanation(summary: Mapping[str, Any]) -> list[tuple[str, Hypothesis]]:
    model = _terms(summary["model_terms"])
    ranked = [c for c in summary["candidates"] if c["earned"]]
    if summary["verdict"] != "effect" or not ranked:
        return [("the model as it is", model)]
    best = ranked[0]
    tied = [best, *(c for c in ranked[1:] if c["name"] in best["tied_with"])]
    return [(str(c["name"]), (*model, *_terms(c["terms"]))) for c in tied]


def _of_model(summary: Mapping[str, Any]) -> list[tuple[str, Hypothesis]]:
    """The model in the end, and that with one of its effects exchanged for what was tied with it when it was added, or does
    as well in the end."""
    model = _terms(summary["model_terms"])
    present = {t.name for t in model}
    found: list[tuple[str, Hypothesis]] = [("the model as it is", model)]
    for rung in summary["ladder"]:
        added = _terms(rung["added"])
        if len(added) != 1 or added[0].name not in present:
            continue
        others = [t for t in _terms(rung["alternatives"]) if t.name not in present]
        if others and found[0][1] is model and len(found) == 1:
            found = [(added[0].name, model)]
        found += [(t.name, with_one_exchanged(model, added[0].name, (t,))) for t in others]
    found += [(_terms([t])[0].name, _terms(t["terms"])) for t in summary.get("twins", ())]
    return list(dict(found).items())


def _terms(entries: Sequence[Mapping[str, Any]]) -> Hypothesis:
    return tuple(term(e["effect"], e["target"], **{str(k): float(v) for k, v in e["values"].items()}) for e in entries)


def _settings(folder: Path, config: Config) -> Config:
    """``config`` with measurements, model and the user's own effects of the run in the folder, where it names none itself."""
    try:
        asked, hydra = (yaml_of(folder / SETTINGS / f"{name}.yaml") for name in ("config", "hydra"))
        where = Path(hydra["hydra"]["runtime"]["cwd"])
        measured, model = asked["measured"], asked["model"]
        trials, held_out = asked.get("trials"), asked.get("held_out")
        plugins = [str(where / str(p)) for p in asked["plugins"]]
    except (OSError, ValueError, KeyError, TypeError):
        if config.measured:
            return config
        raise ConfigError(
            f"{KEY}={folder}: no settings of its run there; say measured=LOG, and model=MODEL if it had one"
        ) from None
    files = [str(where / str(m)) for m in (measured if isinstance(measured, list) else [measured])]
    for file in plugins:
        load_plugin(file)
    return replace(
        config,
        measured=config.measured or files,
        # Names of trials are those of its own log.
        trials=config.trials or (None if config.measured else trials),
        held_out=config.held_out or (None if config.measured else held_out),
        model=config.model or (None if model is None else str(where / str(model))),
        plugins=[*config.plugins, *(p for p in plugins if p not in config.plugins)],
    )
