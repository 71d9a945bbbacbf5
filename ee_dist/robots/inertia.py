"""How heavy each joint feels: lower bounds that keep discrete friction from reversing the motion it stops."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ee_dist.robots.mass_matrix import KEPT, Places, both_ways, mass_matrix, moving, placed
from ee_dist.robots.model import Joint, Robot

Array = NDArray[np.float64]

POSES = 4
"""Poses beside position zero at which ``steady_inertia`` looks."""


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
    felt = {j.name: 1.0 / float(inverse[free + i, free + i]) for i, j in enumerate(moving(robot.present_joints))}
    return _fixed(np.array([felt.get(d.joint, 1.0) for d in robot.drives]))


@lru_cache(maxsize=2048)
def _steady(body: _Body) -> Array:
    robot = body.robot
    joints, driven = moving(robot.present_joints), {d.joint for d in robot.drives}
    free = 6 if robot.free_base else 0
    rows = [free + i for i, j in enumerate(joints) if j.name in driven]
    places = _looked_at(robot.present_joints, robot.root.name, robot.free_base)
    inverse = np.linalg.inv(both_ways(robot, places))[..., rows, :][..., rows]
    least = (1.0 / np.abs(inverse).sum(axis=-1)).min(axis=(0, 1))
    steady = dict(zip((joints[r - free].name for r in rows), least.tolist(), strict=True))
    return _fixed(np.array([steady.get(d.joint, 1.0) for d in robot.drives]))


@lru_cache(maxsize=KEPT)
def _looked_at(present: tuple[Joint, ...], root: str, free_base: bool) -> Places:
    joints = moving(present)
    # The inertia of a single joint on a bolted base does not depend on where it stands.
    poses = 1 + POSES * (6 * free_base + len(joints) > 1)
    rng = np.random.default_rng(0)
    positions = np.zeros((poses, len(joints)))
    for k, joint in enumerate(joints):
        positions[1:, k] = rng.uniform(*_reach(joint), poses - 1)
    return placed(present, root, free_base, positions)


def _fixed(values: Array) -> Array:
    values.setflags(write=False)
    return values


def _reach(joint: Joint) -> tuple[float, float]:
    """The part of a joint's range around zero in which poses are looked at; of a range beyond a turn the end that is nearest."""
    widest = math.pi if joint.kind == "hinge" else 1.0
    if joint.lower > widest:
        return joint.lower, min(joint.upper, joint.lower + widest)
    if joint.upper < -widest:
        return max(joint.lower, joint.upper - widest), joint.upper
    return max(joint.lower, -widest), min(joint.upper, widest)
