"""Torques that a measured motion needs: inverse dynamics of a robot on a fixed base, for a whole series at once.

Recursive Newton-Euler (Luh, Walker, Paul 1980; Featherstone, Rigid Body Dynamics Algorithms, 2008, chapter 5), in the
frame of the world, with arrays (T, ...) over the rows of a record.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ee_dist.robots.inertia import rotation_matrix
from ee_dist.robots.model import Joint, Robot, RobotError

Array = NDArray[np.float64]


def gravity(robot: Robot) -> Array:
    """Gravity (3,), m/s^2, in the frame of the floor, which may be tilted about x and then about y."""
    g, a, b = robot.world.gravity_m_s2, robot.world.tilt_x_rad, robot.world.tilt_y_rad
    return np.array([g * math.sin(b) * math.cos(a), -g * math.sin(a), -g * math.cos(b) * math.cos(a)])


def joint_torques(robot: Robot, position: Array, speed: Array, acceleration: Array) -> Array:
    """(T, M) torque (force for a slide) at each drive's joint for a motion (T, M) in the order of ``robot.drives``.

    Rotor inertia counts as mass on its own joint. Raises RobotError for a free base and for a moving joint without a drive.
    """
    if robot.free_base:
        raise RobotError(f"{robot.name}: its base moves freely: the torques of its joints alone do not decide its motion")
    column = {d.joint: k for k, d in enumerate(robot.drives)}
    for j in robot.present_joints:
        if j.kind != "fixed" and j.name not in column:
            raise RobotError(f"{robot.name}: joint {j.name!r} has no drive, so its motion was not measured")
    rows = len(position)
    turns = {robot.root.name: np.broadcast_to(rotation_matrix(robot.start_rotation), (rows, 3, 3))}
    origins = {robot.root.name: np.zeros((rows, 3))}
    spins = {robot.root.name: np.zeros((rows, 3))}
    spins_rate = {robot.root.name: np.zeros((rows, 3))}
    pulls = {robot.root.name: np.broadcast_to(-gravity(robot), (rows, 3))}
    axes: dict[str, Array] = {}
    order = _parents_first(robot)
    for joint in order:
        up, away = turns[joint.parent], joint.parent
        arm = np.einsum("tij,j->ti", up, np.array(joint.position_m))
        turn = up @ rotation_matrix(joint.rotation)
        axis = np.einsum("tij,j->ti", turn, np.array(joint.axis) / np.linalg.norm(joint.axis))
        w, dw = spins[away], spins_rate[away]
        k = column.get(joint.name)
        q, v, a = (x[:, k, None] if k is not None else np.zeros((rows, 1)) for x in (position, speed, acceleration))
        if joint.kind == "slide":
            arm = arm + q * axis
        pull = pulls[away] + np.cross(dw, arm) + np.cross(w, np.cross(w, arm))
        if joint.kind == "hinge":
            turn = _about(axis, q) @ turn
            spins_rate[joint.child] = dw + a * axis + np.cross(w, v * axis)
            spins[joint.child] = w + v * axis
        else:
            if joint.kind == "slide":
                pull = pull + a * axis + 2 * np.cross(w, v * axis)
            spins[joint.child], spins_rate[joint.child] = w, dw
        origins[joint.child], turns[joint.child], pulls[joint.child] = origins[away] + arm, turn, pull
        axes[joint.name] = axis
    return _gather(robot, order, origins, turns, spins, spins_rate, pulls, axes, column, acceleration)


def _gather(robot, order, origins, turns, spins, rates, pulls, axes, column, acceleration):  # type: ignore[no-untyped-def]
    """Forces and moments from the tips to the root; what falls on each joint's axis."""
    force: dict[str, Array] = {}
    moment: dict[str, Array] = {}
    for part in robot.present_parts:
        turn, w, dw = turns[part.name], spins[part.name], rates[part.name]
        com = np.einsum("tij,j->ti", turn, np.array(part.com_m))
        xx, yy, zz, xy, xz, yz = part.inertia_kg_m2
        inertia = turn @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ np.swapaxes(turn, 1, 2)
        f = part.mass_kg * (pulls[part.name] + np.cross(dw, com) + np.cross(w, np.cross(w, com)))
        spin = np.einsum("tij,tj->ti", inertia, w)
        force[part.name] = f
        moment[part.name] = np.einsum("tij,tj->ti", inertia, dw) + np.cross(w, spin) + np.cross(com, f)
    out = np.zeros_like(acceleration)
    for joint in reversed(order):
        f, n = force[joint.child], moment[joint.child]
        k = column.get(joint.name)
        if k is not None:
            out[:, k] = np.einsum("ti,ti->t", axes[joint.name], f if joint.kind == "slide" else n)
            out[:, k] += robot.drives[k].rotor_inertia * acceleration[:, k]
        arm = origins[joint.child] - origins[joint.parent]
        force[joint.parent] = force[joint.parent] + f
        moment[joint.parent] = moment[joint.parent] + n + np.cross(arm, f)
    return out


def _about(axis: Array, angle: Array) -> Array:
    """Rotation matrices (T, 3, 3) about unit axes (T, 3) by angles (T, 1)."""
    c, s = np.cos(angle)[:, :, None], np.sin(angle)[:, :, None]
    x, y, z = axis.T
    zero = np.zeros_like(x)
    across = np.stack([np.stack([zero, -z, y], 1), np.stack([z, zero, -x], 1), np.stack([-y, x, zero], 1)], 1)
    return c * np.eye(3) + s * across + (1 - c) * axis[:, :, None] * axis[:, None, :]


def _parents_first(robot: Robot) -> list[Joint]:
    placed, order, waiting = {robot.root.name}, [], list(robot.present_joints)
    while waiting:
        ready = [j for j in waiting if j.parent in placed]
        if not ready:
            raise RobotError(f"{robot.name}: joint {waiting[0].name!r} hangs on {waiting[0].parent!r}, which no joint carries")
        order += ready
        placed |= {j.child for j in ready}
        waiting = [j for j in waiting if j.child not in placed]
    return order
