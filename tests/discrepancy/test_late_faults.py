"""What happens late in a long trial is found there, and what is lost altogether is no sign of another effect."""

from __future__ import annotations

import numpy as np
import pytest

from ee_dist.discrepancy.evidence.intervals import BOUND, NO_LIGHTER, NONE_LEFT, at_bound
from ee_dist.discrepancy.explain import EFFECT, explain
from ee_dist.discrepancy.measured_trial import MeasuredTrial, driver_of
from ee_dist.discrepancy.search.candidates import candidate
from ee_dist.discrepancy.search.fitted import Fit, Model
from ee_dist.discrepancy.search.pool import pool_of
from ee_dist.discrepancy.search.ridges import over_ridges
from ee_dist.discrepancy.search.screen import seen_beside
from ee_dist.discrepancy.search.search import Search
from ee_dist.discrepancy.ways.open_loop.problem import OpenLoop
from ee_dist.effects.catalogue import CATALOGUE, term
from ee_dist.effects.effect import Beside
from ee_dist.engines.mujoco.engine import MuJoCoEngine
from ee_dist.evaluation.physical import PhysicalRobot
from ee_dist.evaluation.serial import SerialEvaluator
from ee_dist.robots.servo_pendulum import servo_pendulum
from ee_dist.trials.excitation import Excitation
from ee_dist.trials.noise import with_noise

ROBOT = with_noise(servo_pendulum(), 0.005)
SUSPECTS = ["sensor_stuck", "sensor_bias", "sensor_gain", "sensor_failing", "coulomb_friction"]


def problem(seconds: float, *hidden) -> OpenLoop:
    engine, trials = MuJoCoEngine(1), []
    for k, kind in enumerate(("multisine", "slow_sines")):
        motion = Excitation(kind, seconds, 0.4, k + 1)
        driver = driver_of(motion, ROBOT)
        log = PhysicalRobot(engine, ROBOT, hidden, np.random.SeedSequence(k)).trial(driver, motion.steps(ROBOT))
        trials.append(MeasuredTrial(kind, log, driver))
    return OpenLoop(trials, ROBOT, SerialEvaluator(engine))


@pytest.mark.parametrize(("share", "from_s"), [(0.7, 9.3), (1.0, 7.7)])
def test_a_sensor_that_sticks_late_is_found_with_its_time(share: float, from_s: float) -> None:
    late = problem(12.0, term("sensor_stuck", "position", share=share, from_s=from_s))
    found = explain(late, pool_of(late, only=SUSPECTS))
    assert found.verdict == EFFECT and found.best is not None and found.best.name == "sensor_stuck@position"
    values = dict(found.best.terms[0].values)
    assert values["share"] == pytest.approx(share, abs=0.03) and values["from_s"] == pytest.approx(from_s, abs=0.1)


@pytest.mark.parametrize(("seconds", "end"), [(2.0, 5.0), (12.0, 12.0)])
def test_times_of_a_trial_reach_to_its_end(seconds: float, end: float) -> None:
    (stuck,) = (c for c in pool_of(problem(seconds), only=["sensor_stuck@position"]))
    assert stuck.bounds[1] == pytest.approx((0.0, end), abs=0.01)


@pytest.mark.parametrize(
    ("effect", "target", "u", "said"),
    [
        ("motor_weak", "servo", 1.0, ""),
        ("sensor_stuck", "position", 1.0, ""),
        ("sensor_failing", "position", 1.0, ""),
        ("torque_limit", "servo", 1.0, BOUND),
        ("coulomb_friction", "servo", 1.0, BOUND),
        ("part_mass", "arm", -1.0, BOUND),
        ("rotor_inertia", "servo", -1.0, NONE_LEFT),
    ],
)
def test_all_of_a_share_is_an_answer_and_the_end_of_a_range_a_doubt(effect, target, u, said) -> None:
    assert at_bound(candidate(ROBOT, effect, target), 0, u) == said


@pytest.mark.parametrize(("left", "said"), [(0.4, NO_LIGHTER), (0.02, NONE_LEFT)])
def test_a_rotor_that_the_time_step_keeps_heavy_is_not_said_to_be_gone(left: float, said: str) -> None:
    rotor = candidate(ROBOT, "rotor_inertia", "servo")
    assert at_bound(rotor, 0, -1.0, (left - 1.0) * 0.03, 0.03) == said


@pytest.mark.parametrize(("share", "from_s"), [(0.25, 3.1), (0.8, 6.04)])
def test_what_a_model_leaves_of_a_sensor_shows_when_it_sticks_and_by_how_much(share: float, from_s: float) -> None:
    """Between the moments are valleys that no slope leads out of; beside a model all of them are held against one another."""
    late = problem(8.0, term("sensor_stuck", "position", share=share, from_s=from_s))
    bare = candidate(ROBOT, "sensor_stuck", "position")
    (long,) = pool_of(late, only=["sensor_stuck@position"])
    assert bare.hint == long.hint == (), "readings alone do not tell"
    base = late.residuals([()])[0]
    seen = long.values(np.array(seen_beside(late, long, base).hint))
    assert seen["share"] == pytest.approx(share, abs=0.03) and seen["from_s"] == pytest.approx(from_s, abs=0.1)
    far = (term("sensor_stuck", "position", share=0.15, from_s=1.0),)
    left = late.residuals([far])[0]
    model, u = Model((long,)), long.shares(dict(far[0].values))
    begun = Fit(model, u, float(left @ left), left, np.zeros((len(left), 2)), np.ones(len(left), dtype=bool))
    ended = over_ridges(Search(late), begun)
    values = dict(ended.hypothesis[0].values)
    assert values["from_s"] == pytest.approx(from_s, abs=0.1)


@pytest.mark.parametrize("moved", [0.0, -0.2])
def test_a_sensor_that_rests_or_moves_too_far_shows_no_such_moment(moved: float) -> None:
    times = np.linspace(0.0, 2.0, 50)
    swing = moved * times
    stuck = CATALOGUE["sensor_stuck"]
    assert stuck.shown_beside([Beside(times, swing * 1.5, swing)]) == {}
    assert stuck.shown_beside([]) == {}
