"""Inertias that a file enters about the joint instead of the centre of mass: where they look so, and put right."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ee_dist.basics.names import listed
from ee_dist.robots.fold import entries, tensor
from ee_dist.robots.model import Joint, Part, RobotError

PIVOT_HINT = "hint: the inertia of "
"""How a note begins that says where inertias look as if they were about the joint."""
PIVOT_SHARE, PIVOT_M = (1.0, 1.8), 0.05
"""An inertia that is 1 to 1.8 times mass x (distance of the centre from the joint)^2 looks like one about the joint: of a rod it
would be 4/3, of its own centre 1/3. Nearer than 5 cm nothing can be said."""


def hints_at_pivots(parts: Sequence[Part], joints: Sequence[Joint]) -> list[str]:
    """A note where an inertia looks as if it were about the joint: a hint, for nothing proves it."""
    kinds, found = {j.child: j.kind for j in joints}, []
    for part in parts:
        away = float(np.linalg.norm(part.com_m))
        if kinds.get(part.name) != "hinge" or away < PIVOT_M:
            continue
        xx, yy, zz = part.inertia_kg_m2[:3]
        about = (xx + yy + zz) / 2  # of a thin part, the moment across it
        low, high = (share * part.mass_kg * away**2 for share in PIVOT_SHARE)
        if low <= min(max(xx, yy, zz), about) <= high:
            found.append(part.name)
    if not found:
        return []
    return [
        f"{PIVOT_HINT}{listed(found)} looks as if it were about the joint; URDF means the centre of mass: "
        "if it is, add 'inertia_about: joint' to the robot's description"
    ]


def about_centre(part: Part, where: str) -> Part:
    """The part whose stated inertia was about its frame, the joint's. Raises RobotError where that cannot be.

    Who enters the moment about the joint's axis often enters it about every axis. No body is spread like that: a moment beyond
    the sum of the two others is taken down to it.
    """
    away = np.array(part.com_m)
    stated_kg_m2 = max(part.inertia_kg_m2[:3])
    moments, axes = np.linalg.eigh(tensor(part) - part.mass_kg * (away @ away * np.eye(3) - np.outer(away, away)))
    if moments[0] <= 0:
        raise RobotError(
            f"{where}: inertia_about: joint: {part.name!r} of {part.mass_kg:g} kg, {np.linalg.norm(away):.3g} m from its joint, "
            f"has more inertia about the joint than the {stated_kg_m2:.3g} kg.m^2 stated: they are about its centre"
        )
    moments[2] = min(moments[2], moments[0] + moments[1])
    return replace(part, inertia_kg_m2=entries(axes @ np.diag(moments) @ axes.T))
