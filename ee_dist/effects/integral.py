"""Controllers that add up what is left of an error until it is gone."""

from __future__ import annotations

from collections.abc import Mapping

from ee_dist.effects import scales
from ee_dist.effects.catalogue import effect
from ee_dist.effects.described import with_more
from ee_dist.effects.effect import Parameter
from ee_dist.effects.scales import Range
from ee_dist.effects.targets import controlled
from ee_dist.robots.model import Robot

INTEGRAL = "integral_gain"
QUICKEST_S = 0.2
"""Time in which an error that stays doubles what the controller asks for, at the least that is looked at: an integral much
quicker than its joint swings up."""


def _integrals(robot: Robot, target: str) -> dict[str, Range]:
    drive = scales.drive_of(robot, target)
    return {"added": (0.0 - drive.ki, drive.kp / QUICKEST_S)}


@effect(
    INTEGRAL,
    family="drive",
    targets=controlled,
    parameters=(
        Parameter(
            "added",
            "N.m/(rad.s)",
            -1e6,
            1e6,
            0.0,
            "gain on the sum of the error over time, on top of nominal (of a controller of speed N.m/rad)",
            0.02,
            on_top="ki",
        ),
    ),
    physics="The controller adds up its error over time (a PI or PID controller), so that friction and load are overcome in the "
    "end; the sum is held within a quarter of the torque limit.",
    signature="What the joint hangs back under load or friction creeps away while the command rests, and it overshoots after "
    "long errors; with little time nothing changes.",
    reference="Astrom and Hagglund 2006, Advanced PID Control, section 3.5 (integrator windup)",
    ranges=_integrals,
    searchable=False,
)
def integral_gain(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    return with_more(robot, target, "ki", values["added"])
