"""The sensing path over a whole trial at once gives what it gives step by step."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from ee_dist.engines.sensing import SensingPath
from ee_dist.robots.describe import load_robot

ROBOT = load_robot("quadruped")[0]
STEPS, DT = 40, 0.01
FAULTS = {
    "missed_touch": 0.05,
    "gain": 1.3,
    "bias": -0.2,
    "delay_s": 0.037,
    "noise": 0.3,
    "dropout": 0.4,
    "quantum": 0.25,
    "stuck": 0.7,
}


@settings(max_examples=60, deadline=None)
@given(chosen=st.sets(st.sampled_from(sorted(FAULTS))), robots=st.integers(1, 4), seed=st.integers(0, 2**32 - 1))
def test_all_steps_at_once_are_the_steps_one_by_one(chosen: set[str], robots: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    batch = []
    for _ in range(robots):
        sensors = []
        for sensor in ROBOT.sensors:
            has = {name: FAULTS[name] for name in chosen if rng.random() < 0.6}
            if "stuck" in has:
                has["stuck_from_s"] = float(rng.choice([0.0, 0.1, 0.205, 9.0]))
            sensors.append(replace(sensor, **has))
        batch.append(replace(ROBOT, sensors=tuple(sensors)))
    # Touch sensors say 1 or -1, and stay pressed for a while.
    true = np.sign(np.cumsum(rng.normal(size=(STEPS, robots, len(ROBOT.sensors))), axis=0))
    true += np.where([s.kind == "touch" for s in ROBOT.sensors], 0.0, rng.normal(size=true.shape))
    seeds = [None if rng.random() < 0.3 else int(k) for k in range(robots)]
    path = SensingPath(batch, DT, STEPS, seeds)
    known = np.stack([path.step(k, row) for k, row in enumerate(true)])
    found = SensingPath(batch, DT, STEPS, seeds).over(true)
    assert np.array_equal(found, known)
