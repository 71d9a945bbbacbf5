"""The generalised mass matrix of a robot, from what it depends on: where joints and parts are, what parts weigh, and rotors.

Of a hundred hypotheses about one robot nearly all have the same joints, and most the same masses. So places are worked out
once for each set of joints, and what a part adds once for each of its masses; each matrix is then their sum, in the same order.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ee_dist.basics.quoted import quoted
from ee_dist.robots.model import Joint, Part, Robot, RobotError, Vec3

Array = NDArray[np.float64]
KEPT, PARTS = 256, 8192
"""Sets of joints, and parts, that are remembered."""


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


def symmetric(entries: Sequence[float] | Array) -> Array:
    """(3, 3) of (xx, yy, zz, xy, xz, yz)."""
    xx, yy, zz, xy, xz, yz = entries
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


@dataclass(frozen=True, eq=False)
class Places:
    """Where the joints and parts of robots with the same joints are, at positions (P, joints that move).

    Of the n coordinates the first are six of the root, if it is free. ``axes`` and ``pivots`` (P, n, 3) are theirs, ``slides``
    (n,) whether they shift; ``part``: by part where it is (P, 3) and how it is turned (P, 3, 3); ``ways``: by part the
    coordinates that move it; ``carried_by``: by part the coordinate of the joint that carries it, if that moves.
    """

    axes: Array
    pivots: Array
    slides: NDArray[np.bool_]
    part: Mapping[str, tuple[Array, Array]]
    ways: Mapping[str, NDArray[np.intp]]
    carried_by: Mapping[str, int]

    @property
    def size(self) -> tuple[int, int]:
        """P and n."""
        return self.axes.shape[0], self.axes.shape[1]


def moving(joints: Sequence[Joint]) -> list[Joint]:
    """Those that can move."""
    return [j for j in joints if j.kind != "fixed"]


def placed(present: Sequence[Joint], root: str, free_base: bool, positions: Array) -> Places:
    """Where joints and parts are at ``positions`` (P, joints that move). ``root``: the part that carries the first."""
    joints, count = moving(present), len(positions)
    free = 6 if free_base else 0
    n = free + len(joints)
    column = {j.name: free + i for i, j in enumerate(joints)}
    axes, pivots = np.zeros((count, n, 3)), np.zeros((count, n, 3))
    place = {root: (np.zeros((count, 3)), np.broadcast_to(np.eye(3), (count, 3, 3)))}
    path: dict[str, list[int]] = {root: list(range(free))}
    slides = np.zeros(n, dtype=bool)
    slides[: free // 2] = True
    axes[:, :free] = np.eye(3)[np.arange(free) % 3]
    for joint in parents_first(present, root):
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
    ways = {name: np.array(own, dtype=np.intp) for name, own in path.items()}
    return Places(axes, pivots, slides, place, ways, {j.child: column[j.name] for j in joints})


@lru_cache(maxsize=KEPT)
def _placed_at_zero(present: tuple[Joint, ...], root: str, free_base: bool) -> Places:
    return placed(present, root, free_base, np.zeros((1, len(moving(present)))))


def mass_matrix(robot: Robot) -> Array:
    """Generalised mass matrix at joint position zero, (n, n): six rows of the root if it is free, then the joints that move.

    Sums J^T I J over the parts (Featherstone, Rigid Body Dynamics Algorithms, 2008, section 6), rotor inertia added.
    """
    places = _placed_at_zero(robot.present_joints, robot.root.name, robot.free_base)
    return np.asarray((_of_parts(robot, places) + np.diag(_rotors(robot, places)))[0])


def both_ways(robot: Robot, places: Places) -> Array:
    """Mass matrices (2, P, n, n) where the joints are, for both ways in which engines count rotors.

    The first counts a rotor's inertia on its joint, as it is. The second counts it on the part that the joint moves,
    where an engine that knows no rotors puts it.
    """
    of_parts, on_joint = _of_parts(robot, places), _rotors(robot, places)
    extra = np.zeros_like(of_parts)
    for part in robot.present_parts:
        c = places.carried_by.get(part.name)
        if c is not None and on_joint[c]:
            share = _share(places, part)
            extra[_block(places, part.name)] += on_joint[c] * share @ share.swapaxes(1, 2)
    return np.stack([of_parts + np.diag(on_joint), of_parts + extra])


def _of_parts(robot: Robot, places: Places) -> Array:
    count, n = places.size
    total = np.zeros((count, n, n))
    for part in robot.present_parts:
        total[_block(places, part.name)] += _of_part(places, part.name, part.mass_kg, part.com_m, part.inertia_kg_m2)
    return total


def _rotors(robot: Robot, places: Places) -> Array:
    """(n,) rotor inertia on each coordinate."""
    rotor, joints = {d.joint: d.rotor_inertia for d in robot.drives}, moving(robot.present_joints)
    on_joint = np.zeros(places.size[1])
    on_joint[len(on_joint) - len(joints) :] = [rotor.get(j.name, 0.0) for j in joints]
    return on_joint


@lru_cache(maxsize=PARTS)
def _of_part(places: Places, name: str, mass_kg: float, com_m: Vec3, inertia_kg_m2: tuple[float, ...]) -> Array:
    """(P, w, w) what a part adds, for the coordinates that move it."""
    _, facing = places.part[name]
    inertia = facing @ symmetric(inertia_kg_m2) @ facing.swapaxes(1, 2)
    linear, angular = _jacobians(places, name, com_m)
    added: Array = mass_kg * linear @ linear.swapaxes(1, 2) + angular @ inertia @ angular.swapaxes(1, 2)
    return added


def _share(places: Places, part: Part) -> Array:
    """(P, w, ...) how the coordinates that move a part take the joint that carries it along."""
    linear, angular = _jacobians(places, part.name, part.com_m)
    c = places.carried_by[part.name]
    return np.asarray(linear if places.slides[c] else angular @ places.axes[:, c, :, None])


@lru_cache(maxsize=PARTS)
def _jacobians(places: Places, name: str, com_m: Vec3) -> tuple[Array, Array]:
    """(P, w, 3) speed of a part's centre of mass, and its spin, by each of the coordinates that move it."""
    (here, facing), ways = places.part[name], places.ways[name]
    com = here + facing @ np.array(com_m)
    axis, along = places.axes[:, ways], places.slides[ways][:, None]
    linear = np.where(along, axis, _cross(axis, com[:, None] - places.pivots[:, ways]))
    return linear, np.where(along, 0.0, axis)


@lru_cache(maxsize=PARTS)
def _block(places: Places, name: str) -> tuple[NDArray[np.intp], ...]:
    """Where a part is in matrices (P, n, n)."""
    ways = places.ways[name]
    return np.ix_(np.arange(places.size[0]), ways, ways)


def parents_first(joints: Sequence[Joint], root: str, of: str = "") -> list[Joint]:
    """Joints, each after the one that carries its parent. Raises RobotError, which begins with ``of``, where none does."""
    waiting, there, order = list(joints), {root}, []
    while waiting:
        ready = [j for j in waiting if j.parent in there]
        if not ready:
            raise RobotError(
                f"{of}joint {quoted(waiting[0].name)} hangs on {quoted(waiting[0].parent)}, which no joint carries"
            )
        order += ready
        there |= {j.child for j in ready}
        waiting = [j for j in waiting if j.child not in there]
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
