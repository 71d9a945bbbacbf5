"""How a robot is held while it is tried: known to the experimenter, part of a trial's setup, never a suspect."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from ee_dist.effects.catalogue import effect
from ee_dist.robots.model import Robot

STAND = "on_stand"


def _whole(robot: Robot) -> tuple[str, ...]:
    return ("",)


@effect(
    STAND,
    family="world",
    targets=_whole,
    physics="The robot's body is clamped to a level stand and its limbs hang free: nothing touches the floor.",
    signature="No contact, no motion of the body: what is left to see is in the joints, their drives and the sensors.",
    searchable=False,
)
def on_stand(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    world = replace(
        robot.world, has_floor=False, tilt_x_rad=0.0, tilt_y_rad=0.0, push_x_n=0.0, push_y_n=0.0, drag_n_s_m=0.0
    )
    return replace(robot, world=world, free_base=False)
