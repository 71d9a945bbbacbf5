"""Inertias that a file enters about the joint instead of the centre of mass, put right."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ee_dist.robots.fold import entries, tensor
from ee_dist.robots.model import Part, RobotError

PIVOT_HINT = "hint: the inertia of "
"""How a note begins that says where inertias look as if they were about the joint."""


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
