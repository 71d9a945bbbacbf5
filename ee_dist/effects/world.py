"""Effects of the surroundings."""

from __future__ import annotations

import math
from collections.abc import Mapping

from ee_dist.effects.body import PAPER
from ee_dist.effects.catalogue import Parameter, effect
from ee_dist.effects.targets import floor
from ee_dist.robots.model import Robot


@effect(
    "floor_tilt",
    family="world",
    targets=floor,
    parameters=(
        Parameter("sideways_deg", "deg", -30.0, 30.0, 0.0, "turn of the floor about the forward axis", 0.5),
        Parameter("forward_deg", "deg", -30.0, 30.0, 0.0, "turn of the floor about the sideways axis, nose down", 0.5),
    ),
    physics="The robot stands on a slope: gravity pulls along the floor as well as into it.",
    signature="All legs on the lower side carry more from the first step; the error is constant while the robot stands.",
    reference=PAPER,
)
def floor_tilt(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    world = robot.world
    return robot.with_world(
        tilt_x_rad=world.tilt_x_rad + math.radians(values["sideways_deg"]),
        tilt_y_rad=world.tilt_y_rad + math.radians(values["forward_deg"]),
    )
