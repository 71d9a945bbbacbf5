"""Names of a user's robot come out of the terminal as they are, whatever rich would make of them."""

from __future__ import annotations

import re
from pathlib import Path
from types import SimpleNamespace

import pytest

import ee_dist
from ee_dist.tasks.progress_line import SearchProgress
from ee_dist.tasks.results.tables import show_candidates
from ee_dist.tasks.terminal import terminal


@pytest.mark.parametrize("name", ["axis[x]", "axis[/x]", "a:key:b"])
def test_brackets_are_no_markup(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    console = terminal(width=120)
    problem = SimpleNamespace(robot=None, told=str)
    judged = SimpleNamespace(
        rank=1, terms=(), name="a", error_heldout=1.0, error_without=2.0,
        explained=0.5, gain=0.5, interval=(0.4, 0.6), earned=False,
        why_not=f"not at {name}", tied_with=[]
    )  # fmt: skip
    show_candidates(console, problem, [judged], f"Trials of {name}")  # type: ignore[arg-type, list-item]
    console.print(f"The truth: {name}", highlight=False)
    said = capsys.readouterr().out
    assert f"not at {name}" in said and f"Trials of {name}" in said and f"The truth: {name}" in said


def test_a_live_line_takes_no_markup() -> None:
    console = terminal(width=120)
    console._force_terminal = True
    SearchProgress(console)("judging friction@axis[/x]", 0.5)


def test_every_verb_writes_to_this_terminal() -> None:
    files = sorted(Path(ee_dist.__file__).parent.rglob("*.py"))
    assert [f.name for f in files if re.search(r"\bConsole\(", f.read_text(encoding="utf-8"))] == ["terminal.py"]
