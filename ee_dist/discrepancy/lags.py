"""By how much what a joint does comes after what it was told, as a log shows it: how long a delay is worth trying.

The drive's own sluggishness is in it too. A range that ends before the delay makes softer gains of it, which are as late.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ee_dist.discrepancy.measured_trial import MeasuredTrial
from ee_dist.engines.goals import SAME
from ee_dist.measurements.signals import MOST_ROWS, lead
from ee_dist.robots.model import Robot
from ee_dist.trials.log import Array, SensorLog

FOLLOWS = 0.8
"""Correlation from which a reading follows its command, and is not only on the same side of things."""


def with_lags(robot: Robot, trials: Sequence[MeasuredTrial]) -> Robot:
    """The robot with the lag (s) of each driven joint, the median of its trials: of its position, its speed or the torque of its
    motor behind what it was told of that; the same robot where no reading follows a command."""
    lags = {}
    for k, drive in enumerate(robot.drives):
        told = [(t.log, seen) for t in trials if (seen := _obeying(t.log, robot, k)) is not None]
        found = [s for log, seen in told if (s := _lag(log, k, seen)) is not None]
        if found:
            lags[drive.joint] = float(np.median(found))
    if not any(lags.values()):
        return robot
    return replace(robot, joints=tuple(replace(j, lag_s=lags.get(j.name, 0.0)) for j in robot.joints))


def told_anew_s(trials: Sequence[MeasuredTrial], motors: Sequence[int]) -> float:
    """s from one change of what any of these motors is told to the next, the median of all trials; 0 where none has two."""
    lasted: list[float] = []
    for log in (t.log for t in trials):
        anew = np.any(np.abs(np.diff(log.commands[:, list(motors)], axis=0)) > SAME, axis=1)
        lasted += np.diff(log.times_s[1:][anew]).tolist()
    return float(np.median(lasted)) if lasted else 0.0


def _obeying(log: SensorLog, robot: Robot, motor: int) -> Array | None:
    """(T,) what was read of what a drive is told: None where that was not read, or is no more than what was told."""
    drive = robot.drives[motor]
    if drive.command == "torque":
        seen = None if log.torques is None else log.torques[:, motor]
        return None if seen is None or np.array_equal(seen, log.commands[:, motor]) else seen
    kind = {"position": "position", "speed": "velocity"}.get(drive.command)
    at = [i for i, s in enumerate(robot.sensors) if s.kind == kind and s.target == drive.joint]
    return log.sensors[:, at[0]] if at else None


def _lag(log: SensorLog, motor: int, seen: Array) -> float | None:
    """None where it cannot be told: the joint rests, repeats itself, or follows nothing."""
    told, read = log.commands[:MOST_ROWS, [motor]], seen[:MOST_ROWS, None]
    if not (np.isfinite(told).all() and np.isfinite(read).all()):
        return None
    found = lead(told, read, float(np.median(np.diff(log.times_s))))
    if abs(found.correlation) < FOLLOWS or found.repeats:
        return None
    return max(found.lead_s, 0.0)
