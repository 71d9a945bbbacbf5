"""Which torque limits of a file are none: tools write 0 or a large round number where nobody knew."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np

from ee_dist.basics.names import listed
from ee_dist.robots.body import Body
from ee_dist.robots.described import GRAVITY_M_S2
from ee_dist.robots.model import Joint, Part

TORQUE_PER_INERTIA = 50.0
"""rad/s^2 (m/s^2) that an assumed torque limit gives a joint beside what it holds,"""
LEVER_M = 0.25
"""which is the weight of all that moves on this lever; of a slide, half the weight."""
PLACEHOLDER = 50.0
"""Times what a robot needs from which a limit is none. Servos that CAD programs enter too strong have ten times as much."""


ALIKE, AT_ALL = 4, 12.0
"""Joints that all have one number, and times what the most loaded of them needs from which it is none: motors that hold an arm
are not those that turn its hand."""


@dataclass(frozen=True)
class Placeholder:
    """A stated ``limit`` of a joint that is none; ``needed``: to hold the whole robot stretched out and to speed the joint up."""

    joint: Joint
    limit: float
    needed: float


def guessed_limit(joint: Joint, body: Body, inertia: float) -> float:
    """A torque limit, N.m (N), for a joint that feels this ``inertia``, where nothing is known of its motor."""
    return TORQUE_PER_INERTIA * inertia + _weight(body) * (0.5 if joint.kind == "slide" else LEVER_M)


def placeholders(body: Body, inertia: Mapping[str, float]) -> dict[str, Placeholder]:
    """By joint, of those whose drive the file leaves open. ``inertia`` is what each joint feels."""
    stretched = max(_stretched(body), LEVER_M * _weight(body))
    stated = []
    for joint in body.moving:
        limit = body.drives.get(joint.name, {}).get("torque_limit")
        if joint.name in body.driven or limit is None:
            continue
        hold = _weight(body) if joint.kind == "slide" else stretched
        stated.append(Placeholder(joint, float(limit), hold + TORQUE_PER_INERTIA * inertia[joint.name]))
    hinges = [p for p in stated if p.joint.kind == "hinge"]
    most = max((p.needed for p in hinges), default=0.0)
    one = len(hinges) >= ALIKE and len({p.limit for p in hinges}) == 1 and hinges[0].limit > AT_ALL * most
    return {p.joint.name: p for p in stated if p.limit > PLACEHOLDER * p.needed or (one and p.joint.kind == "hinge")}


def told(found: Mapping[str, Placeholder], body: Body, swinging: Collection[str] = ()) -> list[str]:
    """A line for each limit that is none, of all joints that have it, and one on those that are taken to be ``swinging``."""
    lines = []
    for limit, kind in dict.fromkeys((p.limit, p.joint.kind) for p in found.values()):
        alike = [p for p in found.values() if (p.limit, p.joint.kind) == (limit, kind)]
        most, unit = max(p.needed for p in alike), "N" if kind == "slide" else "N.m"
        names = listed(p.joint.name for p in alike)
        why = f"to hold all of the robot, stretched out, and to speed it up takes {most:.2g} {unit}"
        cure = "if it is one (a screw, a high gear), state torque_limit and rotor_inertia among the drives"
        lines.append(
            f"effort {limit:g} of {names} is taken for no real limit: {why}; drives are guessed from what it needs; {cure}"
        )
    if swinging:
        lines.append(
            f"{listed(swinging)}: taken to swing freely, as {'they turn' if len(swinging) > 1 else 'it turns'} without end "
            "and no effort is stated, where other joints state one; what a motor drives needs 'command: position' (speed, torque)"
        )
    unlimited = [name for name in body.unlimited if name not in swinging]
    if unlimited:
        lines.append(f"effort 0 of {listed(unlimited)} is no real limit: drives are guessed from what the robot needs")
    return lines


def _weight(body: Body) -> float:
    """N of all that moves: a base that is bolted down rests on its bolts, and one without mass was given some."""
    return sum(p.mass_kg for p in body.parts if body.free_base or _chain(body, p)) * GRAVITY_M_S2


def _chain(body: Body, part: Part) -> list[Joint]:
    """The joints from a part towards the base, up to the last that moves; none of a part that stands where the base stands."""
    above = {j.child: j for j in body.joints}
    joint, chain = above.get(part.name), []
    while joint is not None:
        chain.append(joint)
        joint = above.get(joint.parent)
    while chain and chain[-1].kind == "fixed":
        chain.pop()
    return chain


def _stretched(body: Body) -> float:
    """N.m about the first joints with all that they carry in one line: no torque that only holds is more."""
    torque = 0.0
    for part in body.parts:
        if chain := _chain(body, part):
            reach = float(np.linalg.norm(part.com_m)) + sum(float(np.linalg.norm(j.position_m)) for j in chain[:-1])
            torque += part.mass_kg * reach * GRAVITY_M_S2
    return torque
