"""Links that hold nothing: frames of tools and sensors, helper links between joints, an implicit world.

Files as tools write them are full of links without a mass. What is rigidly attached and has none is merged into what
carries it; what carries something rigidly attached takes over its mass; a root without a mass that only holds another link
gives way to it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ee_dist.robots.kinematics import compose
from ee_dist.robots.mass_matrix import rotation_matrix, symmetric
from ee_dist.robots.model import NO_TURN, ZERO3, Joint, Part, Quat, Shape, Vec3

DUMMY_KG = 1e-6
"""A mass that tools give a frame that should have none; more than that is a part."""
ROOT_KG, ROOT_KG_M2 = 1.0, 1e-3
"""A bolted root needs no mass of its own; engines want a number."""
HELPER_KG, HELPER_KG_M2 = 1e-3, 1e-6
"""Of a link between two joints that was given none: 1 g, a ball of 2.5 cm across."""

Pose = NDArray[np.float64]


def folded(
    parts: dict[str, Part], carried: dict[str, Joint], root: str
) -> tuple[list[Part], list[Joint], tuple[Vec3, Quat], list[str], list[str]]:
    """Parts and joints that are left, root first; the root's own place; names that were given a mass (the root too); those
    that have none and carry nothing.

    ``carried`` are the joints by the part that each carries, parents first.
    """
    parts, joints = dict(parts), dict(carried)
    start = (ZERO3, NO_TURN)
    while True:
        below = [j for j in joints.values() if j.parent == root]
        bare = parts[root].mass_kg <= DUMMY_KG and not parts[root].shapes
        if not bare or len(below) != 1 or below[0].kind != "fixed":
            break
        start = posed(start, (below[0].position_m, below[0].rotation))
        del joints[below[0].child], parts[root]
        root = below[0].child
    for name in list(joints)[::-1]:
        joint, part = joints[name], parts[name]
        if joint.kind != "fixed" or (part.mass_kg > DUMMY_KG and parts[joint.parent].mass_kg > DUMMY_KG):
            continue
        at = _pose(joint.position_m, joint.rotation)
        parts[joint.parent] = _joined(parts[joint.parent], part, at)
        for child, other in joints.items():
            if other.parent == name:
                position, rotation = posed((joint.position_m, joint.rotation), (other.position_m, other.rotation))
                joints[child] = replace(other, parent=joint.parent, position_m=position, rotation=rotation)
        del joints[name], parts[name]
    given, idle = [], []
    for name in parts:
        if parts[name].mass_kg > DUMMY_KG:
            continue
        if name == root:
            parts[name] = _given(parts[name], ROOT_KG, ROOT_KG_M2)
            given.append(name)
        elif any(j.parent == name for j in joints.values()):
            parts[name] = _given(parts[name], HELPER_KG, HELPER_KG_M2)
            given.append(name)
        else:
            idle.append(name)
    order = [root, *(n for n in parts if n != root)]
    return [parts[n] for n in order], [joints[n] for n in order[1:]], start, given, idle


def _given(part: Part, mass: float, inertia: float) -> Part:
    return replace(part, mass_kg=mass, com_m=ZERO3, inertia_kg_m2=(inertia, inertia, inertia, 0.0, 0.0, 0.0))


def _joined(carrier: Part, part: Part, at: Pose) -> Part:
    """The carrier with a part that is rigidly attached to it at a pose in its frame."""
    shapes = (*carrier.shapes, *(moved_shape(at, s) for s in part.shapes))
    grip = max((p.grip for p in (carrier, part) if p.shapes), default=carrier.grip)
    if part.mass_kg <= DUMMY_KG:
        return replace(carrier, shapes=shapes, grip=grip)
    turn = rotation_matrix((at[3], at[4], at[5], at[6]))
    own = turn @ tensor(part) @ turn.T
    com = at[:3] + turn @ np.array(part.com_m)
    return replace(
        carrier,
        mass_kg=part.mass_kg,
        com_m=(float(com[0]), float(com[1]), float(com[2])),
        inertia_kg_m2=entries(own),
        shapes=shapes,
        grip=grip,
    )


def tensor(part: Part) -> NDArray[np.float64]:
    """(3, 3) inertia about the centre of mass, in the axes of the part."""
    return symmetric(part.inertia_kg_m2)


def entries(matrix: NDArray[np.float64]) -> tuple[float, float, float, float, float, float]:
    """(xx, yy, zz, xy, xz, yz) of a symmetric matrix."""
    xx, yy, zz, xy, xz, yz = (float(matrix[i, j]) for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)))
    return xx, yy, zz, xy, xz, yz


def moved_shape(at: Pose, shape: Shape) -> Shape:
    position, rotation = _split(compose(at, _pose(shape.position_m, shape.rotation)))
    return replace(shape, position_m=position, rotation=rotation)


def posed(frame: tuple[Vec3, Quat], within: tuple[Vec3, Quat]) -> tuple[Vec3, Quat]:
    """A place that is given within a frame, seen from where the frame's own place is."""
    return _split(compose(_pose(*frame), _pose(*within)))


def _pose(position: Vec3, rotation: Quat) -> Pose:
    return np.array([*position, *rotation])


def _split(pose: Pose) -> tuple[Vec3, Quat]:
    x, y, z, a, b, c, d = (float(v) for v in pose)
    return (x, y, z), (a, b, c, d)
