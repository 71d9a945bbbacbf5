"""Effects of friction in joint and gear. The law is in the drive path, the same for every engine."""

from __future__ import annotations

import math
from collections.abc import Mapping

from ee_dist.basics.altered import altered
from ee_dist.effects import scales
from ee_dist.effects.catalogue import effect
from ee_dist.effects.described import with_more
from ee_dist.effects.effect import Parameter
from ee_dist.effects.scales import Range, always
from ee_dist.effects.targets import motors
from ee_dist.robots.model import Drive, Robot
from ee_dist.robots.ranges import drive_of

SURVEY = "Armstrong-Helouvry, Dupont and Canudas de Wit 1994, Automatica 30(7)"
SERVOS = (
    "Duclusaud, Passault, Padois and Ly 2025, Extended Friction Models for the Physics Simulation of Servo Actuators"
)
DRY_SHARE = 0.5
"""Of its torque limit, how much a drive may lose to dry friction in the range worth trying: at 1 it would not move."""


BRAKED = 10.0
"""How many times lower than what is stated a torque drive's highest speed may be for friction: a motor led by its voltage is
braked by back-EMF too, of which nothing is taken off a torque that it is told."""


def _viscous(robot: Robot, target: str) -> float:
    drive = drive_of(robot, target)
    slower = BRAKED if drive.command == "torque" and 0 < drive.speed_limit < math.inf else 1.0
    return slower * scales.torque(robot, target) / scales.speed(robot, target)


def _viscous_range(robot: Robot, target: str) -> dict[str, Range]:
    # Who describes more than would hold the drive at its stated speed does not believe in that speed.
    described = drive_of(robot, target).viscous
    return {"damping_nm_s_rad": (0.0 - described, max(_viscous(robot, target), described))}


@effect(
    "viscous_friction",
    family="drive",
    targets=motors,
    parameters=(
        Parameter(
            "damping_nm_s_rad",
            "N.m.s/rad",
            -math.inf,
            math.inf,
            0.0,
            "torque for each unit of speed, on top of nominal",
            0.002,
            on_top="viscous",
        ),
    ),
    physics="Grease and bearings resist in proportion to speed.",
    signature="Residual torque is a straight line through zero against speed; the joint lags when it moves, not at rest.",
    reference=SURVEY,
    ranges=_viscous_range,
    everywhere=True,
)
def viscous_friction(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    return with_more(robot, target, "viscous", values["damping_nm_s_rad"])


def _dry_range(robot: Robot, target: str) -> dict[str, Range]:
    return {"torque_nm": (0.0 - drive_of(robot, target).coulomb, DRY_SHARE * scales.torque(robot, target))}


@effect(
    "coulomb_friction",
    family="drive",
    targets=motors,
    parameters=(
        Parameter(
            "torque_nm",
            "N.m",
            -math.inf,
            math.inf,
            0.0,
            "friction torque, the same at every speed, on top of nominal",
            0.005,
            on_top="coulomb",
        ),
    ),
    physics="Dry friction: a torque of constant size against the motion, which holds the joint once it is at rest.",
    signature="Residual torque is a step at zero speed: +c one way, -c the other. Small moves are lost; the joint stays where "
    "it was stopped.",
    reference=SURVEY,
    ranges=_dry_range,
    everywhere=True,
)
def coulomb_friction(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    return with_more(robot, target, "coulomb", values["torque_nm"])


_SPEED = Parameter("speed_rad_s", "rad/s", 1e-6, math.inf, 0.1, "speed at which the excess has fallen to 37 %", 0.01)


def _sticking(drive: Drive, what: str, speed: str, more: float, fades: float) -> Drive:
    """The drive with more of ``what``, which fades within a ``speed`` of its own. A drive has one of each kind: two of them (all
    joints share one, and one joint has another) become one that is as large at rest and takes as much over all speeds."""
    has, within = getattr(drive, what), getattr(drive, speed)
    if has and within != fades:
        fades = (has * within + more * fades) / (has + more)
    return altered(drive, **{what: has + more, speed: fades})


def _stribeck_range(robot: Robot, target: str) -> dict[str, Range]:
    speed = scales.speed(robot, target)
    top = DRY_SHARE * scales.torque(robot, target)
    return {"torque_nm": (0.0, top), "speed_rad_s": (0.002 * speed, 0.2 * speed)}


@effect(
    "stribeck_friction",
    family="drive",
    targets=motors,
    parameters=(
        Parameter("torque_nm", "N.m", 0.0, math.inf, 0.0, "friction at rest on top of that when moving", 0.005),
        _SPEED,
    ),
    physics="Lubricant is squeezed out at rest: breaking loose takes more torque than moving on, falling as exp(-speed/scale).",
    signature="Residual torque peaks around zero speed and fades within the scale; slow motions go stick and slip.",
    reference=SURVEY,
    ranges=_stribeck_range,
    plainer="coulomb_friction",
)
def stribeck_friction(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    if values["torque_nm"] == 0:
        return robot
    return robot.map_drive(
        target, lambda d: _sticking(d, "stribeck", "stribeck_speed", values["torque_nm"], values["speed_rad_s"])
    )


@effect(
    "load_friction",
    family="drive",
    targets=motors,
    parameters=(Parameter("share", "1", 0.0, 2.0, 0.0, "friction as a share of the torque through the gear", 0.01),),
    physics="Teeth pressed harder rub harder: friction grows with the torque through the gear, the motor's less the load's. "
    "From a share of 1 on, no load can turn the gear backwards.",
    signature="Residual torque has the sign of speed and the size of the load: nothing unloaded, much when a weight is lifted.",
    reference=SERVOS,
    ranges=always(share=(0.0, 0.8)),
)
def load_friction(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    return robot.map_drive(target, lambda d: altered(d, load_friction=d.load_friction + values["share"]))


@effect(
    "backdrive_friction",
    family="drive",
    targets=motors,
    parameters=(
        Parameter(
            "share", "1", -2.0, 2.0, 0.0, "friction as a share of the external torque, on top of load friction", 0.01
        ),
    ),
    physics="A gear is not equally good both ways: what the load puts in costs a different share than what the motor puts in.",
    signature="Like load friction, but lifting a weight and letting it down disagree with one share; it is seen best where the "
    "load moves the joint.",
    reference=SERVOS,
    ranges=always(share=(-0.8, 0.8)),
)
def backdrive_friction(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    return robot.map_drive(target, lambda d: altered(d, backdrive_friction=d.backdrive_friction + values["share"]))


def _quadratic_range(robot: Robot, target: str) -> dict[str, Range]:
    return {"per_nm": (0.0, 0.5 / scales.torque(robot, target))}


@effect(
    "quadratic_friction",
    family="drive",
    targets=motors,
    parameters=(
        Parameter(
            "per_nm", "1/(N.m)", 0.0, math.inf, 0.0, "friction over the square of the torque through the gear", 0.01
        ),
    ),
    physics="Plastic teeth and shafts bend under load and rub out of line: friction grows with the square of the torque through "
    "the gear.",
    signature="Like load friction, but bent: hardly there at small loads and steep at large ones.",
    reference=SERVOS,
    ranges=_quadratic_range,
)
def quadratic_friction(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    return robot.map_drive(target, lambda d: altered(d, quadratic_friction=d.quadratic_friction + values["per_nm"]))


def _load_stribeck_range(robot: Robot, target: str) -> dict[str, Range]:
    return {"share": (0.0, 0.8), "speed_rad_s": _stribeck_range(robot, target)["speed_rad_s"]}


@effect(
    "load_stribeck_friction",
    family="drive",
    targets=motors,
    parameters=(
        Parameter("share", "1", 0.0, 2.0, 0.0, "friction at rest as a share of the torque through the gear", 0.01),
        _SPEED,
    ),
    physics="Loaded teeth squeeze their lubricant out at rest: breaking loose under load takes more than moving on.",
    signature="Like Stribeck friction, but only where there is load: a held weight sticks, an unloaded joint does not.",
    reference=SERVOS,
    ranges=_load_stribeck_range,
    plainer="load_friction",
)
def load_stribeck_friction(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    if values["share"] == 0:
        return robot
    return robot.map_drive(
        target, lambda d: _sticking(d, "stribeck_load", "stribeck_load_speed", values["share"], values["speed_rad_s"])
    )


def _asymmetry_range(robot: Robot, target: str) -> dict[str, Range]:
    dry, viscous = DRY_SHARE * scales.torque(robot, target), _viscous(robot, target)
    return {"dry_nm": (-dry, dry), "viscous_nm_s_rad": (-viscous, viscous)}


def _own_friction(robot: Robot, target: str) -> dict[str, Range]:
    """Friction of one direction is not below nothing: what differs is a part of what there is."""
    drive = scales.drive_of(robot, target)
    return {"dry_nm": (-drive.coulomb, drive.coulomb), "viscous_nm_s_rad": (-drive.viscous, drive.viscous)}


@effect(
    "friction_asymmetry",
    family="drive",
    targets=motors,
    parameters=(
        Parameter(
            "dry_nm", "N.m", -math.inf, math.inf, 0.0, "dry friction more when moving up, less when moving down", 0.005
        ),
        Parameter("viscous_nm_s_rad", "N.m.s/rad", -math.inf, math.inf, 0.0, "the same for viscous friction", 0.002),
    ),
    physics="Friction differs between the directions of motion: a preloaded screw, brushes or seals set at an angle. Neither "
    "direction falls below zero, so alone it is friction in one direction only.",
    signature="Residual torque against speed has unlike branches: different steps, different slopes. At rest nothing pushes, "
    "unlike an offset.",
    reference="Janot, Gautier and Brunot 2019, Data set and reference models of EMPS",
    ranges=_asymmetry_range,
    within=_own_friction,
    plainer="offset_torque",
)
def friction_asymmetry(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    def sided(drive: Drive) -> Drive:
        return altered(
            drive,
            friction_asymmetry=drive.friction_asymmetry + values["dry_nm"],
            viscous_asymmetry=drive.viscous_asymmetry + values["viscous_nm_s_rad"],
        )

    return robot.map_drive(target, sided)
