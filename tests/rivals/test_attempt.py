"""What is read off attempts: shares reached, intervals, the table."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ee_dist.rivals.attempt import Attempt, Cost, attempt_of
from ee_dist.rivals.tally import bootstrap, by_run, common, markdown, means, medians, rows_of, table_of, wilson
from ee_dist.viewing.rivals_figure import by_trials


def attempt(trials, no_gait=(), rival="loop") -> Attempt:
    spent = [Cost(10 * k, 5 * k, 500 * k) for k in range(len(trials))]
    return Attempt(rival, 3, 0, 2.0, Cost(7, 6, 5), spent[-1], list(trials), spent, {k: ["flying"] for k in no_gait})


def test_a_share_is_reached_by_the_first_trial_that_walked_it():
    a = attempt([0.2, 1.5, 2.2, 1.9], no_gait=[2])
    assert a.curve() == [0.1, 0.75, 0.75, 0.95]
    assert [a.reached(s) for s in (0.7, 0.9, 1.0)] == [2, 4, None]
    assert a.reached(0.9, trials=3) is None
    assert a.spent_until(0.9) == Cost(30, 15, 1500)
    assert a.share(1) == 0.1 and math.isnan(attempt([1.0], no_gait=[0]).share(1))


def test_an_attempt_comes_back_from_its_file_as_it_was():
    a = attempt([0.2, 1.5, 2.2, 1.9], no_gait=[2])
    a.spent[2] = a.spent[1]
    assert attempt_of(a.as_dict()) == a


def test_intervals_are_the_known_ones():
    assert wilson(8, 10) == pytest.approx((0.4902, 0.9433), abs=1e-4)
    assert wilson(0, 4)[0] == 0.0 and wilson(4, 4)[1] == 1.0
    values = [1.0, 2.0, 3.0, 4.0, 5.0]
    low, high = bootstrap(values, means)
    assert low < 3.0 < high
    assert bootstrap(values, means) == (low, high), "the same each time"
    assert all(map(math.isnan, bootstrap([1.0], means))), "one run has no spread"
    assert medians(np.array([[1.0, math.inf, math.inf]]))[0] == math.inf


def test_the_table_has_a_row_for_few_trials_and_one_for_all():
    made = [attempt([0.2, 0.4, 1.0, 1.0, 1.5, 2.0]), attempt([0.2, 0.2, 0.2, 0.2, 0.2, 0.2])]
    few, many = table_of(made, {"loop": "the loop", "bayes": "Bayes"}, trials=4)
    assert (few["trials_allowed"], many["trials_allowed"]) == (5, 6)
    assert (few["reached_70"], many["reached_100"]) == (1, 1)
    assert few["trials_70"] == 5 and few["trials_100"] == math.inf
    assert "never" in markdown([few, many])
    assert [r["trials_to_100"] for r in rows_of(made, 4)] == [6, None]


def test_each_run_has_its_line_with_a_hole_where_a_rival_did_not_run():
    text = by_run(
        [attempt([0.2, 1.5, 2.0]), attempt([0.2], rival="bayes", no_gait=[0])], {"loop": "L", "bayes": "B", "x": "X"}
    )
    assert text.splitlines()[0] == "| scenario | seed | intact (m) | L | B |"
    assert text.splitlines()[2] == "| 3 | 0 | 2.00 | 1.00 (2, 3, 3) | none walks |"


def test_only_cases_that_all_have_are_set_side_by_side():
    a, b, c = attempt([1.0]), attempt([1.0], rival="bayes"), attempt([1.0])
    c.seed = 1
    assert common([a, b, c]) == [a, b] and common([b, c]) == [] and common([]) == []


def test_the_picture_has_a_line_for_each_and_a_band_where_runs_differ():
    figure = by_trials({"a": [[0.1, 0.9], [0.2, 0.2, 1.1]], "b": [[-math.inf, 0.5]]})
    lines = [t for t in figure.data if t.name]
    assert [t.name for t in lines] == ["a", "b"]
    assert list(lines[0].x) == [1, 2, 3] and list(lines[0].y) == pytest.approx([0.15, 0.55, 1.0])
    assert lines[1].y[0] == -0.25
    assert len(figure.data) == 4 and figure.layout.xaxis.type == "log"
