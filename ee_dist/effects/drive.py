"""Effects in the drives: motor, gear and position controller of a joint."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from ee_dist.effects.body import PAPER
from ee_dist.effects.catalogue import Parameter, effect
from ee_dist.effects.targets import motors
from ee_dist.robots.model import Drive, Robot


@effect(
    "motor_weak",
    family="drive",
    targets=motors,
    parameters=(Parameter("loss", "1", 0.0, 1.0, 0.0, "share of the torque that is lost", 0.02),),
    physics="A motor gives only part of its torque, as when its magnets have aged or a winding is shorted.",
    signature="The joint lags in proportion to the torque asked of it, most under load; at rest without load nothing shows.",
    reference=PAPER,
)
def motor_weak(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    def weaker(drive: Drive) -> Drive:
        return replace(drive, strength=drive.strength * (1.0 - values["loss"]))

    return robot.map_drive(target, weaker)


@effect(
    "joint_jam",
    family="drive",
    targets=motors,
    parameters=(Parameter("loss", "1", 0.0, 1.0, 0.0, "share of the range of motion that is lost", 0.02),),
    physics="Something blocks the joint: it moves freely, but only within a part of its range about the rest pose.",
    signature="The joint follows until a fixed position, then stops dead however large the command.",
    reference=PAPER,
)
def joint_jam(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    return robot.with_joint(target, freedom=robot.joint(target).freedom * (1.0 - values["loss"]))
