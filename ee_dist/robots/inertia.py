"""How heavy each joint feels: lower bounds that keep discrete friction from reversing the motion it stops."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ee_dist.robots.model import Drive, Joint, Robot, RobotError, Wiring

POSES = 4
"""Poses beside position zero at which ``steady_inertia`` looks."""
_PLAIN = Drive("", kp=0.0, ki=0.0, kd=0.0, torque_limit=0.0, speed_limit=0.0)


def rotation_matrix(quaternion: tuple[float, float, float, float]) -> NDArray[np.float64]:
    """(3, 3) of a unit quaternion, scalar last."""
    x, y, z, w = quaternion
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def mass_matrix(
    robot: Robot, positions: Mapping[str, float] | None = None, rotor_on_part: bool = False
) -> NDArray[np.float64]:
    """Generalised mass matrix (n, n): six rows of the root if it is free, then the joints that move.

    ``positions`` are joint positions by name (rad or m), zero where not given. Sums J^T I J over the parts
    (Featherstone, Rigid Body Dynamics Algorithms, 2008, section 6), rotor inertia added: on the joint, as it is, or with
    ``rotor_on_part`` on the part that the joint moves, where an engine without rotors puts it.
    """
    at = positions or {}
    joints = [j for j in robot.present_joints if j.kind != "fixed"]
    carrier = {j.child: j.name for j in joints}
    free = 6 if robot.free_base else 0
    n = free + len(joints)
    place = {robot.root.name: (np.zeros(3), np.eye(3))}
    path: dict[str, tuple[str, ...]] = {robot.root.name: ()}
    axes: dict[str, tuple[NDArray[np.float64], NDArray[np.float64], str]] = {}
    for joint in _parents_first(robot):
        origin, turn = place[joint.parent]
        here, facing = origin + turn @ np.array(joint.position_m), turn @ rotation_matrix(joint.rotation)
        axis, moved = facing @ np.array(joint.axis), at.get(joint.name, 0.0)
        if moved and joint.kind == "slide":
            here = here + moved * axis
        elif moved and joint.kind == "hinge":
            half = np.array(joint.axis) * math.sin(moved / 2)
            facing = facing @ rotation_matrix((*half.tolist(), math.cos(moved / 2)))
        place[joint.child] = (here, facing)
        path[joint.child] = (*path[joint.parent], *(() if joint.kind == "fixed" else (joint.name,)))
        axes[joint.name] = (here, axis, joint.kind)
    column = {j.name: free + i for i, j in enumerate(joints)}
    rotor = {d.joint: d.rotor_inertia for d in robot.drives}
    on_part = {j.child: rotor.get(j.name, 0.0) for j in joints} if rotor_on_part else {}
    matrix = np.zeros((n, n))
    for part in robot.present_parts:
        here, facing = place[part.name]
        com = here + facing @ np.array(part.com_m)
        mass, extra = part.mass_kg, on_part.get(part.name, 0.0)
        xx, yy, zz, xy, xz, yz = part.inertia_kg_m2
        inertia = facing @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ facing.T
        if extra:
            _, axis, kind = axes[carrier[part.name]]
            if kind == "slide":
                mass = mass + extra
            else:
                inertia = inertia + extra * np.outer(axis, axis)
        linear, angular = np.zeros((3, n)), np.zeros((3, n))
        if free:
            linear[:, :3] = np.eye(3)
            angular[:, 3:6] = np.eye(3)
            for k in range(3):
                linear[:, 3 + k] = np.cross(np.eye(3)[k], com)
        for name in path[part.name]:
            pivot, axis, kind = axes[name]
            if kind == "slide":
                linear[:, column[name]] = axis
            else:
                linear[:, column[name]] = np.cross(axis, com - pivot)
                angular[:, column[name]] = axis
        matrix += mass * linear.T @ linear + angular.T @ inertia @ angular
    for name, c in column.items():
        matrix[c, c] += 0.0 if rotor_on_part else rotor.get(name, 0.0)
    return matrix


def felt_inertia(robot: Robot) -> NDArray[np.float64]:
    """Inertia that a torque on each drive's joint meets with the rest of the robot free to move, (M,): 1 / (M^-1)_jj.

    Read-only.
    """
    return _felt(_body(robot))


def steady_inertia(robot: Robot) -> NDArray[np.float64]:
    """Inertia (M,) with which all joints can be stopped at once in one step without any being thrown back. Read-only.

    With D = diag(d), stopping every joint by a torque d * speed / dt turns speeds v into (1 - M^-1 D) v. The row sums
    d_j * sum_k |(M^-1)_jk| are at most 1 here (Gershgorin), so nothing is amplified. It is the least value over position
    zero and some others, and over both ways in which engines count rotors. For one joint on a bolted base it is the true inertia.
    """
    return _steady(_body(robot))


def _body(robot: Robot) -> Robot:
    """What the inertia of a robot depends on, in a robot that is equal for equal answers."""
    drives = tuple(replace(_PLAIN, joint=d.joint, rotor_inertia=d.rotor_inertia) for d in robot.drives)
    parts = tuple(replace(p, shapes=()) for p in robot.parts)
    joints = tuple(replace(j, freedom=1.0) for j in robot.joints)
    return Robot("", parts, joints, drives, (), Wiring(()), free_base=robot.free_base, lost=robot.lost)


@lru_cache(maxsize=2048)
def _felt(robot: Robot) -> NDArray[np.float64]:
    joints = [j.name for j in robot.present_joints if j.kind != "fixed"]
    inverse = np.linalg.inv(mass_matrix(robot))
    free = 6 if robot.free_base else 0
    felt = {name: 1.0 / float(inverse[free + i, free + i]) for i, name in enumerate(joints)}
    return _fixed(np.array([felt.get(d.joint, 1.0) for d in robot.drives]))


@lru_cache(maxsize=2048)
def _steady(robot: Robot) -> NDArray[np.float64]:
    joints = [j for j in robot.present_joints if j.kind != "fixed"]
    driven = {d.joint for d in robot.drives}
    free = 6 if robot.free_base else 0
    rows = [free + i for i, j in enumerate(joints) if j.name in driven]
    names = [j.name for j in joints if j.name in driven]
    least = np.full(len(names), np.inf)
    rng = np.random.default_rng(0)
    some_rotor = any(d.rotor_inertia for d in robot.drives)
    # The inertia of a single joint on a bolted base does not depend on where it stands.
    for k in range(1 + POSES * (free + len(joints) > 1)):
        place = {j.name: 0.0 if k == 0 else rng.uniform(*_reach(j)) for j in joints}
        for rotor_on_part in (False, True) if some_rotor else (False,):
            inverse = np.linalg.inv(mass_matrix(robot, place, rotor_on_part))[np.ix_(rows, rows)]
            least = np.minimum(least, 1.0 / np.abs(inverse).sum(axis=1))
    steady = dict(zip(names, least.tolist(), strict=True))
    return _fixed(np.array([steady.get(d.joint, 1.0) for d in robot.drives]))


def _reach(joint: Joint) -> tuple[float, float]:
    widest = math.pi if joint.kind == "hinge" else 1.0
    return max(joint.lower, -widest), min(joint.upper, widest)


def _parents_first(robot: Robot) -> list[Joint]:
    """The present joints, each after the one that carries its parent."""
    waiting, placed, order = list(robot.present_joints), {robot.root.name}, []
    while waiting:
        ready = [j for j in waiting if j.parent in placed]
        if not ready:
            raise RobotError(f"joint {waiting[0].name!r} hangs on {waiting[0].parent!r}, which no joint carries")
        order += ready
        placed |= {j.child for j in ready}
        waiting = [j for j in waiting if j.child not in placed]
    return order


def _fixed(values: NDArray[np.float64]) -> NDArray[np.float64]:
    values.setflags(write=False)
    return values
