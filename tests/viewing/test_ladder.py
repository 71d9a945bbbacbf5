"""Errors held out on motions are no continuation of those held out on windows: table and picture keep them apart."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from rich.console import Console

from ee_dist.discrepancy.evidence.holdout import MOTIONS, WINDOWS
from ee_dist.discrepancy.ladder import UNFITTED, Improvement, Rung
from ee_dist.discrepancy.last_word import LastWord
from ee_dist.discrepancy.steps_apart import StepApart
from ee_dist.robots.servo_pendulum import servo_pendulum
from ee_dist.tasks.results.labels import step_name, step_tick
from ee_dist.tasks.results.tables import show_ladder
from ee_dist.viewing.finding import Rung as Drawn
from ee_dist.viewing.finding_text import ladder_table
from ee_dist.viewing.report_figures import ladder


def improved(*held_out: str) -> Improvement:
    rungs = [
        Rung(f"step {k}", (), (), 3.0 - k, 3.1 - k, np.zeros(1), name) for k, name in enumerate((UNFITTED, *held_out))
    ]
    nothing = np.zeros(1)
    return Improvement("better_not_explained", 0.5, rungs, (), [], nothing, nothing, 0.9, "", [], "")


def shown(found: Improvement) -> str:
    problem = SimpleNamespace(natural_name="error", robot=servo_pendulum(), told=lambda e: f"{e:.3g}")
    console = Console(width=100, record=True)
    show_ladder(console, problem, found)  # type: ignore[arg-type]
    return console.export_text()


def test_one_cut_stands_in_the_title_and_several_at_their_steps() -> None:
    one = shown(improved(MOTIONS, MOTIONS))
    assert f"held out: {MOTIONS}" in " ".join(one.split()) and "what was held out" not in one
    both = shown(improved(WINDOWS, MOTIONS))
    said = " ".join(both.split())
    assert "what was held out" in said and "other windows" in said and "motions that were not" in said


@pytest.mark.parametrize(
    ("held_out", "lines"),
    [((UNFITTED, WINDOWS, WINDOWS), [3]), ((UNFITTED, WINDOWS, MOTIONS, MOTIONS), [2, 2]), ((UNFITTED,), [1])],
)
def test_a_line_joins_what_was_judged_on_the_same(held_out: tuple[str, ...], lines: list[int]) -> None:
    count = len(held_out)
    figure = ladder([f"step {k}" for k in range(count)], [1.0] * count, [2.0] * count, held_out, 0.5)
    assert [len(t.x) for t in figure.data if t.name == "held out"] == lines
    assert sum(bool(t.showlegend) for t in figure.data if t.name == "held out") == 1


def test_trials_held_out_from_all_of_it_have_a_column_and_a_line_of_their_own() -> None:
    found = improved(MOTIONS, MOTIONS)
    problem = SimpleNamespace(natural_name="error", robot=servo_pendulum(), told=lambda e: f"{e:.3g}")
    steps = tuple(StepApart(e, np.zeros((1, 1)), np.zeros(1)) for e in (7.25, 3.42, 3.6))
    word = LastWord(problem, 7.25, 3.6, 0.8, (), (), True, steps=steps)  # type: ignore[arg-type]
    console = Console(width=80, record=True)
    show_ladder(console, problem, found, word)  # type: ignore[arg-type]
    said = " ".join(console.export_text().split())
    assert "; fitted motions held out in turn" in said and "from all" in said and MOTIONS not in said
    assert all(f" {e} " in said for e in ("7.25", "3.42", "3.6", "0.8"))
    assert "from all" not in shown(found)
    figure = ladder(["a", "b", "c"], [3.0, 2.0, 1.0], [3.1, 2.1, 1.1], [MOTIONS] * 3, 0.5, apart=[7.25, np.inf, 3.6])
    (line,) = (t for t in figure.data if t.name == "held out from all of it")
    assert "held out in turn" in {t.name for t in figure.data} and "held out" not in {t.name for t in figure.data}
    assert list(line.y) == [7.25, None, 3.6] and figure.layout.yaxis.range[1] > 7.25
    rungs = tuple(Drawn("m", e, e, MOTIONS, s.error) for e, s in zip((3.1, 2.1, 1.1), steps, strict=True))
    table = ladder_table(SimpleNamespace(ladder=rungs, floor=0.5, unit="mrad"))  # type: ignore[arg-type]
    assert "error held out in turn" in table[0] and "held out from all of it" in table[0] and " 7.25 |" in table[2]
    assert len({line.count("|") for line in table[:6]}) == 1, "as many cells in each row"


@pytest.mark.parametrize(("floor", "below"), [(0.05, False), (0.25, False), (1.5, True)])
def test_the_words_of_a_low_floor_do_not_lie_on_the_axis_and_no_curve_hides_the_other(
    floor: float, below: bool
) -> None:
    figure = ladder(["a", "b"], [2.0, 1.0], [2.0, 1.0], (UNFITTED, WINDOWS), floor)
    (words,) = figure.layout.annotations
    assert words.text.startswith("noise floor") and (words.yanchor == "top") == below
    over = figure.data[-1]
    assert over.name == "fitted" and over.marker.size < figure.data[0].marker.size


def test_many_effects_at_once_and_many_steps_have_short_names_at_the_axis() -> None:
    many = Rung(" + ".join(f"zero_offset@joint_{k}" for k in range(10)), (), (), 1.0, 1.1, np.zeros(1), WINDOWS)
    assert step_tick(many) == "zero offset at joint 0 and 9 more"
    two = Rung("zero_offset@a + motor_weak@b", (), (), 1.0, 1.1, np.zeros(1), WINDOWS)
    assert step_tick(two) == step_name(two) == "zero offset at a and motor weak at b"
    names = [f"{k}. viscous friction at joint {k}" for k in range(10)]
    (held, _) = ladder(names, [1.0] * 10, [1.1] * 10, [WINDOWS] * 10, 0.9).data
    assert max(len(line) for name in held.x for line in name.split("<br>")) <= 15
