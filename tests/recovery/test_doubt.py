"""Doubt: said where a fault is none that a hypothesis can say or the search missed it, and not where the diagnosis is right."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from ee_dist.effects import term
from ee_dist.engines.drivers import Network
from ee_dist.engines.mujoco.engine import MuJoCoEngine
from ee_dist.evaluation.physical import PhysicalRobot
from ee_dist.evaluation.serial import SerialEvaluator
from ee_dist.recovery.doubt import Doubt, doubt, doubt_from, next_to, sayable
from ee_dist.recovery.metrics import RollingMean
from ee_dist.recovery.walking import WALKING
from ee_dist.robots.quadruped import quadruped

ROBOT = quadruped()
SEED = np.random.SeedSequence(7)
WEAK = term("motor_weak", "knee_front_left", loss=0.5)
LEG = term("part_lost", "upper_rear_left")
UNSAYABLE = {
    "a hidden neuron": (term("hidden_neuron_failing", "hidden_0", loss=0.5),),
    "two motors tied": (term("motors_tied", "hip_front_left+hip_rear_left"),),
    "a lighter body": (term("part_mass", "body", change=-0.5),),
}


@pytest.fixture(scope="module")
def engine():
    made = MuJoCoEngine(threads=1)
    yield made
    made.close()


def networks(count):
    rng = np.random.default_rng(5)
    return [Network(tuple(float(v) for v in np.round(rng.uniform(-1, 1, 68), 2))) for _ in range(count)]


def doubted(engine, hidden, believed, noise=0.0, intact=(), declared=None):
    body = PhysicalRobot(engine, ROBOT, hidden, SEED, noise)
    before = PhysicalRobot(engine, ROBOT, intact, SEED, noise)
    first, *rest = networks(4)
    return doubt(
        ROBOT, believed, [(first, before.trial(first, 60))], [(c, body.trial(c, 60)) for c in (first, *rest)],
        RollingMean(), SerialEvaluator(engine), noise if declared is None else declared, np.random.SeedSequence(3),
    )  # fmt: skip


@pytest.mark.parametrize("truth", [(), (WEAK,), (LEG, WEAK)], ids=str)
def test_a_right_hypothesis_leaves_nothing_and_no_doubt(engine, truth):
    found = doubted(engine, truth, truth)
    assert (found.left, found.noise, found.said) == (0.0, 0.0, False)
    assert found.trials == 4
    assert found.words.startswith("No doubt")


@pytest.mark.parametrize("name", UNSAYABLE)
def test_what_no_genome_can_say_is_doubted(engine, name):
    assert not sayable(UNSAYABLE[name], WALKING)
    found = doubted(engine, UNSAYABLE[name], (WEAK,))
    assert found.said and found.left > found.allowed
    assert "Something is wrong that it does not say" in found.words
    assert doubted(engine, UNSAYABLE[name], ()).said, "nor is 'nothing changed' believed"


def test_a_sayable_fault_that_was_missed_is_doubted(engine):
    assert sayable((LEG, WEAK), WALKING)
    assert doubted(engine, (LEG, WEAK), (LEG,)).said


def test_what_shows_late_in_a_trial_is_doubted_where_its_beginning_is_foretold_to_the_digit(engine):
    """A jam that a gait drives against after seconds only: till then nothing has changed."""
    (driver,) = networks(1)
    body = PhysicalRobot(engine, ROBOT, (WEAK,), SEED)
    log = body.trial(driver, 200)
    late = log.sensors.copy()
    late[150:] += 0.01

    def of(*logs):
        changed = [(driver, one) for one in logs]
        return doubt(
            ROBOT, (WEAK,), [], changed, RollingMean(), SerialEvaluator(engine), 0.0, np.random.SeedSequence(3)
        )

    as_foretold = of(log)
    assert not as_foretold.said and as_foretold.later_s is None
    found = of(log, replace(log, sensors=late))
    assert found.left <= found.allowed and found.said and found.later_s == log.times_s[150]
    assert "Something shows later" in found.words and f"from {found.later_s:.2g} s on" in found.words
    assert doubt_from(json.loads(json.dumps(found.as_dict()))) == found


def test_a_magnitude_between_two_decimals_is_no_doubt(engine):
    """The truth lies between what genomes can say; the nearest is right all the same."""
    between, nearest = (term("motor_weak", "knee_front_left", loss=0.5022),), (WEAK,)
    found = doubted(engine, between, nearest)
    assert 0.0 < found.left <= found.rounding and not found.said
    far = (term("motor_weak", "knee_front_left", loss=0.6),)
    assert doubted(engine, between, far).said


def test_declared_noise_is_allowed_for(engine):
    noise = 0.02
    right = doubted(engine, (WEAK,), (WEAK,), noise)
    assert right.noise > 0.0 and right.left > 0.0 and not right.said
    assert doubted(engine, (WEAK,), (LEG,), noise).said
    undeclared = doubted(engine, (WEAK,), (WEAK,), noise, declared=0.0)
    assert undeclared.noise > 0.0, "the intact trial shows noise that nobody declared"


def test_noise_makes_false_doubts_of_one_run_in_a_hundred_at_most(engine):
    said = 0
    for k in range(12):
        body = PhysicalRobot(engine, ROBOT, (LEG,), np.random.SeedSequence(100 + k), 0.02)
        trials = [(c, body.trial(c, 60)) for c in networks(2)]
        said += doubt(
            ROBOT, (LEG,), [], trials, RollingMean(), SerialEvaluator(engine), 0.02, np.random.SeedSequence(k)
        ).said
    assert said == 0


def test_the_same_seed_gives_the_same_doubt(engine):
    assert doubted(engine, (WEAK,), (WEAK,), 0.02) == doubted(engine, (WEAK,), (WEAK,), 0.02)


def test_next_magnitudes():
    assert next_to(LEG, WALKING) == []
    assert [t.values[0][1] for t in next_to(WEAK, WALKING)] == pytest.approx([0.495, 0.505])
    assert [t.values[0][1] for t in next_to(term("motor_weak", "knee_front_left", loss=1.0), WALKING)] == [0.995]
    tilted = term("floor_tilt", "floor", sideways_deg=30.0)
    assert [t.values[0][1] for t in next_to(tilted, WALKING)] == pytest.approx([29.7])


def test_what_genomes_can_say():
    assert sayable((), WALKING)
    assert sayable((term("part_mass", "body", change=2.0),), WALKING)
    assert not sayable((term("part_mass", "body", change=0.5),), WALKING), "heavier by 100 to 200 % only"
    assert sayable((term("floor_tilt", "floor", sideways_deg=30.0),), WALKING)
    assert not sayable((WEAK, term("backlash", "knee_front_left", gap_rad=0.1)), WALKING)


def test_a_doubt_survives_json_and_a_model_that_flies_apart_is_doubted():
    found = Doubt(math.inf, 0.0, 0.1, 0.5, 5)
    told = json.loads(json.dumps(found.as_dict(), allow_nan=False))
    assert told["said"] and told["left"] is None
    assert doubt_from(told) == found
    assert "inf" in found.words
    assert Doubt(math.nan, 0.0, 0.1, 0.5, 5).said
