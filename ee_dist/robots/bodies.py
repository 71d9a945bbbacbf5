"""What the joints of a robot move as one: parts that are fixed to one another."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ee_dist.robots.mass_matrix import parents_first, rotation_matrix
from ee_dist.robots.model import Joint, Robot

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Member:
    """A part of a body, turned and placed in its frame; the part at the joint where ``turn`` is None."""

    part: str
    turn: Array | None
    place_m: Array


@dataclass(frozen=True, eq=False)
class Bodies:
    """What the joints of a robot move, parents first: joints that ``moving``, and those in ``order`` on the way to them;
    ``members`` of a body by its joint; ``carrier``: by part the joint whose body it belongs to, if it is not the base."""

    order: tuple[Joint, ...]
    moving: tuple[Joint, ...]
    members: Mapping[str, Sequence[Member]]
    carrier: Mapping[str, str]


def bodies_of(robot: Robot) -> Bodies:
    """The bodies of its present parts. Raises RobotError for joints that form a loop, and parts that none carries."""
    return _of(robot.root.name, robot.present_joints, f"{robot.name}: ")


@lru_cache(256)
def _of(root: str, joints: tuple[Joint, ...], where: str) -> Bodies:
    order = parents_first(joints, root, where)
    carrier: dict[str, str] = {}
    members: dict[str, list[Member]] = {}
    at: dict[str, tuple[Array | None, Array]] = {}
    for joint in order:
        if joint.kind != "fixed":
            carrier[joint.child] = joint.name
            at[joint.child] = None, np.zeros(3)
        elif joint.parent in carrier:
            carrier[joint.child] = carrier[joint.parent]
            turn, place = at[joint.parent]
            turn = np.eye(3) if turn is None else turn
            at[joint.child] = turn @ rotation_matrix(joint.rotation), place + turn @ np.array(joint.position_m)
        else:
            continue
        members.setdefault(carrier[joint.child], []).append(Member(joint.child, *at[joint.child]))
    on_the_way: set[str] = set()
    for joint in reversed(order):
        if joint.kind != "fixed" or joint.child in on_the_way:
            on_the_way.add(joint.parent)
    moving = tuple(j for j in order if j.kind != "fixed")
    chain = tuple(j for j in order if j.kind != "fixed" or j.child in on_the_way)
    return Bodies(chain, moving, members, carrier)


def heaviest(robot: Robot) -> frozenset[str]:
    """The heaviest part of each body, that of the base among them where it is free: what is fixed together is heavier or lighter
    as one, and of what is bolted down nothing shows."""
    bodies = bodies_of(robot)
    of: dict[str, list[str]] = {} if not robot.free_base else {"": [robot.root.name]}
    for p in robot.present_parts:
        joint = bodies.carrier.get(p.name, "" if robot.free_base else None)
        if joint is not None:
            of.setdefault(joint, []).append(p.name)
    mass = {p.name: p.mass_kg for p in robot.parts}
    return frozenset(max(names, key=lambda n: mass[n]) for names in of.values())
