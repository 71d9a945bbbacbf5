"""A planned trial is predicted as its readings will come: no more often than those of the measurements came."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ee_dist.discrepancy.measured_trial import MeasuredTrial, read_every, reading_s
from ee_dist.discrepancy.plan import SHORTEST, Contender, ahead_of, next_trials, parting, predicted
from ee_dist.discrepancy.ways.open_loop.problem import OpenLoop
from ee_dist.effects.catalogue import term
from ee_dist.engines.mujoco.engine import MuJoCoEngine
from ee_dist.evaluation.cache import CachedEvaluator
from ee_dist.evaluation.serial import SerialEvaluator
from ee_dist.robots.servo_pendulum import servo_pendulum
from ee_dist.tasks.config import ConfigError
from ee_dist.tasks.plan import Options, motions
from ee_dist.trials.excitation import Excitation
from ee_dist.trials.log import SensorLog
from ee_dist.trials.noise import with_noise

ROBOT = with_noise(servo_pendulum(), 0.001)
HEAVY = (term("part_mass", "arm", change=0.25),)
LAZY = (term("command_gain", "servo", change=-0.03),)
PAIR = [Contender(HEAVY), Contender(LAZY)]
SWAY = Excitation("sway", 4.0, 0.1, 1)
SLOW_S = 1 / 30


@pytest.fixture(scope="module")
def evaluator() -> CachedEvaluator:
    return CachedEvaluator(SerialEvaluator(MuJoCoEngine(1)))


def log_of(rows: int, every: int = 1) -> SensorLog:
    filled = np.arange(rows) % every > 0
    zeros = np.zeros((rows, 1))
    log = SensorLog(0.004 * np.arange(rows), zeros, zeros.copy(), ("q",), ("rad",), ("m",))
    return log if every == 1 else replace(log, filled=filled)


def test_readings_are_as_far_apart_as_those_of_the_log_that_was_read_most_seldom() -> None:
    every, some, few = (MeasuredTrial("a", log_of(200, n)) for n in (1, 5, 8))
    assert reading_s([every]) == 0.0
    assert reading_s([every, few, some]) == pytest.approx(0.032)
    for seconds in (0.032, SLOW_S):
        read = read_every(log_of(1000), seconds)
        gaps = np.diff(read.times_s[read.readings])
        assert read.readings[0] == 0 and gaps.mean() == pytest.approx(seconds, rel=0.01)
        assert np.ptp(gaps) <= 0.004 + 1e-9
        assert reading_s([MeasuredTrial("a", read)]) == pytest.approx(seconds, abs=0.002)
    for seconds in (0.0, 0.004, 0.003):
        assert read_every(log_of(100), seconds).filled is None


def test_a_trial_that_is_read_seldom_tells_less_and_as_much_as_it_will(evaluator) -> None:
    """The prediction is what the same trial comes to once it is measured and only its readings are compared."""
    (often,) = predicted(ROBOT, PAIR, (SWAY,), evaluator)
    (seldom,) = predicted(ROBOT, PAIR, (SWAY,), evaluator, every_s=0.032)
    # Of a difference that stays, eight times fewer readings tell by the root of eight less.
    assert 0.25 * often.separation < seldom.separation < 0.5 * often.separation
    (trial,) = ahead_of(ROBOT, HEAVY, [SWAY], evaluator)
    filled = np.arange(len(trial.log)) % 8 > 0
    measured = OpenLoop([replace(trial, log=replace(trial.log, filled=filled))], ROBOT, evaluator, before=HEAVY)
    gap = measured.residuals([LAZY])[0]
    # The plan counts the lower end of a bootstrap.
    assert seldom.separation <= np.sqrt(gap @ gap) < min(2 * seldom.separation, often.separation)
    assert measured.block == 1 and len(measured.measured[0].log.readings) == 125


def test_what_is_drawn_of_a_plan_is_drawn_where_it_will_be_read(evaluator) -> None:
    shown = parting(ROBOT, [HEAVY, LAZY], (0, 1), SWAY, evaluator, 0.032)
    assert np.diff(shown.times_s) == pytest.approx(0.032)
    assert shown.curves.shape == (2, 125)
    # A window of 60 readings, or the last one with the five that make no other.
    assert shown.to_s - shown.from_s in (pytest.approx(60 * 0.032), pytest.approx(65 * 0.032))


def test_trials_with_too_few_readings_promise_nothing_and_are_not_offered(evaluator) -> None:
    short = replace(SWAY, seconds=0.032 * (SHORTEST - 1))
    assert predicted(ROBOT, PAIR, (short,), evaluator, every_s=0.032)[0].separation == 0.0
    assert predicted(ROBOT, PAIR, (short,), evaluator)[0].separation > 0.0
    with pytest.raises(ConfigError, match=r"30 readings, 33.3 ms apart, of servo_pendulum; at least 60"):
        motions(ROBOT, Options(seconds=1.0), 0, SLOW_S)
    assert motions(ROBOT, Options(seconds=1.0), 0)


def test_a_gait_is_not_proposed_where_sensors_are_read_seldom(evaluator) -> None:
    library = (SWAY, Excitation("gait", 4.0, 0.5, 18))
    tied = [HEAVY, LAZY]
    assert len(next_trials(ROBOT, tied, evaluator, library)) == 2
    assert [t.excitation for t in next_trials(ROBOT, tied, evaluator, library, every_s=0.032)] == [SWAY]
