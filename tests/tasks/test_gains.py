"""A candidate's gain is told alike in the terminal, in rerun and in the figure of the page."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from ee_dist.discrepancy.accounts.of_explain import taken_off
from ee_dist.tasks.results.scenes import _candidate
from ee_dist.tasks.results.sections import ranking_section
from ee_dist.tasks.results.tables import show_candidates
from ee_dist.tasks.terminal import terminal
from ee_dist.viewing.finding_text import candidate_table


@pytest.mark.parametrize(("explained", "said"), [(1.07, "100 %"), (-0.2, "-20 %"), (-0.004, "0 %"), (0.9996, "99.9 %")])
def test_no_more_than_all_of_it_and_a_loss_is_told_as_one(
    explained: float, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    c = SimpleNamespace(
        rank=1, terms=(), name="a@b", error_heldout=1.0, explained=explained, gain=explained, interval=(-1.5, 1.2),
        earned=True, why_not="", tied_with=[], held_out="windows",
    )  # fmt: skip
    problem = SimpleNamespace(robot=None, told=str, natural_name="error")
    show_candidates(terminal(120), problem, [c], "Candidates")  # type: ignore[arg-type, list-item]
    assert f" {said} " in capsys.readouterr().out
    found = SimpleNamespace(candidates=[c])
    line = candidate_table([_candidate(problem, found, c, False)])[-1]  # type: ignore[arg-type]
    assert f"| {said} |" in line and "| -100 to 100 % |" in line
    assert taken_off(c).startswith(f"{said} of the error above the noise (95 % interval -100 to 100 %)")  # type: ignore[arg-type]
    section = ranking_section(problem, [c])  # type: ignore[arg-type, list-item]
    assert section is not None and section.table is not None and section.figure is not None
    (bar,) = section.figure.data[0].x
    assert section.table.rows[0][3:5] == [said, "-100 to 100 %"] and bar == pytest.approx(
        100 * max(-1, min(explained, 1))
    )
