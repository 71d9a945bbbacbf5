"""A candidate's gain is told alike in the terminal, in rerun and in the figure of the page."""

from __future__ import annotations

import math
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest

from ee_dist.discrepancy.accounts.of_explain import taken_off, told_gain
from ee_dist.tasks.results.scenes import _candidate
from ee_dist.tasks.results.sections import ranking_section
from ee_dist.tasks.results.tables import show_candidates
from ee_dist.tasks.terminal import terminal
from ee_dist.viewing import report_figures as figures
from ee_dist.viewing.finding_text import candidate_table
from ee_dist.workbench import charts


@pytest.mark.parametrize(("explained", "said"), [(1.07, "100 %"), (-0.2, "-20 %"), (-0.004, "0 %"), (0.9996, "99.9 %")])
def test_no_more_than_all_of_it_and_a_loss_is_told_as_one(
    explained: float, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    c = SimpleNamespace(
        rank=1, terms=(), name="a@b", error_heldout=1.0, error_without=2.0,
        explained=explained, gain=explained, interval=(-1.5, 1.2),
        earned=True, why_not="", tied_with=[], held_out="windows",
    )  # fmt: skip
    problem = SimpleNamespace(robot=None, told=str, natural_name="error")
    show_candidates(terminal(120), problem, [c], "Candidates")  # type: ignore[arg-type, list-item]
    assert f" {said} " in capsys.readouterr().out
    found = SimpleNamespace(candidates=[c])
    line = candidate_table([_candidate(problem, found, c, False)])[-1]  # type: ignore[arg-type]
    assert f"| {said} |" in line and "| -150 to 100 % |" in line
    assert taken_off(c).startswith(f"{said} of the error above the noise (95 % interval -150 to 100 %)")  # type: ignore[arg-type]
    section = ranking_section(problem, [c])  # type: ignore[arg-type, list-item]
    assert section is not None and section.table is not None and section.figure is not None
    (bar,) = section.figure.data[0].x
    assert section.table.rows[1][3:5] == [said, "-150 to 100 %"] and bar == pytest.approx(100 * min(explained, 1))


@pytest.mark.parametrize(
    ("explained", "gain", "interval", "said", "between"),
    [
        (-0.00255, -0.001393, (-0.00252, -0.000414), "-0.255 %", "-0.461 to -0.0758 %"),
        (-2.1139, -1.7175, (-4.281, 0.2484), "-211 %", "-527 to 31 %"),
        (0.5, 0.4, (-0.08, 0.8), "50 %", "-10 to 100 %"),
        (-math.inf, -math.inf, (math.nan, math.nan), "-", "-"),
    ],
)
def test_a_loss_and_its_interval_are_of_one_scale_and_as_large_as_they_are(
    explained: float, gain: float, interval: tuple[float, float], said: str, between: str
) -> None:
    c = SimpleNamespace(explained=explained, gain=gain, interval=interval)
    assert told_gain(c) == (said, between)  # type: ignore[arg-type]


@pytest.mark.parametrize("chart", [figures.ranking, charts.ranking])
def test_what_a_chart_of_gains_cuts_is_marked(chart: Callable[..., Any]) -> None:
    kinds = ["best", "not", "not"]
    whole = chart(["a", "b", "c"], [0.9, 0.5, -0.1], [(0.8, 1.0), (0.4, 0.6), (-0.2, 0.1)], kinds)
    cut = chart(["a", "b", "c"], [0.9, 0.1, -2.1], [(0.8, 1.0), (-0.4, 0.6), (-4.2, 0.2)], kinds)

    def marks(of: Any) -> list[tuple[str, str]]:
        layout = of["layout"] if isinstance(of, dict) else of.to_dict()["layout"]
        return [(m["y"], m["text"]) for m in layout.get("annotations", ())]

    assert marks(whole) == []
    assert marks(cut) == [("b", "◂"), ("c", "◂"), ("c", "bar goes on to -210 %")]
