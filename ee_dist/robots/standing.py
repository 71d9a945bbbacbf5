"""Where a robot that walks about stands, as far as its joints and its tilt tell: with its lowest point on the floor."""

from __future__ import annotations

import math

import numpy as np

from ee_dist.robots.kinematics import Array, compose, part_poses, quat_rotate
from ee_dist.robots.model import Robot, Shape
from ee_dist.robots.urdf_attributes import turn_of_rpy

UPWARDS = np.eye(3)


def stood(robot: Robot, joints: Array, roll_rad: Array | None, pitch_rad: Array | None) -> Array:
    """Poses (T, 7) of the base at joint positions (T, M), tilted by roll and pitch (T,), as described where both are None: over
    its start, on the floor if there is one."""
    pose = np.tile(np.array([*robot.start_position_m, *robot.start_rotation]), (len(joints), 1))
    if roll_rad is not None or pitch_rad is not None:
        x, y, z, w = robot.start_rotation
        heading = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
        level = np.zeros(len(joints))
        tilts = zip(level if roll_rad is None else roll_rad, level if pitch_rad is None else pitch_rad, strict=True)
        pose[:, 3:] = [turn_of_rpy((float(roll), float(pitch), heading)) for roll, pitch in tilts]
    if robot.world.has_floor:
        low = lowest_m(robot, pose, joints)
        pose[:, 2] -= np.where(np.isfinite(low), low, 0.0)
    return pose


def lowest_m(robot: Robot, base_pose: Array, joints: Array) -> Array:
    """Height (T,) of the lowest point of any shape of the robot; endless where it has none."""
    poses = part_poses(robot, base_pose, joints)
    found = np.full(len(joints), math.inf)
    for part in robot.present_parts:
        for shape in part.shapes:
            at = compose(poses[part.name], np.array([*shape.position_m, *shape.rotation]))
            found = np.minimum(found, _bottom(shape, at))
    return found


def _bottom(shape: Shape, pose: Array) -> Array:
    """Height (T,) of the lowest point of a shape at poses (T, 7)."""
    # How much of each of its axes points up.
    up = np.abs(quat_rotate(pose[:, None, 3:], UPWARDS)[..., 2])
    if shape.kind == "box":
        reach = up @ np.array(shape.size)
    elif shape.kind == "sphere":
        reach = np.full(len(pose), shape.size[0])
    elif shape.kind == "capsule":
        reach = shape.size[0] + shape.size[1] / 2 * up[:, 2]
    else:
        reach = shape.size[0] * np.sqrt(np.maximum(0.0, 1.0 - up[:, 2] ** 2)) + shape.size[1] / 2 * up[:, 2]
    return np.asarray(pose[:, 2] - reach)
