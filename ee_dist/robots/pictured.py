"""What is drawn of a part: its collision shapes, and stand-ins where it has none.

Stand-ins are thin rods from a part's frame to what it carries, a ball of its mass at its centre of mass, a cube where
that is the frame itself, and a rail along a slide.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ee_dist.robots.kinematics import Array, quat_rotate
from ee_dist.robots.model import NO_TURN, ZERO3, Part, Quat, Robot, Shape, Vec3

ROD_M, SHORTEST_ROD = 0.009, 3.0
"""Radius of a rod, and how many radii it must bridge to be worth drawing."""
DENSITY_KG_M3 = 4000.0
"""Of a ball or cube that stands for a mass: between aluminium and steel."""
BASE_HALF_M = 0.015
"""Of the block that stands for a fixed root part without a shape."""


@dataclass(frozen=True)
class Solid:
    """One solid in the frame of its part. ``senses``: it is a shape of a part that carries a touch sensor."""

    name: str
    shape: Shape
    senses: bool = False


def solids_of(robot: Robot, part: Part) -> tuple[Solid, ...]:
    """The solids to draw for a part of a robot."""
    touched = {s.target for s in robot.sensors if s.kind == "touch"}
    solids = [Solid(f"{s.kind}_{k}", s, part.name in touched) for k, s in enumerate(part.shapes)]
    if not part.shapes:
        solids.append(Solid("mass", _mass(robot, part)))
    carried = [j for j in robot.joints if j.parent == part.name]
    thin = min([ROD_M, *(0.6 * s.size[0] for s in part.shapes if s.kind != "box")])
    rods = [_rod(ZERO3, end, thin) for end in [*(s.shape.position_m for s in solids), *(j.position_m for j in carried)]]
    for joint in carried:
        if joint.kind == "slide":
            along = quat_rotate(np.array(joint.rotation), np.array(joint.axis))
            ends = [_vector(np.array(joint.position_m) + limit * along) for limit in joint.stops]
            rods.append(_rod(ends[0], ends[1], thin))
    # A shape around the joint, or a long one that reaches it, needs no rod.
    needed = [r for r in rods if r.size[1] > SHORTEST_ROD * thin and not any(_covers(s, r) for s in part.shapes)]
    return (*solids, *(Solid(f"rod_{k}", rod) for k, rod in enumerate(needed)))


def reach(robot: Robot, part: Part) -> float:
    """How far the solids of a part stretch from its frame, m."""
    shapes = [s.shape for s in solids_of(robot, part)]
    return max(float(np.linalg.norm(s.position_m)) + max(s.size) / (2 if s.kind == "capsule" else 1) for s in shapes)


def _mass(robot: Robot, part: Part) -> Shape:
    if part is robot.root and not robot.free_base:
        return Shape("box", (BASE_HALF_M,) * 3)
    radius = (3 * part.mass_kg / (4 * np.pi * DENSITY_KG_M3)) ** (1 / 3)
    if any(part.com_m):
        return Shape("sphere", (float(radius),), part.com_m)
    return Shape("box", (0.8 * float(radius),) * 3)


def _covers(shape: Shape, rod: Shape) -> bool:
    """Whether a rod lies inside a shape."""
    x, y, z, w = shape.rotation
    half = turned(rod.rotation, (0.0, 0.0, 0.4 * rod.size[1]))
    for share in (-1.0, 0.0, 1.0):
        place = np.array(rod.position_m) + share * half - np.array(shape.position_m)
        a, b, c = np.abs(turned((-x, -y, -z, w), _vector(place)))
        if shape.kind == "box":
            inside = a <= shape.size[0] and b <= shape.size[1] and c <= shape.size[2]
        elif shape.kind == "sphere":
            inside = np.sqrt(a * a + b * b + c * c) <= shape.size[0]
        else:
            cap = shape.size[0] if shape.kind == "capsule" else 0.0
            inside = np.hypot(a, b) <= shape.size[0] and c <= shape.size[1] / 2 + cap
        if not inside:
            return False
    return True


def _rod(start: Vec3, end: Vec3, radius: float) -> Shape:
    """A capsule from one point to another."""
    way = np.array(end) - np.array(start)
    length = float(np.linalg.norm(way))
    middle = _vector((np.array(start) + np.array(end)) / 2)
    if length == 0.0:
        return Shape("capsule", (radius, 0.0), middle)
    x, y, z = way / length
    # The shortest turn that takes z onto the direction; straight down, half a turn about x.
    turn = np.array((-y, x, 0.0, 1.0 + z)) if z > -1.0 + 1e-12 else np.array((1.0, 0.0, 0.0, 0.0))
    turn /= np.linalg.norm(turn)
    unit: Quat = (float(turn[0]), float(turn[1]), float(turn[2]), float(turn[3])) if length else NO_TURN
    return Shape("capsule", (radius, length), middle, unit)


def turned(turn: Quat, v: Vec3) -> Array:
    return quat_rotate(np.array(turn), np.array(v))


def _vector(v: Array) -> Vec3:
    return (float(v[0]), float(v[1]), float(v[2]))
