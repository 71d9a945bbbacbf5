"""The verbs against hidden effects, on simulated trials: small ones here, the whole catalogue in tools/blind_benchmark.py."""

from __future__ import annotations

import numpy as np
import pytest

from ee_dist.discrepancy.compare import compare
from ee_dist.discrepancy.examine import Effort
from ee_dist.discrepancy.explain import EFFECT, NOTHING_MISSING, explain
from ee_dist.discrepancy.measured_trial import MeasuredTrial, driver_of, setup_of
from ee_dist.discrepancy.plan import ENOUGH, next_trials
from ee_dist.discrepancy.problem import error
from ee_dist.discrepancy.search.candidates import candidates
from ee_dist.discrepancy.ways.open_loop.problem import OpenLoop
from ee_dist.effects.catalogue import Hypothesis, term
from ee_dist.engines.mujoco.engine import MuJoCoEngine
from ee_dist.evaluation.cache import CachedEvaluator
from ee_dist.evaluation.physical import PhysicalRobot
from ee_dist.evaluation.serial import SerialEvaluator
from ee_dist.robots.quadruped_lab import quadruped_lab
from ee_dist.trials.excitation import Excitation
from ee_dist.trials.noise import with_noise

ROBOT = with_noise(quadruped_lab(), 0.02)
PLAN = (
    Excitation("multisine", 2.4, 0.8, 1, "stand"),
    Excitation("gait", 1.2, 0.7, 3, "stand"),
    Excitation("sway", 1.8, 0.1, 1),
)
QUICK = Effort(first=8, second=4, final=3, starts=1)
SUSPECTS = [
    "motor_weak",
    "viscous_friction",
    "zero_offset",
    "sensor_gain",
    "sensor_noise",
    "motors_swapped",
    "hidden_neuron_failing",
]


@pytest.fixture(scope="module")
def engine() -> MuJoCoEngine:
    return MuJoCoEngine(1)


def problem_with(engine: MuJoCoEngine, hidden: Hypothesis, seed: int = 0) -> OpenLoop:
    trials = []
    for k, e in enumerate(PLAN):
        held = setup_of(e)
        driver = driver_of(e, ROBOT)
        hardware = PhysicalRobot(engine, ROBOT, (*hidden, *held), np.random.SeedSequence([seed, k]))
        trials.append(MeasuredTrial(f"{e.kind} {e.fixture}", hardware.trial(driver, e.steps(ROBOT)), driver, held))
    return OpenLoop(trials, ROBOT, CachedEvaluator(SerialEvaluator(engine)))


HIDDEN = [
    (term("motor_weak", "knee_front_left", loss=0.4),),
    (term("viscous_friction", "hip_rear_left", damping_nm_s_rad=0.4),),
    (term("sensor_gain", "position_knee_rear_left", change=-0.2),),
    (term("sensor_noise", "torque_hip_front_left", deviation=0.3),),
    (term("motors_swapped", "hip_front_left+knee_rear_left"),),
    (term("hidden_neuron_failing", "hidden_0", loss=0.4),),
    (term("part_lost", "upper_rear_right"),),
    (term("floor_tilt", "floor", sideways_deg=8.0),),
]


@pytest.mark.parametrize("hidden", HIDDEN, ids=lambda h: h[0].effect)
def test_the_truth_leaves_only_noise(engine: MuJoCoEngine, hidden: Hypothesis) -> None:
    problem = problem_with(engine, hidden)
    base, true = problem.residuals([(), hidden])
    floor, _ = problem.noise_floor()
    # What a noisier sensor adds at random cannot be predicted: only that it is there.
    random = hidden[0].effect == "sensor_noise"
    assert error(true) == pytest.approx(floor, rel=0.2 if random else 0.06)
    assert error(base) > 1.05 * floor


@pytest.mark.parametrize("hidden", [HIDDEN[0], HIDDEN[3], HIDDEN[4], HIDDEN[5]], ids=lambda h: h[0].effect)
def test_the_hidden_effect_is_first_among_suspects(engine: MuJoCoEngine, hidden: Hypothesis) -> None:
    found = explain(problem_with(engine, hidden), candidates(ROBOT, only=SUSPECTS), effort=QUICK)
    assert found.verdict == EFFECT
    assert found.best is not None
    assert found.best.name == f"{hidden[0].effect}@{hidden[0].target}"
    assert found.best.error_heldout < (1.25 if hidden[0].effect == "sensor_noise" else 1.1) * found.noise_floor


def test_an_untouched_robot_misses_nothing(engine: MuJoCoEngine) -> None:
    found = explain(problem_with(engine, (), seed=5), candidates(ROBOT, only=SUSPECTS), effort=QUICK)
    assert found.verdict == NOTHING_MISSING and not found.left


def test_compare_says_where_it_fails(engine: MuJoCoEngine) -> None:
    problem = problem_with(engine, (term("sensor_bias", "position_knee_front_left", bias=0.1),))
    found = compare(problem, problem.residuals([()])[0])
    assert found.channels[0].name == "position_knee_front_left"
    assert found.channels[0].rmse == pytest.approx(0.1, rel=0.1)
    assert found.error > found.noise_floor
    assert {r.name for r in found.regimes} >= {"moving", "at rest", "foot down", "foot up", "high load", "near a limit"}


def test_a_trial_that_separates_is_proposed(engine: MuJoCoEngine) -> None:
    tied = [(term("viscous_friction", f"knee_{leg}", damping_nm_s_rad=0.3),) for leg in ("front_left", "front_right")]
    library = (Excitation("rest", 1.2, fixture="stand"), Excitation("multisine", 2.4, 0.5, 2, "stand"))
    ahead = next_trials(ROBOT, tied, CachedEvaluator(SerialEvaluator(engine)), library)
    assert ahead[0].excitation.kind == "multisine" and ahead[0].separation > ENOUGH
