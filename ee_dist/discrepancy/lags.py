"""By how much what a joint does comes after what it was told, as a log shows it: how long a delay is worth trying.

The drive's own sluggishness is in it too. A range that ends before the delay makes softer gains of it, which are as late.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ee_dist.discrepancy.measured_trial import MeasuredTrial
from ee_dist.measurements.signals import MOST_ROWS, lead
from ee_dist.robots.model import Robot
from ee_dist.trials.log import SensorLog

FOLLOWS = 0.8
"""Correlation from which a position follows its command, and is not only on the same side of things."""


def with_lags(robot: Robot, trials: Sequence[MeasuredTrial]) -> Robot:
    """The robot with the lag (s) of each joint that is told positions, the median of its trials; the same robot where no reading
    follows a command."""
    at = {s.target: k for k, s in enumerate(robot.sensors) if s.kind == "position"}
    lags = {}
    for k, drive in enumerate(robot.drives):
        if drive.command == "position" and drive.joint in at:
            seen = [_lag(t.log, k, at[drive.joint]) for t in trials]
            lags[drive.joint] = float(np.median([s for s in seen if s is not None] or [0.0]))
    if not any(lags.values()):
        return robot
    return replace(robot, joints=tuple(replace(j, lag_s=lags.get(j.name, 0.0)) for j in robot.joints))


def _lag(log: SensorLog, motor: int, sensor: int) -> float | None:
    """None where it cannot be told: the joint rests, repeats itself, or follows nothing."""
    told, seen = log.commands[:MOST_ROWS, [motor]], log.sensors[:MOST_ROWS, [sensor]]
    if not (np.isfinite(told).all() and np.isfinite(seen).all()):
        return None
    found = lead(told, seen, float(np.median(np.diff(log.times_s))))
    if abs(found.correlation) < FOLLOWS or found.repeats:
        return None
    return max(found.lead_s, 0.0)
