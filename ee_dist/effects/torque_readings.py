"""When a log reads torques, beside when it reads positions."""

from __future__ import annotations

from collections.abc import Mapping

from ee_dist.basics.altered import altered
from ee_dist.effects.catalogue import effect
from ee_dist.effects.effect import Parameter
from ee_dist.effects.scales import DELAYED_S, always
from ee_dist.effects.targets import bolted_motors
from ee_dist.robots.model import Robot

TORQUES_READ_LATE = "torque_reading_delay"


@effect(
    TORQUES_READ_LATE,
    # Torques of a log need no sensor in the description: it is the drive whose torque is read, as with the gain of a current.
    family="drive",
    targets=bolted_motors,
    parameters=(Parameter("delay_s", "s", -2.0, 2.0, 0.0, "by how much torques are read later than positions", 0.002),),
    ranges=always(delay_s=(-DELAYED_S, DELAYED_S)),
    physics="Torques come through a filter, a bus or a clock of their own: what stands in a row of the log acted some time "
    "before the positions beside it. Below zero it is the positions that are read late. The robot moves as it did. Set it right "
    "with lead_s at the torques of the mapping, or leave it in the model.",
    signature="What is left goes with how fast the measured torque changes, mostly at all joints by one time; friction, springs "
    "and masses stand in for it.",
    reference="Isermann 2006, Fault-Diagnosis Systems, chapter 20",
)
def torque_reading_delay(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    late = values["delay_s"]
    return robot.map_drive(target, lambda d: altered(d, torque_read_late_s=d.torque_read_late_s + late))
