"""How a robot stood and where it was, as far as a log tells: for pictures, not for numbers."""

from __future__ import annotations

import numpy as np

from ee_dist.robots.model import Robot
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


def base_poses(robot: Robot, log: SensorLog) -> Array:
    """Pose (T, 7) of the root part: as logged, else where the robot starts."""
    if log.base_pose is not None:
        return log.base_pose
    return np.tile(np.array([*robot.start_position_m, *robot.start_rotation]), (len(log), 1))
