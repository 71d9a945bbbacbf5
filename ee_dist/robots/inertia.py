"""How heavy each joint feels: lower bounds that keep discrete friction from reversing the motion it stops."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ee_dist.basics.quoted import quoted
from ee_dist.robots.model import Joint, Robot, RobotError

Array = NDArray[np.float64]

POSES = 4
"""Poses beside position zero at which ``steady_inertia`` looks."""


def rotation_matrix(quaternion: tuple[float, float, float, float]) -> Array:
    """(3, 3) of a unit quaternion, scalar last."""
    x, y, z, w = quaternion
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def mass_matrix(robot: Robot) -> Array:
    """Generalised mass matrix at joint position zero, (n, n): six rows of the root if it is free, then the joints that move.

    Sums J^T I J over the parts (Featherstone, Rigid Body Dynamics Algorithms, 2008, section 6), rotor inertia added.
    """
    return mass_matrices(robot, np.zeros((1, len(_moving(robot)))))[0, 0]


def mass_matrices(robot: Robot, positions: Array) -> Array:
    """Mass matrices (2, P, n, n) at joint positions (P, joints that move), for both ways in which engines count rotors.

    The first counts a rotor's inertia on its joint, as it is. The second counts it on the part that the joint moves,
    where an engine that knows no rotors puts it.
    """
    joints, count = _moving(robot), len(positions)
    free = 6 if robot.free_base else 0
    n = free + len(joints)
    column = {j.name: free + i for i, j in enumerate(joints)}
    axes, pivots = np.zeros((count, n, 3)), np.zeros((count, n, 3))
    place = {robot.root.name: (np.zeros((count, 3)), np.broadcast_to(np.eye(3), (count, 3, 3)))}
    path: dict[str, list[int]] = {robot.root.name: list(range(free))}
    slides = np.zeros(n, dtype=bool)
    slides[: free // 2] = True
    axes[:, :free] = np.eye(3)[np.arange(free) % 3]
    for joint in _parents_first(robot):
        origin, turn = place[joint.parent]
        here, facing = origin + turn @ np.array(joint.position_m), turn @ rotation_matrix(joint.rotation)
        path[joint.child] = path[joint.parent]
        if joint.kind != "fixed":
            c = column[joint.name]
            path[joint.child] = [*path[joint.parent], c]
            moved = positions[:, c - free]
            axes[:, c], pivots[:, c] = facing @ np.array(joint.axis), here
            slides[c] = joint.kind == "slide"
            if slides[c]:
                here = here + moved[:, None] * axes[:, c]
            elif moved.any():
                facing = facing @ _turned(np.array(joint.axis), moved)
        place[joint.child] = (here, facing)
    rotor = {d.joint: d.rotor_inertia for d in robot.drives}
    carrier = {j.child: j for j in joints}
    plain, extra = np.zeros((count, n, n)), np.zeros((count, n, n))
    for part in robot.present_parts:
        here, facing = place[part.name]
        com = here + facing @ np.array(part.com_m)
        xx, yy, zz, xy, xz, yz = part.inertia_kg_m2
        inertia = facing @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ facing.swapaxes(1, 2)
        ways = np.array(path[part.name], dtype=int)
        axis, along = axes[:, ways], slides[ways][:, None]
        linear = np.where(along, axis, _cross(axis, com[:, None] - pivots[:, ways]))
        angular = np.where(along, 0.0, axis)
        block = np.ix_(np.arange(count), ways, ways)
        plain[block] += part.mass_kg * linear @ linear.swapaxes(1, 2) + angular @ inertia @ angular.swapaxes(1, 2)
        joint_of = carrier.get(part.name)
        if joint_of is not None and rotor.get(joint_of.name):
            c = column[joint_of.name]
            share = linear if slides[c] else (angular @ axes[:, c, :, None])
            extra[block] += rotor[joint_of.name] * share @ share.swapaxes(1, 2)
    on_joint = np.zeros(n)
    on_joint[free:] = [rotor.get(j.name, 0.0) for j in joints]
    return np.stack([plain + np.diag(on_joint), plain + extra])


def felt_inertia(robot: Robot) -> Array:
    """Inertia that a torque on each drive's joint meets with the rest of the robot free to move, (M,): 1 / (M^-1)_jj.

    Read-only.
    """
    return _felt(_Body(robot))


def steady_inertia(robot: Robot) -> Array:
    """Inertia (M,) with which all joints can be stopped at once in one step without any being thrown back. Read-only.

    With D = diag(d), stopping every joint by a torque d * speed / dt turns speeds v into (1 - M^-1 D) v. The row sums
    d_j * sum_k |(M^-1)_jk| are at most 1 here (Gershgorin), so nothing is amplified. It is the least value over position
    zero and some others, and over both ways in which engines count rotors. For one joint on a bolted base it is the true inertia.
    """
    return _steady(_Body(robot))


class _Body:
    """A robot that is equal to others with the same answers: a hypothesis seldom changes what inertia depends on."""

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        self.key = (
            tuple((p.name, p.mass_kg, p.com_m, p.inertia_kg_m2) for p in robot.parts),
            tuple((j.name, j.kind, j.parent, j.child) for j in robot.joints),
            tuple((j.position_m, j.rotation, j.axis, j.lower, j.upper) for j in robot.joints),
            tuple((d.joint, d.rotor_inertia) for d in robot.drives),
            robot.free_base,
            robot.lost,
        )

    def __hash__(self) -> int:
        return hash(self.key)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Body) and self.key == other.key


@lru_cache(maxsize=2048)
def _felt(body: _Body) -> Array:
    robot = body.robot
    inverse = np.linalg.inv(mass_matrix(robot))
    free = 6 if robot.free_base else 0
    felt = {j.name: 1.0 / float(inverse[free + i, free + i]) for i, j in enumerate(_moving(robot))}
    return _fixed(np.array([felt.get(d.joint, 1.0) for d in robot.drives]))


@lru_cache(maxsize=2048)
def _steady(body: _Body) -> Array:
    robot = body.robot
    joints, driven = _moving(robot), {d.joint for d in robot.drives}
    free = 6 if robot.free_base else 0
    rows = [free + i for i, j in enumerate(joints) if j.name in driven]
    # The inertia of a single joint on a bolted base does not depend on where it stands.
    poses = 1 + POSES * (free + len(joints) > 1)
    rng = np.random.default_rng(0)
    positions = np.zeros((poses, len(joints)))
    for k, joint in enumerate(joints):
        positions[1:, k] = rng.uniform(*_reach(joint), poses - 1)
    inverse = np.linalg.inv(mass_matrices(robot, positions))[..., rows, :][..., rows]
    least = (1.0 / np.abs(inverse).sum(axis=-1)).min(axis=(0, 1))
    steady = dict(zip((joints[r - free].name for r in rows), least.tolist(), strict=True))
    return _fixed(np.array([steady.get(d.joint, 1.0) for d in robot.drives]))


def _moving(robot: Robot) -> list[Joint]:
    return [j for j in robot.present_joints if j.kind != "fixed"]


def _reach(joint: Joint) -> tuple[float, float]:
    widest = math.pi if joint.kind == "hinge" else 1.0
    return max(joint.lower, -widest), min(joint.upper, widest)


def _parents_first(robot: Robot) -> list[Joint]:
    """The present joints, each after the one that carries its parent."""
    waiting, placed, order = list(robot.present_joints), {robot.root.name}, []
    while waiting:
        ready = [j for j in waiting if j.parent in placed]
        if not ready:
            raise RobotError(
                f"joint {quoted(waiting[0].name)} hangs on {quoted(waiting[0].parent)}, which no joint carries"
            )
        order += ready
        placed |= {j.child for j in ready}
        waiting = [j for j in waiting if j.child not in placed]
    return order


def _turned(axis: Array, angle: Array) -> Array:
    """Rotation matrices (P, 3, 3) about one axis (Rodrigues)."""
    x, y, z = axis / np.linalg.norm(axis)
    k = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    s, c = np.sin(angle)[:, None, None], np.cos(angle)[:, None, None]
    return np.eye(3) + s * k + (1.0 - c) * (k @ k)


def _cross(a: Array, b: Array) -> Array:
    x, y, z = np.moveaxis(a, -1, 0)
    u, v, w = np.moveaxis(b, -1, 0)
    return np.stack([y * w - z * v, z * u - x * w, x * v - y * u], axis=-1)


def _fixed(values: Array) -> Array:
    values.setflags(write=False)
    return values
