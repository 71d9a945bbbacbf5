"""Noise is not taken for something left, and what is left is found where it sits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from linear_problem import Linear
from way_samples import measure, problem_by, samples

from ee_dist.discrepancy.accounts.account import curves_of, left_text
from ee_dist.discrepancy.evidence.left import Leftover, leftovers
from ee_dist.discrepancy.measured_trial import MeasuredTrial
from ee_dist.discrepancy.problem import EVENT, Layout
from ee_dist.discrepancy.ways.open_loop.problem import OpenLoop
from ee_dist.discrepancy.ways.open_loop.weights import soften
from ee_dist.effects.catalogue import term

TRIALS, CHANNELS, PER = 6, 20, 15


def problem(known: float = 0.0) -> Linear:
    """Trials of 2 to 7 windows: in short ones a sum of squares is far from normal."""
    trial_of_segment = np.repeat(np.arange(TRIALS), np.arange(TRIALS) + 2)
    segments = len(trial_of_segment)
    size = segments * CHANNELS * PER
    layout = Layout(
        segments=tuple(f"window {k}" for k in range(segments)),
        trial_of_segment=trial_of_segment,
        segment_of=np.repeat(np.arange(segments), CHANNELS * PER),
        channel_of=np.tile(np.repeat(np.arange(CHANNELS), PER), segments),
        time_s=np.zeros(size),
        reading=np.ones(size, dtype=bool),
        floor=np.full(size, 1.0 + known),
        known=np.full(size, known),
        channels=tuple(f"channel {c}" for c in range(CHANNELS)),
        units=("1",) * CHANNELS,
        joint_of_channel=(None,) * CHANNELS,
    )
    found = Linear(())
    found.layout = layout
    found.measured = tuple(MeasuredTrial(f"trial {k}", found.measured[0].log) for k in range(TRIALS))
    return found


def test_noise_alone_raises_no_alarm_in_two_hundred_robots() -> None:
    p, rng = problem(), np.random.default_rng(0)
    alarms = sum(bool(leftovers(p, rng.standard_normal(len(p.floor)))) for _ in range(200))
    assert alarms == 0


def test_a_small_steady_offset_and_a_burst_are_found_where_they_are() -> None:
    p = problem()
    residual = np.random.default_rng(1).standard_normal(len(p.floor))
    trial = p.trial_of_segment[p.segment_of]
    residual[(trial == 5) & (p.channel_of == 3)] += 0.8
    residual[(trial == 2) & (p.channel_of == 7)] *= 2.5
    found = {(x.trial, x.channel): x.trend for x in leftovers(p, residual)}
    assert found == {("trial 5", "channel 3"): True, ("trial 2", "channel 7"): False}


def test_what_calibration_left_is_no_news_but_much_more_of_it_is() -> None:
    p = problem(known=0.5)
    rng = np.random.default_rng(2)
    cell = p.segment_of * CHANNELS + p.channel_of
    steady = rng.standard_normal(cell.max() + 1)[cell]
    noise = rng.standard_normal(len(p.floor))
    assert not leftovers(p, noise + np.sqrt(0.5) * steady)
    assert leftovers(p, noise + 4.0 * steady)


def test_repeats_of_a_motion_are_told_apart() -> None:
    p = problem()
    p.measured = tuple(MeasuredTrial("sway", t.log) for t in p.measured)
    residual = np.random.default_rng(1).standard_normal(len(p.floor))
    residual[np.isin(p.trial_of, (4, 5)) & (p.channel_of == 3)] += 0.8
    left = leftovers(p, residual)
    assert curves_of(left) == 2 and {g.index for g in left} == {4, 5}
    assert {str(g).split(" (")[0] for g in left} == {"channel 3 during 5. sway", "channel 3 during 6. sway"}


def test_a_trial_keeps_its_name_where_it_is_told() -> None:
    """It is what held_out= takes."""
    left = Leftover("slow_sines", "joint_1_position", 9.0, 1.0, True)
    assert "joint 1 position during slow_sines (slow, 9 standard deviations" in left_text([left], after=False)


@pytest.mark.parametrize("real", [True, False])
def test_of_a_real_arm_that_touches_nothing_a_smooth_error_stands_out(real: bool) -> None:
    """Of a simulation, whose model may be exact, contacts and reversals a step early are granted as before."""
    sample = samples()["arm"]
    trials = tuple(replace(t, hardware=real, commands_held=real) for t in measure(sample, ()))
    p = problem_by("open_loop", trials, sample.robot)
    (shoulder, *_) = (c for c, s in enumerate(sample.robot.sensors) if s.kind == "position")
    there = (p.channel_of == shoulder) & p.layout.reading & (p.trial_of == 0)
    p.layout = replace(p.layout, floor=np.where(there, 0.01, p.layout.floor))
    residual = np.where(there, np.sqrt(400.0 / there.sum()) * np.sin(7 * p.layout.time_s), 0.0)
    assert 0 < p.events[0, shoulder] <= EVENT
    assert (p.events[0, shoulder] < 0.2 * EVENT) == real
    assert [g.channel for g in leftovers(p, residual)] == ([sample.robot.sensors[shoulder].name] if real else [])


def test_what_walks_about_may_touch_down_a_step_early() -> None:
    sample = samples()["quadruped"]
    trials = tuple(replace(t, hardware=True, commands_held=True) for t in measure(sample, ()))
    assert (problem_by("open_loop", trials, sample.robot).events == EVENT).all()


@pytest.mark.parametrize(("name", "real", "soft"), [("arm", True, 60.0), ("arm", False, 6.0), ("quadruped", True, 6.0)])
def test_what_a_real_arm_leaves_is_softened_far_beyond_what_a_missed_contact_would_be(
    name: str, real: bool, soft: float
) -> None:
    """It counts by its square, nearly, where that of others counts by its logarithm; and comes back as it was."""
    sample = samples()[name]
    trials = tuple(replace(t, hardware=real, commands_held=real) for t in measure(sample, ()))
    p = problem_by("open_loop", trials, sample.robot)
    assert isinstance(p, OpenLoop) and f"softened beyond {soft:g})" in p.error_definition
    off = (term("zero_offset", sample.robot.motor_names[0], offset_rad=0.1),)
    (row,) = p.residuals([off])
    read = p.layout.reading
    bare = p.smooth(row)
    assert np.allclose(soften(bare, soft), row)
    far = read & (np.abs(bare) > 12.0) & (np.abs(bare) < 30.0)
    assert far.any()
    assert ((np.abs(row) > 0.95 * np.abs(bare))[far].all()) == (soft > 6.0)
