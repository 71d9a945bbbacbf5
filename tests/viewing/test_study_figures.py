"""Figures of a study: data in, traces out, nothing cut."""

from __future__ import annotations

import numpy as np
import pytest

from ee_dist.viewing.parting_figures import Parting, apart_after, partings, summed
from ee_dist.viewing.run_figures import Told, fitness, paths, spans, trials
from ee_dist.viewing.study_figures import STAGES, distances, dominants


def summary(metric, seed, after, last, curves=((1, 2, 3),)):
    return {"scenario": 1, "title": "a fault of 50 %", "metric": metric, "seed": seed,
            "distance_m": {"intact": 2.0, "after": after, "trials": [1.0, last]},
            "dominants": {"diagnosis": [list(c) for c in curves]}}  # fmt: skip


def told():
    return Told(
        fitness=[[0.5, 1.0, 1.5], [0.2, 0.9, 1.2]],
        names=["intact", "after the change", "trial 1"],
        reached=[1.5, -0.3, 1.1],
        expected=[1.5, 1.5, None],
        paths={"intact": np.array([[0.0, 0.0], [1.5, 0.1]]), "after the change": np.array([[0.0, 0.0], [-0.3, 0.4]]),
               "last trial": np.array([[0.0, 0.0], [1.1, -0.2]])},
        believed=[(0.01, "motor weak at knee")],
    )  # fmt: skip


def within(figure):
    """Whether all of the traces lie within the ranges of the axes."""
    low, high = figure.layout.yaxis.range
    return all(low <= min(t.y) and max(t.y) <= high for t in figure.data if t.y is not None and len(t.y))


def test_figures_of_two_metrics_have_one_scale():
    every = [summary("rolling_mean", 0, 0.5, 3.0), summary("distance", 0, -1.0, 0.5)]
    one, other = (distances([s], s["metric"], {}, every) for s in every)
    assert one.layout.yaxis.range == other.layout.yaxis.range
    assert within(one) and within(other)
    assert distances(every[:1], "rolling_mean", {}, last="fourth trial").data[-2].name == "fourth trial"
    assert one.layout.xaxis.ticktext == ("1. a fault of<br>50\u00a0%",), "a per cent sign stays with its number"


def test_dominants_are_means_of_runs_with_the_middle_half():
    runs = [summary("rolling_mean", k, 0, 1, [(1, 2, n), (1, 2, n + 2)]) for k, n in enumerate((3, 5, 7))]
    figure = dominants([*runs, summary("distance", 0, 0, 1, [(1, 1, 1)])])
    lines = {t.name: t for t in figure.data if t.mode == "lines"}
    assert list(lines["diagnosed by rolling means"].y) == [1.0, 2.0, 6.0]
    assert list(lines["diagnosed by distance"].y) == [1.0, 1.0, 1.0]
    (band,) = [t for t in figure.data if t.fill and t.name == "diagnosed by rolling means"]
    assert max(band.y) == pytest.approx(7.0), "runs end at 4, 6 and 8: the middle half at 5 to 7"
    assert within(figure)


def test_fitness_goes_on_from_pass_to_pass():
    figure = fitness(told(), spans([told()])[0])
    assert [list(t.x) for t in figure.data] == [[0, 1, 2], [3, 4, 5]]
    assert [a.text for a in figure.layout.annotations] == ["intact", "1"]
    assert within(figure)


def test_trials_are_bars_with_what_was_foreseen():
    figure = trials(told(), spans([told()])[1])
    bars, foreseen = figure.data
    assert list(bars.y) == [1.5, -0.3, 1.1]
    assert (list(foreseen.x), list(foreseen.y)) == ([0, 1], [1.5, 1.5]), "the last was not foreseen"
    assert list(bars.marker.color) == [STAGES["intact"], STAGES["after the change"], STAGES["last trial"]]
    assert list(figure.layout.xaxis.ticktext) == ["intact", "after", "1"]
    assert within(figure)


def test_paths_are_as_long_as_wide():
    _, _, along, across = spans([told()])
    figure = paths(told(), along, across)
    assert figure.layout.yaxis.scaleanchor == "x"
    assert [t.name for t in figure.data if t.mode == "lines"] == ["intact", "after the change", "trial 1"]
    assert along[0] < -0.3 and along[1] > 1.5 and across[0] < -0.2 and across[1] > 0.4


def test_spans_fit_all_runs():
    far = Told([[0.0, 9.0]], ["intact"], [9.0], [None], {}, [])
    high, reach, _, _ = spans([told(), far])
    assert high[1] > 9.0 and reach[1] > 9.0 and reach[0] < -0.3


def test_logs_are_apart_at_the_first_step_beyond_the_limit():
    one, limits = np.zeros((5, 2)), np.array([0.1, 0.1])
    other = one.copy()
    assert apart_after(one, other, limits) == 5, "never: as long as they are"
    other[3, 1] = 0.2
    other[4, 0] = 9.0
    assert apart_after(one, other, limits) == 3


def test_partings_show_three_courses_and_two_marks():
    curves = np.stack([np.sin(np.arange(400) / 20), np.sin(np.arange(400) / 20 + 0.01), np.cos(np.arange(400) / 20)])
    shown = Parting(("weak", "weaker", "failing"), "angle_front_left", curves, 120, 40)
    figure = partings(shown)
    assert [t.name for t in figure.data] == ["weak", "weaker", "failing"]
    assert len(figure.data[0].y) == 360, "three times as far as the later parting"
    assert {a.text for a in figure.layout.annotations} == {"nearly equal: apart after 120", "different: apart after 40"}
    assert within(figure)
    assert summed([shown]) == [["1", "120", "40"]]
