"""How far a prediction can be trusted: an ensemble of models that differ from the base by less than anybody could know.

A robot in contact forgets its model within seconds: two models that differ by half a percent in every mass and gain are
soon as far apart as two different robots. What differs between them says nothing about what is missing, so that each
residual value is weighed by noise and by this spread together. Where motion is predictable the spread is nothing.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ee_dist.robots.model import Robot
from ee_dist.robots.ranges import span

SMALL = 0.005
"""Relative change of masses, drive gains and strengths in the ensemble; friction of the floor varies by four times that."""
OFFSET_SHARE = 0.0005
"""Change of each drive's zero, as a share of its joint's range; of one that turns on and on, of a turn."""
MEMBERS = 6


def ensemble(robot: Robot, members: int = MEMBERS, small: float = SMALL) -> list[Robot]:
    """Neighbours of a robot; the same ones every time."""
    return [_neighbour(robot, np.random.default_rng([4711, k]), small) for k in range(members)]


def _neighbour(robot: Robot, rng: np.random.Generator, small: float) -> Robot:
    def scale(width: float = small) -> float:
        return float(1.0 + width * rng.choice([-1.0, 1.0]) * rng.uniform(0.5, 1.0))

    parts = []
    for part in robot.parts:
        by = scale()
        xx, yy, zz, xy, xz, yz = (by * v for v in part.inertia_kg_m2)
        parts.append(replace(part, mass_kg=by * part.mass_kg, inertia_kg_m2=(xx, yy, zz, xy, xz, yz)))
    drives = []
    for drive in robot.drives:
        low, high = span(robot.joint(drive.joint))
        offset = drive.zero_offset + OFFSET_SHARE * (high - low) * float(rng.uniform(-1, 1))
        drives.append(replace(drive, kp=drive.kp * scale(), strength=drive.strength * scale(), zero_offset=offset))
    world = replace(robot.world, friction=robot.world.friction * scale(4 * small))
    return replace(robot, parts=tuple(parts), drives=tuple(drives), world=world)
