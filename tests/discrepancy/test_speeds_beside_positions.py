"""Speeds and torques that are measured beside positions count no more than these do."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from way_samples import Sample, evaluator_for, measure, sines, two_joint_arm

from ee_dist.discrepancy.measured_trial import MeasuredTrial
from ee_dist.discrepancy.ways.open_loop.problem import OpenLoop
from ee_dist.discrepancy.ways.open_loop.scale import Scale, no_more_than_places
from ee_dist.discrepancy.ways.open_loop.words import counted_less
from ee_dist.effects.catalogue import term
from ee_dist.robots.model import Sensor

ARM = two_joint_arm()
SENSORS = tuple(
    Sensor(f"{kind}_{joint}", kind, joint, unit)
    for kind, unit in (("position", "rad"), ("velocity", "rad/s"))
    for joint in ("shoulder", "elbow")
)
BOTH = replace(ARM, sensors=SENSORS)
LEAST = np.array([0.006, 0.006, 0.004, 0.004])
PLAIN = Scale(np.full(4, 1e-4), LEAST, LEAST, "made up")


def counted(scale: Scale, off: np.ndarray) -> np.ndarray:
    """(2,) mean squares by which positions and speeds count."""
    return np.asarray(((off / scale.scale) ** 2).reshape(2, 2).mean(axis=1))


def test_positions_and_speeds_count_alike_where_both_are_far_off() -> None:
    off = LEAST * [3.0, 5.0, 60.0, 20.0]
    scale = no_more_than_places(PLAIN, BOTH, off)
    places, speeds = counted(scale, off)
    assert speeds == pytest.approx(places) and np.array_equal(scale.scale[:2], LEAST[:2])
    assert scale.loosened == pytest.approx(np.sqrt((60**2 + 20**2) / (3**2 + 5**2)))
    # How rough a channel may be is not meant.
    assert np.array_equal(scale.least, LEAST)


def test_within_what_no_model_is_better_than_positions_ask_for_nothing_more() -> None:
    off = LEAST * [0.01, 0.02, 7.0, 7.0]
    assert counted(no_more_than_places(PLAIN, BOTH, off), off)[1] == pytest.approx(1.0)


@pytest.mark.parametrize("off", [[5.0, 5.0, 4.0, 4.0], [5.0, 5.0, np.inf, 4.0], [0.1, 0.1, 0.8, 0.8]])
def test_speeds_are_never_made_to_count_more(off: list[float]) -> None:
    assert no_more_than_places(PLAIN, BOTH, LEAST * off) is PLAIN


def test_a_speed_with_no_position_beside_it_counts_as_it_is() -> None:
    alone = replace(ARM, sensors=(SENSORS[0], SENSORS[3]))
    some = Scale(PLAIN.noise[:2], LEAST[:2], LEAST[:2], "made up")
    assert no_more_than_places(some, alone, LEAST[:2] * [1.0, 100.0]) is some


@cache
def late() -> tuple[MeasuredTrial, ...]:
    hidden = tuple(term("command_delay", j, delay_s=0.03) for j in ("shoulder", "elbow"))
    return measure(Sample(BOTH, sines(BOTH, 0.6, 4.0), (), ()), hidden)


def test_of_real_logs_both_are_heard_and_it_is_told() -> None:
    real = [replace(t, hardware=True) for t in late()]
    told = OpenLoop(real, BOTH, evaluator_for(BOTH))
    assert told.scale.loosened > 1.2 and any("beside their positions" in line for line in told.notes)
    moved = told.of(real[:1])
    assert np.array_equal(moved.scale.scale, told.scale.scale)  # one measure for all that is held out
    simulated = OpenLoop(late(), BOTH, evaluator_for(BOTH))
    assert simulated.scale.loosened == 1.0 and not any("beside their positions" in line for line in simulated.notes)


@pytest.mark.parametrize(("lag", "times"), [([1.0, 1.0, 4.0, 4.0], 4.0), ([1.0, 1.0, 1.5, 1.5], 2.0)])
def test_one_that_hangs_low_is_off_in_its_positions_and_speeds_still_count_no_more(
    lag: list[float], times: float
) -> None:
    """It says nothing of what is left once that is put right: what comes late does, and the larger of the two is taken."""
    off = LEAST * ([60.0, 60.0, 20.0, 20.0] if times == 4.0 else [10.0, 10.0, 20.0, 20.0])
    scale = no_more_than_places(PLAIN, BOTH, off, changing=LEAST * lag)
    assert (scale.loosened, scale.of_lag) == (pytest.approx(times), times == 4.0)
    (line,) = counted_less(scale.loosened, scale.of_lag)
    assert ("what comes late" in line, "as described" in line) == (scale.of_lag, not scale.of_lag)


def test_how_quickly_channels_change_is_taken_from_what_was_measured() -> None:
    in_order = [replace(t, hardware=True) for t in measure(Sample(BOTH, sines(BOTH, 0.6, 4.0), (), ()), ())]
    scale = OpenLoop(in_order, BOTH, evaluator_for(BOTH)).scale
    logs = [t.log.sensors for t in in_order]
    squares = np.mean([np.mean((np.diff(x, axis=0) / BOTH.time_step_s) ** 2, axis=0) for x in logs], axis=0)
    places, speeds = (squares / scale.least**2).reshape(2, 2).mean(axis=1)
    assert scale.of_lag and scale.loosened == pytest.approx(np.sqrt(speeds / places), rel=0.05)
