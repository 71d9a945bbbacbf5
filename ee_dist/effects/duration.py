"""Controllers that take a set time to each new goal."""

from __future__ import annotations

from collections.abc import Mapping

from ee_dist.effects import scales
from ee_dist.effects.catalogue import effect
from ee_dist.effects.described import with_more
from ee_dist.effects.effect import Parameter
from ee_dist.effects.scales import Range
from ee_dist.effects.targets import is_adjustable, position_drives
from ee_dist.robots.model import Robot

LONGEST_S = 2.0
"""Time to a goal up to which is looked: slower moves are rather told as many goals on the way."""


def _durations(robot: Robot, target: str) -> dict[str, Range]:
    return {"duration_s": (0.0 - scales.drive_of(robot, target).command_duration, LONGEST_S)}


@effect(
    "command_duration",
    family="drive",
    targets=position_drives,
    parameters=(
        Parameter(
            "duration_s",
            "s",
            -10.0,
            10.0,
            0.0,
            "time that the controller takes to each new goal, on top of nominal",
            0.01,
            on_top="command_duration",
        ),
    ),
    physics="The controller takes a set time to each new goal and moves there evenly: a time-based profile of the firmware, a "
    "goal time or a move time. A goal that changes before begins anew, with the whole time for what is left, so that commands "
    "which change at every row are followed as by a first-order lag of that time.",
    signature="Steps become ramps that last the same, whatever their size and the load: small ones are slow, large ones quick. "
    "Streamed commands are followed late, in proportion to their speed.",
    reference="Robotis e-Manual, Dynamixel X series, Drive Mode (time-based profile)",
    ranges=_durations,
    worth_proposing=is_adjustable,
)
def command_duration(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    """Nothing changes where T (s) is no more than a time step: the goal is there within it. Of commands that change at every row
    each change starts anew with T for what is left, as in real firmware: a first-order lag of T."""
    return with_more(robot, target, "command_duration", values["duration_s"])
