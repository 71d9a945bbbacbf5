"""Times that a log gives to commands, and at which they were not sent."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from ee_dist.effects.catalogue import effect
from ee_dist.effects.effect import Parameter
from ee_dist.effects.scales import always
from ee_dist.effects.targets import is_adjustable, powered
from ee_dist.robots.model import Robot

STAMPED_LATE = "commands_stamped_late"
LATEST_S = 0.05
"""A row of a log at 20 Hz."""


def _log(robot: Robot) -> tuple[str, ...]:
    return ("log",) if powered(robot) else ()


@effect(
    STAMPED_LATE,
    family="wiring",
    targets=_log,
    parameters=(Parameter("late_s", "s", 0.0, 1.0, 0.0, "time by which commands act before their stamps", 0.001),),
    physics="The log stamps its commands after they were sent: a loop that sends, reads and then looks at its clock, or streams "
    "whose clocks differ. Set it right with lead_s in the mapping, or where the log is written.",
    signature="Joints answer sooner than any drive could: what was predicted is late by one time at all joints, in proportion to "
    "speed; nothing shows at rest. It may hide in joints that are stiffer or lighter than they are.",
    ranges=always(late_s=(0.0, LATEST_S)),
    worth_proposing=is_adjustable,
)
def commands_stamped_late(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    return replace(robot, wiring=replace(robot.wiring, early_s=robot.wiring.early_s + values["late_s"]))
