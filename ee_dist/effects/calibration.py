"""Nominal numbers that are never quite right: what a fit puts straight before it looks for missing physics.

They are effects like any other, so that a model file says by how much a data sheet was off, but ``explain`` does not
propose them by itself: hardly any model would not be a little better for one.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from ee_dist.basics.altered import altered
from ee_dist.effects import scales
from ee_dist.effects.catalogue import effect, find
from ee_dist.effects.effect import Parameter
from ee_dist.effects.scales import Range
from ee_dist.effects.targets import (
    Assumed,
    bolted_motors,
    damped_drives,
    is_adjustable,
    is_arm,
    motors,
    motors_with_speed_limit,
    position_drives,
    powered,
    uneven_rotors,
    with_rotors,
)
from ee_dist.robots.model import Drive, Quat, Robot

STABLE = 1.8
"""Speed times this, of what stops a joint in one step: at 2 explicit damping only turns a motion round."""


@effect(
    "motor_gain",
    family="drive",
    targets=powered,
    parameters=(Parameter("change", "1", -0.7, 2.0, 0.0, "change of torque per volt as a share of nominal", 0.01),),
    physics="The motor makes more or less torque of the same voltage than its data sheet says; its back-EMF stays.",
    signature="Residual torque in proportion to the voltage or duty cycle.",
    searchable=False,
    everywhere=True,
)
def motor_gain(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    scale = 1.0 + values["change"]

    def stronger(d: Drive) -> Drive:
        return altered(
            d,
            kp=d.kp * scale,
            ki=d.ki * scale,
            kd=d.kd * scale,
            torque_limit=d.torque_limit * scale,
            speed_limit=d.speed_limit * scale,
            command_gain=d.command_gain * scale if d.command == "torque" else d.command_gain,
        )

    return robot.map_drive(target, stronger)


STRONGEST, STRONGER_AT_LEAST = 5.0, 1.2
"""Times as strong as described that a motor may be, where its controller stays slow enough for the time step; and in any case."""


def _strengths(robot: Robot, target: str) -> dict[str, Range]:
    drive = scales.drive_of(robot, target)
    stiff = drive.kp if drive.command == "position" else 0.0
    stiffer = scales.firmest(robot, target) / stiff if stiff > 0 else math.inf
    most = min(stiffer, _times_steeper(robot, drive))
    return {"change": (-0.7, min(STRONGEST, max(STRONGER_AT_LEAST, most)) - 1.0)}


@effect(
    "motor_strength",
    family="drive",
    targets=powered,
    parameters=(
        Parameter("change", "1", -0.9, 9.0, 0.0, "change of all torque that the motor makes, as a share", 0.01),
    ),
    ranges=_strengths,
    physics="The motor is stronger or weaker than described, by one factor at any speed: stall torque and gains of the controller"
    " alike, as where a data sheet is of another voltage.",
    signature="Where only motion is measured, all masses, rotors and friction off by the inverse factor look the same.",
    searchable=False,
)
def motor_strength(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    return robot.map_drive(target, lambda d: altered(d, strength=d.strength * (1.0 + values["change"])))


@effect(
    "current_gain",
    family="drive",
    targets=bolted_motors,
    parameters=(
        Parameter("factor", "1", 0.01, 100.0, 1.0, "torque of the motor over what is read off its current", 0.01),
    ),
    ranges=scales.always(factor=(0.2, 5.0)),
    physics="The torque that a motor makes of each ampere is another than the gain with which its current was read: the motor "
    "moves as it did, and the torques that were logged are off by one factor.",
    signature="Measured torque in proportion to what the motion and friction need, by another factor than 1. Masses and friction "
    "off by that factor look the same: only masses that are known fix it.",
    searchable=False,
)
def current_gain(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    return robot.map_drive(target, lambda d: altered(d, current_gain=d.current_gain * values["factor"]))


def _slopes(robot: Robot, target: str) -> dict[str, Range]:
    """As far as the drive's damping, which acts on the speed at the start of a step, stays stable."""
    drive = scales.drive_of(robot, target)
    steepest = STABLE * scales.steady(robot, target) / robot.time_step_s - drive.kd
    return {"change": (-0.9, min(5.0, max(0.02, steepest * drive.speed_limit / drive.torque_limit - 1.0)))}


@effect(
    "back_emf",
    family="drive",
    targets=motors_with_speed_limit,
    parameters=(
        Parameter("change", "1", -0.9, 5.0, 0.0, "change of torque lost per speed as a share of nominal", 0.02),
    ),
    ranges=_slopes,
    physics="The voltage that the turning motor makes against its supply is larger or smaller than nominal.",
    signature="Residual torque in proportion to speed, only while the motor is driven.",
    searchable=False,
)
def back_emf(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    return robot.map_drive(target, lambda d: altered(d, speed_limit=d.speed_limit / (1.0 + values["change"])))


GAIN_KNOWN, GAIN_ASSUMED = (0.2, 5.0), (0.02, 20.0)
"""Factors worth trying on a position gain that somebody knew, and on one that had to be assumed."""


def _gains(robot: Robot, target: str) -> dict[str, Range]:
    if (target, "kp") not in robot.assumed:
        return {"factor": GAIN_KNOWN}
    return {"factor": GAIN_ASSUMED}


@effect(
    "position_gain",
    family="drive",
    targets=position_drives,
    parameters=(
        Parameter(
            "factor", "1", 0.01, 100.0, 1.0, "factor on the gain of the position controller", 0.01, by_ratio=True
        ),
    ),
    physics="The position controller has another gain than the model says: a setting of a trial, or a data sheet that is wrong.",
    signature="Residual command in proportion to the position error.",
    ranges=_gains,
    worth_proposing=is_adjustable,
    everywhere=True,
    guesses=Assumed("kp"),
)
def position_gain(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    return robot.map_drive(target, lambda d: altered(d, kp=d.kp * values["factor"]))


def _steepest(robot: Robot, drive: Drive) -> tuple[float, float]:
    """Damping of the drive's motor alone, and the most that stays stable where it acts on the speed at the start of a step."""
    own = drive.torque_limit / drive.speed_limit if math.isfinite(drive.speed_limit) else 0.0
    return own, STABLE * scales.steady(robot, drive.joint) / robot.time_step_s


def _times_steeper(robot: Robot, drive: Drive) -> float:
    """By how many times all damping of the drive, its motor's and its controller's, may grow; endless where it has none."""
    own, most = _steepest(robot, drive)
    damping = own + (drive.kp if drive.command == "speed" else drive.kd)
    return most / damping if damping > 0 else math.inf


NEXT_TO_NONE = 0.01
"""Of a gain on speed: with none at all the drive would be none that has such a gain, and no other factor could act on it."""


STEEPER = 5.0
"""Times the damping that is described, or that with which the joint lags as it was seen to, that is worth trying."""


def _damping(robot: Robot, target: str) -> dict[str, Range]:
    """As far as damping stays steady in the robot's time step. A guess that a log shows to be short of it goes farther: models of
    measured robots hold any (``discrepancy.steps``), and a servo that follows as a filter does has far more than a soft one."""
    drive = scales.drive_of(robot, target)
    if (target, "kd") in robot.assumed:
        return {"factor": (NEXT_TO_NONE, STEEPER * max(1.0, robot.joint(target).lag_s * drive.kp / drive.kd))}
    own, most = _steepest(robot, drive)
    return {"factor": (NEXT_TO_NONE, min(STEEPER, max(1.02, (most - own) / drive.kd)))}


@effect(
    "speed_gain",
    family="drive",
    targets=damped_drives,
    parameters=(Parameter("factor", "1", 0.0, 100.0, 1.0, "factor on the controller's gain on speed", 0.01),),
    physics="The controller damps more or less than the model says: its gain on the joint's speed is another.",
    signature="Residual command in proportion to speed while the drive is not at its limit; like viscous friction, but gone when "
    "the drive is released.",
    worth_proposing=is_adjustable,
    ranges=_damping,
    guesses=Assumed("kd"),
)
def speed_gain(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    return robot.map_drive(target, lambda d: altered(d, kd=d.kd * values["factor"]))


HEAVIEST = 20.0
"""Times the rotors that were guessed: those of an arm for 300 kg (KUKA KR300, by its identified model) have 5 to 16."""


LIGHTEST = 1 / 50
"""The same to the other side, as far as a guessed gain may be off: direct drives (Unitree Aliengo) have 1/15 to 1/70. As far as
the joint stays slow enough for its controller; where that was guessed, too, it is as far off, and steady with the lighter one."""


def _heavier(robot: Robot, target: str) -> dict[str, Range]:
    """Lighter and heavier by more than ``rotor_inertia`` goes: a guess by the size of a motor is an order of magnitude short for
    the high gears of a large arm, and as much too heavy for direct drives."""
    rotor = scales.drive_of(robot, target).rotor_inertia
    less, more = find("rotor_inertia").bounds(robot, target)["added_kg_m2"]
    steady = 1.0 - scales.spare_inertia(robot, target) / rotor
    least = LIGHTEST if (target, "kp") in robot.assumed else max(LIGHTEST, steady)
    return {"factor": (min((rotor + less) / rotor, least), max((rotor + more) / rotor, HEAVIEST))}


@effect(
    "rotor_factor",
    family="drive",
    targets=with_rotors,
    parameters=(
        Parameter("factor", "1", 0.01, 1000.0, 1.0, "factor on the described rotor inertia", 0.02, by_ratio=True),
    ),
    physics="The rotors behind the gears are heavier or lighter than described, all by one factor: who guessed at them from the "
    "size of the motors was off by it at all of them.",
    signature="Residual torque in proportion to the joint's acceleration and to the described rotor, at all joints alike.",
    searchable=False,
    ranges=_heavier,
    guesses=uneven_rotors,
)
def rotor_factor(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    return robot.map_drive(target, lambda d: altered(d, rotor_inertia=d.rotor_inertia * values["factor"]))


def _gears(robot: Robot, target: str) -> dict[str, Range]:
    # Damping at the joint grows with the square of the ratio.
    steeper = _times_steeper(robot, scales.drive_of(robot, target))
    return {"change": (-0.4, min(0.6, max(0.02, math.sqrt(steeper) - 1.0)))}


@effect(
    "gear_ratio",
    family="drive",
    targets=powered,
    parameters=(Parameter("change", "1", -0.5, 1.0, 0.0, "change of motor turns per joint turn, as a share", 0.005),),
    physics="The gear is another than the model says. Encoder and controller are on the motor's side: the joint goes less far "
    "for a command, and torque and reflected rotor inertia grow with the ratio and with its square.",
    signature="The joint's position is a scaled copy of the prediction, as with a command gain, but its torque grows where its "
    "motion shrinks.",
    reference="Hughes and Drury 2013, Electric Motors and Drives, chapter 11",
    searchable=False,
    ranges=_gears,
)
def gear_ratio(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    if values["change"] == 0:
        return robot
    n = 1.0 + values["change"]

    def geared(d: Drive) -> Drive:
        # The motor turns n times as far, with torque over n: n^2 is in every gain, and a command counts for 1/n of the way.
        return altered(
            d,
            kp=d.kp * n * n,
            ki=d.ki * n * n,
            kd=d.kd * n * n,
            rotor_inertia=d.rotor_inertia * n * n,
            torque_limit=d.torque_limit * n,
            speed_limit=d.speed_limit / n,
            command_speed=d.command_speed / n,
            command_acceleration=d.command_acceleration / n,
            command_gain=d.command_gain * n if d.command == "torque" else d.command_gain / n,
            zero_offset=d.zero_offset / n,
            deadband=d.deadband / n,
            current_gain=d.current_gain * n,
            back_emf=d.back_emf * n * n,
        )

    return robot.map_drive(target, geared)


@effect(
    "encoder_zero",
    family="body",
    targets=motors,
    parameters=(Parameter("offset", "rad", -0.1, 0.1, 0.0, "what the encoder reads where the model has zero", 0.001),),
    physics="The encoder was mounted a little turned: where it reads zero the joint is not where the model has its zero.",
    signature="Gravity load shifted along the position axis; nothing where gravity does no work on the joint.",
    worth_proposing=is_arm,
)
def encoder_zero(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    offset = values["offset"]
    if offset == 0.0:
        return robot
    joint = robot.joint(target)
    if joint.kind == "slide":
        x, y, z = (-offset * a for a in _turned(joint.rotation, joint.axis))
        px, py, pz = joint.position_m
        return robot.with_joint(target, position_m=(px + x, py + y, pz + z))
    ax, ay, az = joint.axis
    s, c = math.sin(-offset / 2), math.cos(-offset / 2)
    return robot.with_joint(target, rotation=_times(joint.rotation, (ax * s, ay * s, az * s, c)))


@effect(
    "axis_tilt",
    family="body",
    targets=motors,
    parameters=(
        Parameter("first_deg", "deg", -60.0, 60.0, 0.0, "tilt towards the first direction across the axis", 0.1),
        Parameter("second_deg", "deg", -60.0, 60.0, 0.0, "tilt towards the second, the axis times the first", 0.1),
    ),
    ranges=scales.always(first_deg=(-10.0, 10.0), second_deg=(-10.0, 10.0)),
    physics="A joint's axis does not point where the model says: a bearing seat that is not square, a printed part that has "
    "warped, a drawing that was read the wrong way. The pose at position zero stays; what the joint carries swings out of its "
    "plane. The first direction is that of the part's x, y and z that lies most across the axis, made square to it: x and "
    "y for an axis along z, y and z for one along x, x and -z for one along y.",
    signature="Residual torque of one period in the joint's own angle, at the joint and at all beyond it, at rest too; none "
    "where gravity does no work on them.",
    reference="Mooring, Roth and Driels 1991, Fundamentals of Manipulator Calibration, chapter 2",
    worth_proposing=is_arm,
)
def axis_tilt(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    first, second = (math.tan(math.radians(values[k])) for k in ("first_deg", "second_deg"))
    if first == second == 0.0:
        return robot
    axis = np.array(robot.joint(target).axis)
    across = np.eye(3)[np.argmin(np.abs(axis).round(9))]
    p = across - (across @ axis) * axis
    p /= np.linalg.norm(p)
    tilted = axis + first * p + second * np.cross(axis, p)
    x, y, z = (float(v) for v in tilted / np.linalg.norm(tilted))
    return robot.with_joint(target, axis=(x, y, z))


def _times(a: Quat, b: Quat) -> Quat:
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )


def _turned(q: Quat, v: tuple[float, float, float]) -> tuple[float, float, float]:
    x, y, z, _ = _times(_times(q, (*v, 0.0)), (-q[0], -q[1], -q[2], q[3]))
    return x, y, z
