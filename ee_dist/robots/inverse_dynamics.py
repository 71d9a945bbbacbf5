"""Torques that a measured motion needs: inverse dynamics of a robot on a fixed base, for a whole series at once.

Newton-Euler in the frame of the world (Featherstone, Rigid Body Dynamics Algorithms, 2008, chapter 5), with arrays (T, ...)
over the rows of a record, in the form that is linear in the masses: what depends on the motion is computed once, and a
model with other masses then costs one product.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ee_dist.basics.quoted import quoted
from ee_dist.robots.bodies import Member, bodies_of
from ee_dist.robots.fold import entries, tensor
from ee_dist.robots.mass_matrix import rotation_matrix, symmetric
from ee_dist.robots.model import Joint, Part, Robot, RobotError

Array = NDArray[np.float64]


def gravity(robot: Robot) -> Array:
    """Gravity (3,), m/s^2, in the frame of the floor, which may be tilted about x and then about y."""
    g, a, b = robot.world.gravity_m_s2, robot.world.tilt_x_rad, robot.world.tilt_y_rad
    return np.array([g * math.sin(b) * math.cos(a), -g * math.sin(a), -g * math.cos(b) * math.cos(a)])


@dataclass(frozen=True, eq=False)
class Course:
    """Where the parts of a robot are and how they move, in the frame of the world: arrays (T, ...) by part, axes by joint.

    ``pull`` is the acceleration of a part's frame less gravity; ``arm`` leads from the parent's frame to the part's.
    """

    order: tuple[Joint, ...]
    turn: dict[str, Array]
    spin: dict[str, Array]
    spin_rate: dict[str, Array]
    pull: dict[str, Array]
    arm: dict[str, Array]
    axis: dict[str, Array]


def joint_torques(robot: Robot, position: Array, speed: Array, acceleration: Array) -> Array:
    """(T, M) torque (force for a slide) at each drive's joint for a motion (T, M) in the order of ``robot.drives``.

    Rotor inertia counts as mass on its own joint. Raises RobotError for a free base and for a moving joint without a drive.
    """
    return torques_of_parts(robot, position, speed, acceleration) + rotors(robot) * acceleration


def torques_of_parts(robot: Robot, position: Array, speed: Array, acceleration: Array) -> Array:
    """(T, M) the same without rotors, of one set of masses: from the tips to the root (Luh, Walker, Paul 1980), a tenth of the
    work of a ``regressor``. Raises RobotError as ``joint_torques`` does."""
    column = _columns(robot)
    course = course_of(robot, position, speed, acceleration)
    rows = len(position)
    out = np.zeros(acceleration.shape)
    names = {name for j in course.order for name in (j.parent, j.child)}
    forces, moments = ({name: np.zeros((rows, 3)) for name in names} for _ in range(2))
    masses = dict(zip((j.name for j in bodies_of(robot).moving), parameters(robot).reshape(-1, 10), strict=True))
    for joint in reversed(course.order):
        part, force, moment = joint.child, forces[joint.child], moments[joint.child]
        if joint.name in masses:
            own = masses[joint.name]
            turn, w, dw, pull = course.turn[part], course.spin[part], course.spin_rate[part], course.pull[part]
            centre, inertia = turn @ own[1:4], symmetric(own[4:])
            w_in, dw_in = (np.einsum("tji,tj->ti", turn, v) for v in (w, dw))
            force = force + own[0] * pull + _cross(dw, centre) + _cross(w, _cross(w, centre))
            about = dw_in @ inertia + _cross(w_in, w_in @ inertia)
            moment = moment + np.einsum("tij,tj->ti", turn, about) + _cross(centre, pull)
        k = column.get(joint.name)
        if k is not None:
            out[:, k] = np.einsum("ti,ti->t", course.axis[joint.name], force if joint.kind == "slide" else moment)
        forces[joint.parent] = forces[joint.parent] + force
        moments[joint.parent] = moments[joint.parent] + moment + _cross(course.arm[part], force)
    return out


def _cross(a: Array, b: Array) -> Array:
    """(T, 3) of (T, 3) and (T, 3) or (3,), or (T, 3, K) of (T, 3) and (T, 3, K): what ``numpy.cross`` gives, which takes five
    times as long."""
    (ax, ay, az), (bx, by, bz) = (np.moveaxis(v, min(1, v.ndim - 1), 0) for v in (a, b))
    if b.ndim > 2:
        ax, ay, az = ax[:, None], ay[:, None], az[:, None]
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=1)


def _columns(robot: Robot) -> dict[str, int]:
    """The number of each drive by its joint. Raises RobotError where torques of joints do not decide the motion."""
    if robot.free_base:
        raise RobotError(
            f"{robot.name}: its base moves freely: the torques of its joints alone do not decide its motion"
        )
    column = {d.joint: k for k, d in enumerate(robot.drives)}
    for j in robot.present_joints:
        if j.kind != "fixed" and j.name not in column:
            raise RobotError(f"{robot.name}: joint {quoted(j.name)} has no drive, so its motion was not measured")
    return column


def parameters(robot: Robot, of: Collection[str] | None = None) -> Array:
    """(10 B,) of the bodies that joints move, each with all that is fixed to it: mass, mass * centre (3), inertia about the frame
    of the part at the joint (xx, yy, zz, xy, xz, yz); ``of``: only of what one of these joints carries."""
    bodies, parts = bodies_of(robot), {p.name: p for p in robot.parts}
    found: list[Array] = []
    carried: set[str] = set()
    for joint in bodies.moving:
        if of is not None and joint.name not in of and bodies.carrier.get(joint.parent) not in carried:
            continue
        carried.add(joint.name)
        found.append(sum((_about_frame(parts[m.part], m) for m in bodies.members[joint.name]), np.zeros(10)))
    return np.concatenate([*found, np.zeros(0)])


def _about_frame(part: Part, at: Member) -> Array:
    """(10,) of a part, about the frame of the body that it belongs to."""
    m, (x, y, z), inertia = part.mass_kg, part.com_m, part.inertia_kg_m2
    if at.turn is not None:
        x, y, z = (float(v) for v in at.turn @ np.array(part.com_m) + at.place_m)
        inertia = entries(at.turn @ tensor(part) @ at.turn.T)
    shift = (y * y + z * z, x * x + z * z, x * x + y * y, -x * y, -x * z, -y * z)
    return np.array([m, m * x, m * y, m * z, *(i + m * s for i, s in zip(inertia, shift, strict=True))])


def rotors(robot: Robot) -> Array:
    """(M,) rotor inertia of each drive at its joint."""
    return np.array([d.rotor_inertia for d in robot.drives])


def geometry(robot: Robot) -> tuple[object, ...]:
    """What a ``regressor`` depends on beside motion and gravity: equal for robots that share one."""
    placed = tuple((j.name, j.kind, j.parent, j.child, j.position_m, j.rotation, j.axis) for j in robot.present_joints)
    return robot.root.name, robot.start_rotation, robot.motor_names, placed


def gravity_regressor(robot: Robot, position: Array) -> Array:
    """(3, T, M, 4 B): what gravity of 1 m/s^2 along x, y and z of the floor adds to the columns of a ``regressor`` that have
    weight, ``weights`` of its parameters; it is linear in it, and inertia about a part's frame weighs nothing."""
    still = np.zeros_like(position)
    down = robot.with_world(gravity_m_s2=1.0, tilt_x_rad=0.0, tilt_y_rad=0.0)
    # gravity() points along -z without a tilt, along x and along -y with a quarter of a turn about y and about x.
    along = (down.with_world(tilt_y_rad=math.pi / 2), down.with_world(tilt_x_rad=math.pi / 2), down)
    signs = (1.0, -1.0, -1.0)
    return np.stack([s * weights(regressor(r, position, still, still)) for s, r in zip(signs, along, strict=True)])


def weights(columns: Array) -> Array:
    """(..., 4 B) of (..., 10 B): each body's mass, and its mass times centre."""
    apart = columns.reshape(*columns.shape[:-1], -1, 10)[..., :4]
    return np.ascontiguousarray(apart).reshape(*columns.shape[:-1], -1)


def regressor(robot: Robot, position: Array, speed: Array, acceleration: Array) -> Array:
    """(T, M, 10 B): what each of the ``parameters`` adds to the torques, which are linear in them (Atkeson, An, Hollerbach
    1986). It depends on the robot's ``geometry`` and gravity only. Raises RobotError as ``joint_torques`` does."""
    column = _columns(robot)
    course = course_of(robot, position, speed, acceleration)
    carrier = {j.child: j for j in course.order}
    moving = bodies_of(robot).moving
    out = np.zeros((*acceleration.shape, 10 * len(moving)))
    for place, joint in enumerate(moving):
        force, moment = _unit_loads(course, joint.child)
        at: Joint | None = joint
        while at is not None:
            k = column.get(at.name)
            if k is not None:
                load = force if at.kind == "slide" else moment
                out[:, k, 10 * place : 10 * place + 10] = np.einsum("ti,tip->tp", course.axis[at.name], load)
            moment = moment + _cross(course.arm[at.child], force)
            at = carrier.get(at.parent)
    return out


def _unit_loads(course: Course, part: str) -> tuple[Array, Array]:
    """Force and moment about the part's frame, (T, 3, 10) each, for one unit of each parameter of the part."""
    turn, w, dw, pull = course.turn[part], course.spin[part], course.spin_rate[part], course.pull[part]
    rows = len(turn)
    force, moment = np.zeros((rows, 3, 10)), np.zeros((rows, 3, 10))
    force[:, :, 0] = pull
    # In the axes of the part, where centre and inertia are constant.
    inside = np.swapaxes(turn, 1, 2)
    w_in, dw_in, pull_in = (np.einsum("tij,tj->ti", inside, v) for v in (w, dw, pull))
    for i in range(3):
        unit = np.eye(3)[i]
        force[:, :, 1 + i] = np.einsum("tij,tj->ti", turn, _cross(dw_in, unit) + _cross(w_in, _cross(w_in, unit)))
        moment[:, :, 1 + i] = np.einsum("tij,tj->ti", turn, _cross(unit, pull_in))
    for i, (a, b) in enumerate(((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))):
        tensor = np.zeros((3, 3))
        tensor[a, b] = tensor[b, a] = 1.0
        moment[:, :, 4 + i] = np.einsum("tij,tj->ti", turn, dw_in @ tensor + _cross(w_in, w_in @ tensor))
    return force, moment


def course_of(robot: Robot, position: Array, speed: Array, acceleration: Array) -> Course:
    """The motion of all parts from that of the joints, root first (Luh, Walker, Paul 1980)."""
    column = {d.joint: k for k, d in enumerate(robot.drives)}
    rows, root = len(position), robot.root.name
    turn = {root: np.broadcast_to(rotation_matrix(robot.start_rotation), (rows, 3, 3))}
    spin, rate = {root: np.zeros((rows, 3))}, {root: np.zeros((rows, 3))}
    pull = {root: np.broadcast_to(-gravity(robot), (rows, 3))}
    arms: dict[str, Array] = {}
    axes: dict[str, Array] = {}
    order = bodies_of(robot).order
    for joint in order:
        up, part = turn[joint.parent], joint.child
        arm = np.einsum("tij,j->ti", up, np.array(joint.position_m))
        facing = up @ rotation_matrix(joint.rotation)
        axis = np.einsum("tij,j->ti", facing, np.array(joint.axis) / np.linalg.norm(joint.axis))
        w, dw = spin[joint.parent], rate[joint.parent]
        k = column.get(joint.name)
        q, v, a = (x[:, k, None] if k is not None else np.zeros((rows, 1)) for x in (position, speed, acceleration))
        if joint.kind == "slide":
            arm = arm + q * axis
        drag = pull[joint.parent] + _cross(dw, arm) + _cross(w, _cross(w, arm))
        spin[part], rate[part] = w, dw
        if joint.kind == "hinge":
            facing = _about(axis, q) @ facing
            rate[part] = dw + a * axis + _cross(w, v * axis)
            spin[part] = w + v * axis
        elif joint.kind == "slide":
            drag = drag + a * axis + 2 * _cross(w, v * axis)
        turn[part], pull[part], arms[part], axes[joint.name] = facing, drag, arm, axis
    return Course(order, turn, spin, rate, pull, arms, axes)


def _about(axis: Array, angle: Array) -> Array:
    """Rotation matrices (T, 3, 3) about unit axes (T, 3) by angles (T, 1)."""
    c, s = np.cos(angle)[:, :, None], np.sin(angle)[:, :, None]
    x, y, z = axis.T
    zero = np.zeros_like(x)
    across = np.stack([np.stack([zero, -z, y], 1), np.stack([z, zero, -x], 1), np.stack([-y, x, zero], 1)], 1)
    return c * np.eye(3) + s * across + (1 - c) * axis[:, :, None] * axis[:, None, :]
