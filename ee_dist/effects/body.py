"""Effects on the body: what it is made of and what is still there."""

from __future__ import annotations

import math
from collections.abc import Mapping

from ee_dist.effects.catalogue import Parameter, effect
from ee_dist.effects.scales import Range, always
from ee_dist.effects.targets import carried_parts, parts
from ee_dist.robots.model import Robot

PAPER = "Bongard and Lipson 2004"


@effect(
    "part_lost",
    family="body",
    targets=carried_parts,
    physics="A part breaks off at its joint and takes with it all that it carried; its motors turn nothing.",
    signature="Its touch sensor stays open and its joint stays at zero; the body leans towards the gap from the first step.",
    reference=PAPER,
)
def part_lost(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    return robot.without(target)


@effect(
    "part_mass",
    family="body",
    targets=parts,
    parameters=(Parameter("change", "1", -0.9, 3.0, 0.0, "change of mass as a share of the nominal mass", 0.02),),
    ranges=always(change=(-0.5, 3.0)),
    physics="A part is heavier or lighter than the model says; its inertia scales with its mass.",
    signature="Torques and sag grow with the acceleration and the tilt of the part; nothing changes at rest if it is carried "
    "by the structure.",
    reference=PAPER,
)
def part_mass(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    part = robot.part(target)
    scale = 1.0 + values["change"]
    xx, yy, zz, xy, xz, yz = (scale * v for v in part.inertia_kg_m2)
    return robot.with_part(target, mass_kg=scale * part.mass_kg, inertia_kg_m2=(xx, yy, zz, xy, xz, yz))


def _shifts(robot: Robot, target: str) -> dict[str, Range]:
    """Up to four fifths of the way to the end of the part, and no more than 0.1 m."""
    part = robot.part(target)
    reach = 0.0
    for shape in part.shapes:
        middle = math.dist(shape.position_m, part.com_m)
        half = max(shape.size) if shape.kind != "capsule" else shape.size[0] + shape.size[1] / 2
        reach = max(reach, middle + half)
    most = min(0.1, 0.8 * (reach or 0.1))
    return {"along_x_m": (-most, most), "along_y_m": (-most, most)}


@effect(
    "com_shifted",
    family="body",
    targets=parts,
    parameters=(
        Parameter("along_x_m", "m", -math.inf, math.inf, 0.0, "shift along the part's x axis", 0.002),
        Parameter("along_y_m", "m", -math.inf, math.inf, 0.0, "shift along the part's y axis", 0.002),
    ),
    physics="The centre of mass of a part lies elsewhere than in the model, as with a payload or a battery put on one side.",
    signature="A lean that is constant at rest and turns with the part; joint load differs between the sides.",
    reference="Featherstone 2008, Rigid Body Dynamics Algorithms, section 2.13",
    ranges=_shifts,
)
def com_shifted(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    x, y, z = robot.part(target).com_m
    return robot.with_part(target, com_m=(x + values["along_x_m"], y + values["along_y_m"], z))
