"""A robot that falls over where the real one stands: what comes after in a simulation tells nothing of its drives."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ee_dist.basics.names import listed
from ee_dist.discrepancy.measured_trial import MeasuredTrial
from ee_dist.robots.model import Robot
from ee_dist.trials.log import Array, SensorLog
from ee_dist.trials.motion import base_poses

OVER = 0.5
"""How much of a base's own upwards is left when it has fallen over: half, at 60 degrees."""


def fallen(robot: Robot, trials: Sequence[MeasuredTrial], simulated: Sequence[SensorLog | None]) -> list[str]:
    """A line on the trials in which the simulated base falls over while the real one, as far as its sensors tell, does not."""
    if not robot.free_base:
        return []
    found = []
    for trial, log in zip(trials, simulated, strict=True):
        if log is None or log.base_pose is None:
            continue
        over = np.flatnonzero(_upright(log.base_pose) < OVER * _upright(log.base_pose[:1])[0])
        real = _upright(base_poses(robot, trial.log, np.arange(len(trial.log))))
        if len(over) and real[: over[0] + 1].min() > OVER:
            found.append(f"{trial.name} at {log.times_s[over[0]]:.2f} s")
    if not found:
        return []
    return [
        f"The simulated robot falls over where the real one stands: {listed(found)}. What comes after tells nothing of its "
        "drives: look at its feet (shapes, friction) and its start first."
    ]


def _upright(poses: Array) -> Array:
    """(T,) how much of the base's own upwards points up, of poses (T, 7)."""
    return np.asarray(1.0 - 2.0 * (poses[:, 3] ** 2 + poses[:, 4] ** 2))
