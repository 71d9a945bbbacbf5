"""What is sent to be drawn: every number that can be seen, and no lists, which the toolkit would watch item by item."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ee_dist.viewing.curves import Overlay
from ee_dist.workbench import charts
from ee_dist.workbench.bench import Step
from ee_dist.workbench.thin import POINTS, stretch


def overlay(rows: int, step_s: float) -> Overlay:
    t = np.arange(rows) * step_s
    return Overlay("position", "trial", "rad", t, np.sin(t), np.sin(t + 0.01))


def test_a_stretch_of_a_long_log_is_drawn_row_by_row_and_every_row_has_its_time():
    part = stretch(overlay(300_000, 0.002), 590.0, 592.0)
    assert part.exact
    lines = charts.overlay(part.curve, "key")["data"]
    times = np.array(lines[0]["x"])
    inside = (times >= 590.0) & (times <= 592.0)
    assert inside.sum() == 1001 and np.allclose(np.diff(times), 0.002, atol=1e-9)
    assert np.allclose(lines[0]["y"], part.curve.measured, atol=1e-6)
    whole = stretch(overlay(300_000, 0.002))
    assert not whole.exact and len(whole.curve.times_s) <= POINTS + 2


def test_curves_are_sent_as_they_are_and_gaps_as_gaps():
    curve = overlay(5, 0.1)
    curve.predicted[2] = np.nan
    lines = charts.overlay(curve, "key")["data"]
    assert lines[1]["y"][2] is None and lines[2]["y"][2] is None and lines[1]["y"][1] is not None
    assert all(isinstance(line[axis], tuple) for line in lines for axis in "xy")


def test_a_refused_step_is_crossed_out_and_no_number_stands_on_the_floor():
    steps = (Step("start", 8.0, 8.0), Step("a", 0.9, 0.95, "windows"), Step("b", 0.8, 2.0, "windows", "it is luck"))
    found = charts.ladder(steps, 1.0, "error (mrad)")
    lines = {line["name"]: line for line in found["data"]}
    assert lines["refused"]["x"] == [2] and lines["held out"]["x"] == [0, 1]
    assert lines["held out"]["textposition"] == ["top center", "bottom center"]
    assert "refused" in found["layout"]["xaxis"]["ticktext"][2]
    assert found["layout"]["yaxis"]["title"]["text"] == "error (mrad)"


def test_of_a_moved_slider_only_the_numbers_are_other_ones_and_a_mark_is_another_figure():
    pytest.importorskip("nicegui", reason="needs the extra 'workbench'")
    from ee_dist.workbench.pages.plot import same_but_numbers

    before, after = overlay(50, 0.1), overlay(50, 0.1)
    after.predicted[:] += 0.2
    first, moved = charts.overlay(before, "key"), charts.overlay(after, "key")
    assert same_but_numbers(first, moved) and first["data"][1]["y"] != moved["data"][1]["y"]
    assert not same_but_numbers(first, charts.overlay(after, "another key"))
    assert not same_but_numbers(first, charts.overlay(after, "key", mark=("a mark", np.zeros(50))))


def test_what_is_drawn_says_in_which_unit() -> None:
    layout = charts.overlay(overlay(50, 0.1), "key")["layout"]
    assert (
        layout["yaxis"]["title"]["text"] == "position (rad)" and layout["yaxis2"]["title"]["text"] == "residual (rad)"
    )
    regimes = charts.bars(["moving", "at rest"], [15.9, 9.4], 9.36, "relative force error (%)")
    assert regimes["layout"]["xaxis"]["title"]["text"] == "relative force error (%)"
    long = replace(overlay(50, 0.1), channel="joint 2 position, held_4_sines")
    layout = charts.overlay(long, "key")["layout"]
    assert layout["yaxis"]["title"]["text"] == "joint 2 position,<br>held_4_sines (rad)", "not into what is below it"
    assert layout["margin"]["l"] > charts.MARGIN["l"]


def test_the_colours_of_a_map_end_no_lower_than_is_asked() -> None:
    """In the unit of its numbers: three standard deviations are another number where errors are told in percent."""
    noise = np.full((2, 2), 0.9)
    assert charts.heat(noise, ("a", "b"), ("one", "two"), None, 3.0)["data"][0]["zmax"] == 3.0
    assert charts.heat(30 * noise, ("a", "b"), ("one", "two"), None, 28.1)["data"][0]["zmax"] == 28.1
    assert charts.heat(50 * noise, ("a", "b"), ("one", "two"), None, 28.1)["data"][0]["zmax"] == pytest.approx(45.0)


def test_names_of_a_map_have_room_and_are_whole_where_the_mouse_is() -> None:
    channels, trials = (
        ("torque_knee_front_right", "roll"),
        [f"{k}. a_long_name_of_a_multisine_{k}" for k in range(1, 8)],
    )
    chart = charts.heat(np.ones((7, 2)), channels, trials, None, 3.0)
    down, across = chart["layout"]["yaxis"]["ticktext"], chart["layout"]["xaxis"]
    assert down == ["torque knee front<br>right", "roll"]
    assert across["tickangle"] == -90 and all(len(t) <= charts.TRIAL for t in across["ticktext"])
    assert len(set(across["ticktext"])) == 7
    assert chart["data"][0]["text"][0][0] == f"torque knee front right<br>{trials[0]}<br>1"
    few = charts.heat(np.ones((2, 2)), channels, ("1. multisine", "2. steps"), None, 3.0)["layout"]["xaxis"]
    assert few["tickangle"] == 0 and few["ticktext"] == ["1. multisine", "2. steps"]


def test_the_axis_of_gains_has_room_on_a_phone() -> None:
    title = charts.ranking(["a", "b"], [0.5, 0.2], [(0.4, 0.6), (0.1, 0.3)], ["best", "not"])["layout"]["xaxis"][
        "title"
    ]
    assert max(len(line) for line in title["text"].split("<br>")) <= 24
