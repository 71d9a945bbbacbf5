"""How a robot stood and where it was, as far as a log tells."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ee_dist.robots.model import Robot
from ee_dist.robots.standing import stood
from ee_dist.trials.log import Array, SensorLog


def joint_positions(robot: Robot, log: SensorLog) -> Array:
    """Joint positions (T, M) as far as a log tells: its own, else from position or angle channels, else zero."""
    if log.joints is not None and log.motor_names == robot.motor_names:
        return log.joints
    found = np.zeros((len(log), len(robot.drives)))
    column = {name: k for k, name in enumerate(robot.motor_names)}
    for sensor in robot.sensors:
        if sensor.target not in column or sensor.name not in log.sensor_names:
            continue
        if sensor.kind == "position":
            found[:, column[sensor.target]] = log.channel(sensor.name)
        elif sensor.kind == "angle":
            joint = robot.joint(sensor.target)
            middle, half = (joint.lower + joint.upper) / 2, (joint.upper - joint.lower) / 2
            found[:, column[sensor.target]] = middle + half * log.channel(sensor.name)
    return found


def base_poses(robot: Robot, log: SensorLog, rows: NDArray[np.intp]) -> Array:
    """Pose (K, 7) of the root part at some rows: as logged, or, of a robot that moves about, tilted as its own sensors say and on
    the floor, over its start; else where the robot starts."""
    if log.base_pose is not None:
        return log.base_pose[rows]
    if robot.free_base:
        tilts = [_tilt(robot, log, kind, rows) for kind in ("roll", "pitch")]
        return stood(robot, joint_positions(robot, log)[rows], *tilts)
    return np.tile(np.array([*robot.start_position_m, *robot.start_rotation]), (len(rows), 1))


def _tilt(robot: Robot, log: SensorLog, kind: str, rows: NDArray[np.intp]) -> Array | None:
    """(K,) rad by the first sensor of a kind; None where there is none in the log, or it said nothing in one of the rows."""
    names = [s.name for s in robot.sensors if s.kind == kind and s.name in log.sensor_names]
    read = log.channel(names[0])[rows] if names else np.full(1, np.nan)
    return read if np.isfinite(read).all() else None
