"""The posterior over listed faults, on a robot whose fault is known."""

from __future__ import annotations

import numpy as np
import pytest

from ee_dist.effects import term
from ee_dist.engines.mujoco.engine import MuJoCoEngine
from ee_dist.evaluation.cache import CachedEvaluator
from ee_dist.evaluation.physical import PhysicalRobot
from ee_dist.evaluation.serial import SerialEvaluator
from ee_dist.recovery.loop import Plan
from ee_dist.recovery.metrics import RollingMean
from ee_dist.recovery.repair import network
from ee_dist.rivals.bayes import Inference, Posterior, faults
from ee_dist.rivals.setting import Setting
from ee_dist.robots.quadruped import quadruped

ROBOT = quadruped()
SEED = np.random.SeedSequence(0)


@pytest.fixture(scope="module")
def engine():
    made = MuJoCoEngine(threads=1)
    yield made
    made.close()


def test_the_list_says_nothing_first_and_everything_once():
    single, both = faults(ROBOT, pairs=False), faults(ROBOT)
    assert single[0] == () and both[: len(single)] == single
    assert len(single) == 1 + 8 + 9 * 3 + 3 * 8 * 4 + 3 * 2
    assert len(set(both)) == len(both)
    assert {len(h) for h in both} == {0, 1, 2}
    assert (term("motor_weak", "knee_front_left", loss=0.5),) in single
    assert (term("motor_weak", "knee_front_left", loss=0.5),) not in faults(ROBOT, beside=True)


def test_the_rule_is_that_of_bayes():
    posterior = Posterior(3)
    posterior.update(np.array([0.1, 0.2, np.inf]), windows=2, noise=0.1)
    odds = np.exp(-2 * 0.1 / 0.1) / np.exp(-2 * 0.2 / 0.1)
    found = posterior.probabilities
    assert found[0] / found[1] == pytest.approx(odds)
    assert found[2] == 0.0 and found.sum() == pytest.approx(1.0)
    posterior.update(np.array([0.4, 0.1, 0.0]), windows=2, noise=0.1)
    assert posterior.best == 1, "both trials count"


@pytest.mark.parametrize(
    "hidden", [term("motor_weak", "knee_front_left", loss=0.5), term("part_lost", "upper_rear_left")]
)
def test_a_listed_fault_is_the_most_probable_after_a_trial_and_no_less_after_two(engine, hidden):
    body = PhysicalRobot(engine, ROBOT, (hidden,), SEED)
    evaluator = CachedEvaluator(SerialEvaluator(engine))
    setting = Setting(ROBOT, body, body, RollingMean(), Plan(), evaluator, SEED)
    infer = Inference(setting, faults(ROBOT, pairs=False))
    sure, trials = [], []
    for k in range(2):
        driver = network(np.random.default_rng(k).integers(-100, 101, 68).astype(np.int16))
        trials.append((driver, body.trial(driver, 100)))
        believed, error = infer(trials, k, SEED)
        assert believed == (hidden,)
        assert error == pytest.approx(0.0, abs=1e-12)
        sure.append(infer.posterior.probabilities.max())
    assert 0.9 < sure[0] <= sure[1]
