"""Effects in the motor and its position controller."""

from __future__ import annotations

import math
from collections.abc import Mapping

from ee_dist.basics.altered import altered
from ee_dist.effects import scales
from ee_dist.effects.body import PAPER
from ee_dist.effects.catalogue import effect
from ee_dist.effects.described import with_more
from ee_dist.effects.effect import Parameter
from ee_dist.effects.scales import Range
from ee_dist.effects.targets import (
    Assumed,
    gains_are_known,
    governed_drives,
    motors,
    motors_with_speed_limit,
    motors_with_torque_limit,
    position_drives,
    powered,
    supply,
)
from ee_dist.robots.model import Drive, Robot

MOTORS = "Hughes and Drury 2013, Electric Motors and Drives, chapter 3"


@effect(
    "motor_weak",
    family="drive",
    targets=powered,
    parameters=(Parameter("loss", "1", 0.0, 1.0, 0.0, "share of the torque that is lost", 0.02),),
    physics="A motor gives only part of its torque, as when its magnets have aged or a winding is shorted.",
    signature="The joint lags in proportion to the torque asked of it, most under load; at rest without load nothing shows.",
    reference=PAPER,
    worth_proposing=gains_are_known,
)
def motor_weak(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    def weaker(drive: Drive) -> Drive:
        return altered(drive, strength=drive.strength * (1.0 - values["loss"]))

    return robot.map_drive(target, weaker)


LEAST_LOSS, MOST_LOSS = -4.0, 0.95
"""Shares of a torque limit that may be lost, the first of one that was guessed at: it may have been five times too low."""


def _limits(robot: Robot, target: str) -> dict[str, Range]:
    return {"loss": (LEAST_LOSS if (target, "torque_limit") in robot.assumed else 0.0, MOST_LOSS)}


@effect(
    "torque_limit",
    family="drive",
    targets=motors_with_torque_limit,
    parameters=(
        Parameter(
            "loss", "1", -99.0, 0.95, 0.0, "share of the torque limit that is lost; below 0 there is more of it", 0.02
        ),
    ),
    ranges=_limits,
    physics="The electronics cap the drive (a lower limit on duty cycle or current) below what the model allows; under the "
    "cap it works as modelled. With the voltage, the speed without load falls by the same share. A limit that was only guessed "
    "at may be too low as well.",
    signature="Nothing while little torque is asked; then torque is flat at the cap and the joint falls behind.",
    reference=MOTORS,
    guesses=Assumed("torque_limit"),
)
def torque_limit(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    left = 1.0 - values["loss"]

    def capped(drive: Drive) -> Drive:
        # Speed falls along, so that the back-EMF of a given speed stays what it was.
        return altered(drive, torque_limit=drive.torque_limit * left, speed_limit=drive.speed_limit * left)

    return robot.map_drive(target, capped)


@effect(
    "speed_limit",
    family="drive",
    targets=motors_with_speed_limit,
    parameters=(Parameter("loss", "1", 0.0, 0.9, 0.0, "share of the speed without load that is lost", 0.02),),
    physics="The motor runs slower without load than its data sheet says: its back-EMF takes more torque at any speed.",
    signature="The joint lags in proportion to its speed, whatever the load; at rest nothing shows. Like viscous friction, "
    "but gone when the drive is released.",
    reference=MOTORS,
)
def speed_limit(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    def slower(drive: Drive) -> Drive:
        own = drive.torque_limit / drive.speed_limit
        return altered(drive, back_emf=(own + drive.back_emf) / (1.0 - values["loss"]) - own)

    if values["loss"] == 0:
        return robot
    return robot.map_drive(target, slower)


@effect(
    "supply_sag",
    family="drive",
    targets=supply,
    parameters=(
        Parameter("share", "1", 0.0, 0.9, 0.0, "share of the voltage lost when all motors give their most", 0.02),
    ),
    physics="Battery and wires have resistance: the more torque all motors give together, the less voltage is left for each.",
    signature="All joints lag at once, in the moments when the sum of torques is large; one joint moved alone hardly shows it.",
    reference=MOTORS,
)
def supply_sag(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    return robot.with_world(supply_sag=robot.world.supply_sag + values["share"])


def _gains(robot: Robot, target: str) -> dict[str, Range]:
    """Of torques, that of a motor whose constant nobody knew: several times off; of speeds, what a bus was told of another
    motor's. A position that is so is another unit."""
    return {
        "change": {"torque": (-0.8, 4.0), "speed": (-0.7, 2.0)}.get(scales.drive_of(robot, target).command, (-0.5, 0.5))
    }


@effect(
    "command_gain",
    family="drive",
    targets=powered,
    parameters=(Parameter("change", "1", -0.9, 9.0, 0.0, "change of what was commanded, as a share of it", 0.01),),
    ranges=_gains,
    physics="The drive reads a larger or smaller position (speed, torque) than was sent: a wrong scale between the two, or, "
    "of torques, a motor whose constant is another.",
    signature="The joint's position (or speed) is a scaled copy of the prediction, at any speed and load; by torques it moves "
    "more or less. Nothing shows at a command of zero.",
    everywhere=True,
)
def command_gain(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    def scaled(drive: Drive) -> Drive:
        return altered(drive, command_gain=drive.command_gain * (1.0 + values["change"]))

    return robot.map_drive(target, scaled)


def _delays(robot: Robot, target: str) -> dict[str, Range]:
    return {"delay_s": (0.0 - scales.drive_of(robot, target).delay_s, scales.longest_delay(robot))}


@effect(
    "command_delay",
    family="drive",
    targets=powered,
    parameters=(
        Parameter(
            "delay_s", "s", -2.0, 2.0, 0.0, "time from command to reaction, on top of nominal", 0.002, on_top="delay_s"
        ),
    ),
    physics="A command takes effect late: bus, filter and firmware hold it back.",
    signature="The joint's motion is the prediction shifted in time: the residual is speed times delay, and zero at rest.",
    ranges=_delays,
    everywhere=True,
)
def command_delay(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    return with_more(robot, target, "delay_s", values["delay_s"])


LONGEST_S = 5.0
"""Longest time in which a profile reaches the speed of the motor by itself, s."""
SLOWEST = 5.0
"""Times slower than the motor by itself, down to which a controller may hold a joint back."""


def _slowness(robot: Robot, target: str) -> dict[str, Range]:
    return {"slowness_s_rad": (0.0, SLOWEST / scales.speed(robot, target))}


@effect(
    "command_speed",
    family="drive",
    targets=governed_drives,
    parameters=(
        Parameter(
            "slowness_s_rad",
            "s/rad",
            0.0,
            math.inf,
            0.0,
            "least time that the controller takes for a rad, on top of nominal: 0.2 s/rad is no faster than 5 rad/s",
            0.01,
        ),
    ),
    physics="The controller leads the joint to its goal no faster than a set speed: a velocity limit or profile of the firmware. "
    "Of a drive that obeys torques: near that speed none pushes on.",
    signature="Steps become ramps of one slope, whatever their size and the load; slow motions show nothing. Torques that "
    "push on are missing near one speed, and those that brake are not.",
    ranges=_slowness,
)
def command_speed(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    def slower(drive: Drive) -> Drive:
        return altered(drive, command_speed=1.0 / (1.0 / drive.command_speed + values["slowness_s_rad"]))

    return robot.map_drive(target, slower) if values["slowness_s_rad"] > 0 else robot


def _reluctance(robot: Robot, target: str) -> dict[str, Range]:
    return {"reluctance_s2_rad": (0.0, LONGEST_S / scales.speed(robot, target))}


@effect(
    "command_acceleration",
    family="drive",
    targets=position_drives,
    parameters=(
        Parameter(
            "reluctance_s2_rad",
            "s^2/rad",
            0.0,
            math.inf,
            0.0,
            "what the goal needs to gather speed, on top of nominal: 0.2 s^2/rad is no more than 5 rad/s^2",
            0.01,
        ),
    ),
    physics="The controller's goal gathers speed, and loses it before it arrives, no faster than a set acceleration: a "
    "trapezoidal profile of the firmware.",
    signature="Steps become curves that begin and end gently, whatever the load; slow motions show nothing.",
    ranges=_reluctance,
)
def command_acceleration(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    def gentler(drive: Drive) -> Drive:
        return altered(
            drive, command_acceleration=1.0 / (1.0 / drive.command_acceleration + values["reluctance_s2_rad"])
        )

    return robot.map_drive(target, gentler) if values["reluctance_s2_rad"] > 0 else robot


def _zeros(robot: Robot, target: str) -> dict[str, Range]:
    most = 0.4 * scales.travel(robot, target)
    return {"offset_rad": (-most, most)}


@effect(
    "zero_offset",
    family="drive",
    targets=position_drives,
    parameters=(
        Parameter("offset_rad", "rad", -math.inf, math.inf, 0.0, "how far below its command the joint settles", 0.005),
    ),
    physics="The controller's zero is not the joint's: a horn mounted a tooth off, or a calibration lost.",
    signature="A constant shift of one joint, from the first step, at any speed and load.",
    ranges=_zeros,
    everywhere=True,
)
def zero_offset(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    def shifted(drive: Drive) -> Drive:
        return altered(drive, zero_offset=drive.zero_offset + values["offset_rad"])

    return robot.map_drive(target, shifted)


def _widths(robot: Robot, target: str) -> dict[str, Range]:
    return {"half_width_rad": (0.0, 0.2 * scales.travel(robot, target))}


@effect(
    "deadband",
    family="drive",
    targets=position_drives,
    parameters=(
        Parameter("half_width_rad", "rad", 0.0, math.inf, 0.0, "error on either side that the drive ignores", 0.002),
    ),
    physics="The controller does nothing about small errors, so as not to hum; beyond, it sees the error less the band.",
    signature="The joint stops short of its target by up to the half width, on the side it came from; small commands are lost.",
    ranges=_widths,
)
def deadband(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    def wider(drive: Drive) -> Drive:
        return altered(drive, deadband=drive.deadband + values["half_width_rad"])

    return robot.map_drive(target, wider)


LIGHTER, LIGHTER_AT_LEAST, LIGHTER_GUESS = 0.9, 0.25, 0.98
"""Shares of the described rotor's inertia that may not be there: files often carry what keeps a simulation steady. More than
the smaller share only where the joint stays slow enough for its controller; most of all of one that was guessed at, and, where
the controller was guessed too, whatever that would do: models of measured robots hold any (``discrepancy.steps``). A torque has
no controller that a light joint could be too quick for, and a motor without a gear next to no rotor: of a guess there nothing
need be."""


GEARED = 10.0
"""How many times what a joint feels the rotor behind the gear of a torque drive may weigh: seen through a gear of 50 it counts
2500 times. One that obeys positions goes where it is led all the same, and is looked for nearer by,"""
WEIGHED, INSTANT_S = 100.0, 1e-6
"""but not where forces are measured and nothing is simulated, so that a time step is but an instant: the rotor of a wrist (UR5e)
is 6 to 40 times what else the joint feels."""


def _rotors(robot: Robot, target: str) -> dict[str, Range]:
    drive, felt, dt = scales.drive_of(robot, target), scales.inertia(robot, target), robot.time_step_s
    rotor = drive.rotor_inertia
    guessed = (target, "rotor_inertia") in robot.assumed
    most = ((1.0 if drive.command == "torque" else LIGHTER_GUESS) if guessed else LIGHTER) * rotor
    if not (guessed and (target, "kp") in robot.assumed):
        most = min(most, scales.spare_inertia(robot, target))
    less = max(LIGHTER_AT_LEAST * rotor, most)
    times = WEIGHED if dt < INSTANT_S else GEARED if drive.command == "torque" else 1.0
    more = times * felt
    return {"added_kg_m2": (0.0 - less, max(4.0 * rotor, more))}


@effect(
    "rotor_inertia",
    family="drive",
    targets=motors,
    parameters=(
        Parameter(
            "added_kg_m2",
            "kg.m^2",
            -math.inf,
            math.inf,
            0.0,
            "rotor inertia at the joint on top of nominal",
            1e-4,
            on_top="rotor_inertia",
        ),
    ),
    physics="The spinning rotor behind the gear is heavier than modelled: it resists acceleration, not position.",
    signature="Residual torque proportional to joint acceleration, not to speed or position; steps rise late and overshoot.",
    reference="Featherstone 2008, Rigid Body Dynamics Algorithms, section 9.6",
    ranges=_rotors,
    everywhere=True,
    guesses=Assumed("rotor_inertia"),
)
def rotor_inertia(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    return with_more(robot, target, "rotor_inertia", values["added_kg_m2"])
