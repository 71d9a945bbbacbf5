"""A truth between what genomes can say is no doubt: one step of the magnitudes nearly always covers it, contacts and all."""

from __future__ import annotations

import numpy as np
import pytest

from ee_dist.effects.catalogue import apply
from ee_dist.engines.contract import Rollout
from ee_dist.engines.drivers import Network
from ee_dist.engines.mujoco.engine import MuJoCoEngine
from ee_dist.evaluation.jobs import Job, Whole
from ee_dist.evaluation.serial import SerialEvaluator
from ee_dist.recovery.doubt import doubt
from ee_dist.recovery.metrics import RollingMean
from ee_dist.recovery.walking import WALKING
from ee_dist.robots.quadruped import quadruped

CASES = 60


@pytest.mark.slow
def test_the_nearest_hypothesis_to_a_truth_is_seldom_doubted():
    robot, rng, said = quadruped(), np.random.default_rng(0), []
    engine = MuJoCoEngine(threads=1)
    evaluator = SerialEvaluator(engine)
    for k in range(CASES):
        picked = []
        for _ in range(int(rng.integers(1, 4))):
            situation = WALKING.situations[int(rng.integers(1, 6))]
            places = situation.places(robot)
            picked.append((situation, places[int(rng.integers(len(places)))], float(rng.uniform(-99, 99))))
        if len({(s.effect, place) for s, place, _ in picked}) < len(picked):
            continue
        truth = tuple(s.term(place, much) for s, place, much in picked)
        nearest = tuple(s.term(place, round(much)) for s, place, much in picked)
        drivers = [Network(tuple(np.round(rng.uniform(-1, 1, 68), 2).tolist())) for _ in range(4)]
        logs = evaluator.evaluate([Job(Rollout(apply(robot, truth), d, 60), Whole()) for d in drivers])
        trials = list(zip(drivers, logs, strict=True))
        said.append(doubt(robot, nearest, [], trials, RollingMean(), evaluator, 0.0, np.random.SeedSequence(k)).said)
    engine.close()
    print(f"{sum(said)} false doubts of {len(said)}")
    assert len(said) > CASES / 2
    assert sum(said) <= 0.05 * len(said), (
        f"{sum(said)} of {len(said)}: contacts make some steps larger than their neighbours"
    )
