"""Where a robot that walks about stands, as far as its joints and its tilt tell: with its lowest point on the floor."""

from __future__ import annotations

import math

import numpy as np

from ee_dist.robots.kinematics import Array, compose, part_poses, quat_rotate
from ee_dist.robots.model import Robot, Shape
from ee_dist.robots.urdf import turn_of_rpy

UPWARDS = np.eye(3)


def stood(robot: Robot, joints: Array, roll_rad: float | None, pitch_rad: float | None) -> Array:
    """Pose (7,) of the base at joint positions (M,), tilted by roll and pitch (as described where both are None): over its
    start, on the floor if there is one."""
    pose = np.array([*robot.start_position_m, *robot.start_rotation])
    if roll_rad is not None or pitch_rad is not None:
        x, y, z, w = robot.start_rotation
        heading = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
        pose[3:] = turn_of_rpy((roll_rad or 0.0, pitch_rad or 0.0, heading))
    if robot.world.has_floor and math.isfinite(low := lowest_m(robot, pose, joints)):
        pose[2] -= low
    return pose


def lowest_m(robot: Robot, base_pose: Array, joints: Array) -> float:
    """Height of the lowest point of any shape of the robot; endless where it has none."""
    poses = part_poses(robot, base_pose, joints[None, :])
    heights = [
        _bottom(shape, compose(poses[part.name][0], np.array([*shape.position_m, *shape.rotation])))
        for part in robot.present_parts
        for shape in part.shapes
    ]
    return min(heights, default=math.inf)


def _bottom(shape: Shape, pose: Array) -> float:
    """Height of the lowest point of a shape at a pose (7,)."""
    # How much of each of its axes points up.
    up = np.abs(quat_rotate(pose[3:], UPWARDS)[:, 2])
    if shape.kind == "box":
        reach = float(up @ np.array(shape.size))
    elif shape.kind == "sphere":
        reach = shape.size[0]
    elif shape.kind == "capsule":
        reach = shape.size[0] + shape.size[1] / 2 * up[2]
    else:
        reach = shape.size[0] * math.sqrt(max(0.0, 1.0 - up[2] ** 2)) + shape.size[1] / 2 * up[2]
    return float(pose[2]) - float(reach)
