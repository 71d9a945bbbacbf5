"""Effects between motor and joint, and of what sits on the joint beside the motor."""

from __future__ import annotations

import math
from collections.abc import Mapping

from ee_dist.basics.altered import altered
from ee_dist.effects import scales
from ee_dist.effects.body import PAPER
from ee_dist.effects.catalogue import effect
from ee_dist.effects.effect import Parameter
from ee_dist.effects.scales import Range
from ee_dist.effects.targets import controlled, motors, powered, sprung_joints, stopped_joints
from ee_dist.robots.model import Drive, Robot


@effect(
    "joint_jam",
    family="drive",
    targets=stopped_joints,
    parameters=(Parameter("loss", "1", 0.0, 1.0, 0.0, "share of the range of motion that is lost", 0.02),),
    physics="Something blocks the joint: it moves freely, but only within a part of its range about the rest pose.",
    signature="The joint follows until a fixed position, then stops dead however large the command.",
    reference=PAPER,
)
def joint_jam(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    return robot.with_joint(target, freedom=robot.joint(target).freedom * (1.0 - values["loss"]))


def _gaps(robot: Robot, target: str) -> dict[str, Range]:
    return {"gap_rad": (0.0, 0.2 * scales.travel(robot, target))}


@effect(
    "backlash",
    family="drive",
    targets=powered,
    parameters=(
        Parameter("gap_rad", "rad", 0.0, math.inf, 0.0, "free play of the joint when the motor stands still", 0.002),
    ),
    physics="Teeth have play: after a reversal the motor first crosses the gap, then takes the joint along. The position sensor "
    "of the controller is on the motor's side.",
    signature="After each reversal the joint waits, then follows late and lands hard; within the gap it hangs to the side of its "
    "load. Sensor and command seem to differ by up to half the gap.",
    reference="Nordin and Gutman 2002, Automatica 38(10)",
    ranges=_gaps,
)
def backlash(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    return robot.map_drive(target, lambda d: altered(d, backlash=d.backlash + values["gap_rad"]))


def _twists(robot: Robot, target: str) -> dict[str, Range]:
    return {"compliance_rad_nm": (0.0, 0.4 * scales.travel(robot, target) / scales.torque(robot, target))}


@effect(
    "elastic_transmission",
    family="drive",
    targets=controlled,
    parameters=(
        Parameter(
            "compliance_rad_nm", "rad/(N.m)", 0.0, math.inf, 0.0, "twist between motor and joint for each N.m", 0.001
        ),
    ),
    physics="Belts, flexible gears and long shafts twist under torque; the controller's sensor is before the twist.",
    signature="The joint is off by compliance times torque, also at rest under load, and swings on after quick moves.",
    reference="Spong 1987, Modeling and control of elastic joint robots, J. Dyn. Sys. Meas. Control 109(4)",
    ranges=_twists,
)
def elastic_transmission(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    return robot.map_drive(target, lambda d: altered(d, compliance=d.compliance + values["compliance_rad_nm"]))


LEFT = 1e-9
"""Share of a spring below which it is none."""


def _springs(robot: Robot, target: str) -> dict[str, Range]:
    joint, travel = robot.joint(target), scales.travel(robot, target)
    stiffest = min(scales.torque(robot, target) / travel, scales.stiffest(robot, target))
    return {
        # A spring that is described may be softer, down to none.
        "stiffness_nm_rad": (0.0 - scales.drive_of(robot, target).spring, stiffest),
        "rest_rad": (max(joint.lower, -travel), min(joint.upper, travel)),
    }


@effect(
    "parallel_spring",
    family="drive",
    targets=sprung_joints,
    parameters=(
        Parameter(
            "stiffness_nm_rad",
            "N.m/rad",
            -math.inf,
            math.inf,
            0.0,
            "torque for each rad away from rest, on top of nominal",
            0.02,
            on_top="spring",
        ),
        Parameter("rest_rad", "rad", -math.inf, math.inf, 0.0, "position at which the spring pulls nothing", 0.02),
    ),
    physics="A spring beside the motor: a cable, a hose, a gas spring, a balance spring that the model left out.",
    signature="Residual torque is a straight line against position, whatever the speed; it is there at rest too.",
    ranges=_springs,
    plainer="offset_torque",
)
def parallel_spring(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    stiffness, rest = values["stiffness_nm_rad"], values["rest_rad"]
    if stiffness == 0:
        return robot

    def sprung(drive: Drive) -> Drive:
        # Two springs on one joint pull like one: stiffnesses add, and it rests between their rests. Less of one that is described
        # leaves, where it leaves nothing, what its rest was off by.
        total = max(drive.spring + stiffness, 0.0)
        pull = drive.spring * drive.spring_rest + (total - drive.spring) * rest
        if total <= LEFT * drive.spring:
            return altered(drive, spring=0.0, spring_rest=0.0, offset_torque=drive.offset_torque + pull)
        return altered(drive, spring=total, spring_rest=pull / total)

    return robot.map_drive(target, sprung)


def _offsets(robot: Robot, target: str) -> dict[str, Range]:
    most = 0.5 * scales.torque(robot, target)
    return {"torque_nm": (-most, most)}


@effect(
    "offset_torque",
    family="drive",
    targets=motors,
    parameters=(Parameter("torque_nm", "N.m", -math.inf, math.inf, 0.0, "constant torque on the joint", 0.005),),
    physics="A constant torque or force on the joint: an unbalanced amplifier, a preload, a weight on a string.",
    signature="Residual torque is the same at every position, speed and direction.",
    reference="Janot, Gautier and Brunot 2019, Data set and reference models of EMPS",
    ranges=_offsets,
)
def offset_torque(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    return robot.map_drive(target, lambda d: altered(d, offset_torque=d.offset_torque + values["torque_nm"]))
