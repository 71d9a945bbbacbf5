"""The real command line, run in this process in an empty folder."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from hydra._internal.hydra import Hydra

# Under every import mode of pytest.
sys.path.insert(0, str(Path(__file__).parent))

from schemas import validated

from ee_dist.__main__ import main

TINY = (
    "budget=quick", "budget.population=8", "budget.generations=2", "budget.diagnosis_population=8",
    "budget.diagnosis_generations=2", "budget.crossovers=2", "budget.steps=80", "budget.polish=0",
)  # fmt: skip


@dataclass(frozen=True)
class Outcome:
    status: int
    out: str
    err: str
    folder: Path

    def runs(self) -> list[Path]:
        """Folders that hold a summary."""
        return sorted(p.parent for p in self.folder.glob("logs/**/summary.json"))

    def summary(self) -> dict[str, Any]:
        (run,) = self.runs()
        return json.loads((run / "summary.json").read_text())


_mode = Hydra.get_mode


def mode_of(hydra: Hydra, config_name: str | None, overrides: list[str]) -> Any:
    """Hydra composes all settings once to learn hydra.mode, and again to run: half of what it takes to refuse a mistake.
    Where a command line says nothing of Hydra there is no such setting."""
    return _mode(hydra, config_name, overrides) if any("hydra" in word for word in overrides) else None


@pytest.fixture
def cli(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> Callable[..., Outcome]:
    """``cli("+scenario=8", ...)``: each call runs in a folder of its own."""
    count = iter(range(1000))

    def run(*arguments: str) -> Outcome:
        folder = tmp_path / f"call_{next(count)}"
        folder.mkdir()
        monkeypatch.chdir(folder)
        monkeypatch.setattr(sys, "argv", ["ee_dist", *arguments])
        monkeypatch.setattr(Hydra, "get_mode", mode_of)
        capfd.readouterr()
        try:
            status = main()
        except SystemExit as stop:
            status = int(stop.code or 0)
        out, err = capfd.readouterr()
        for summary in folder.rglob("summary.json"):
            validated(summary)
        return Outcome(status, out, err, folder)

    return run


@pytest.fixture(scope="session")
def tiny() -> tuple[str, ...]:
    """A run of seconds. Polish, some 300 hypotheses a round, would be nine tenths of it: a test that is about more than the
    command line asks for a round after this."""
    return TINY
