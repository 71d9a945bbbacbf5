"""Forward kinematics: where every part of a robot is, for a whole series of rows at once.

Arrays are (T, ...): one row per time. Quaternions are unit, scalar last (x, y, z, w).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ee_dist.robots.mass_matrix import parents_first
from ee_dist.robots.model import Joint, Robot

Array = NDArray[np.float64]


def quat_multiply(a: Array, b: Array) -> Array:
    """The turn ``b`` followed by ``a``: (..., 4) times (..., 4) gives (..., 4), with broadcasting."""
    ax, ay, az, aw = np.moveaxis(a, -1, 0)
    bx, by, bz, bw = np.moveaxis(b, -1, 0)
    return np.stack(
        [
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
            aw * bw - ax * bx - ay * by - az * bz,
        ],
        axis=-1,
    )


def quat_rotate(q: Array, v: Array) -> Array:
    """Vectors ``v`` (..., 3) turned by ``q`` (..., 4): (..., 3), with broadcasting."""
    axis, w = q[..., :3], q[..., 3:]
    across = 2.0 * np.cross(axis, v)
    return v + w * across + np.cross(axis, across)


def compose(outer: Array, inner: Array) -> Array:
    """Pose (..., 7) of ``inner`` seen from the frame in which ``outer`` is given, with broadcasting."""
    position = outer[..., :3] + quat_rotate(outer[..., 3:], inner[..., :3])
    turn = quat_multiply(outer[..., 3:], inner[..., 3:])
    return np.concatenate([position, turn], axis=-1)


def part_poses(robot: Robot, base_pose: Array, joints: Array) -> dict[str, Array]:
    """Pose (T, 7) as x, y, z (m), qx, qy, qz, qw of the frame of every present part, by name of the part.

    ``base_pose`` (T, 7), or (7,) for a base that stands still, is the frame of the root part; poses come out in the
    frame in which it is given. ``joints`` (T, M) are positions in the order of ``robot.drives``, rad or m. A joint
    without a drive stays at zero. A lost part is absent. Raises ValueError for arrays of another shape.
    """
    if joints.ndim != 2 or joints.shape[1] != len(robot.drives):
        raise ValueError(f"joint positions have shape {joints.shape}, expected (T, {len(robot.drives)})")
    rows = len(joints)
    if base_pose.shape not in ((7,), (rows, 7)):
        raise ValueError(f"base pose has shape {base_pose.shape}, expected ({rows}, 7)")
    column = {d.joint: k for k, d in enumerate(robot.drives)}
    poses: dict[str, Array] = {robot.root.name: np.broadcast_to(base_pose, (rows, 7)).astype(float)}
    for joint in parents_first(robot.present_joints, robot.root.name):
        position = joints[:, column[joint.name]] if joint.name in column else np.zeros(rows)
        poses[joint.child] = compose(poses[joint.parent], joint_pose(joint, position))
    return {p.name: poses[p.name] for p in robot.present_parts}


def joint_pose(joint: Joint, position: Array) -> Array:
    """Pose (T, 7) of the child's frame in the parent's, at joint positions (T,)."""
    fixed = np.array([*joint.position_m, *joint.rotation])
    moved = np.zeros((len(position), 7))
    moved[:, 6] = 1.0
    if joint.kind != "fixed":
        axis = np.array(joint.axis) / np.linalg.norm(joint.axis)
        if joint.kind == "slide":
            moved[:, :3] = position[:, None] * axis
        else:
            moved[:, 3:6] = np.sin(position / 2)[:, None] * axis
            moved[:, 6] = np.cos(position / 2)
    return compose(fixed, moved)
