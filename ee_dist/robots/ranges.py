"""How far, fast and hard a joint goes: finite numbers for scales, whatever a description leaves open.

Where nothing is stated they are assumptions: half the range in a quarter of a second, ten times the inertia as torque.
"""

from __future__ import annotations

import math

from ee_dist.basics.names import listed
from ee_dist.basics.quoted import quoted
from ee_dist.robots.inertia import felt_inertia
from ee_dist.robots.model import Drive, Joint, Robot, RobotError

WIDEST = 4 * math.pi
"""What a hinge that turns on and on counts as at most, rad,"""
ROUNDED = 1e-3
"""and by what share a file may round it up: two turns are often entered as 6.28319 to each side."""
FULL_M = 2.0
"""What a slide without ends counts as, m."""


def drive_of(robot: Robot, joint: str) -> Drive:
    """The drive of a joint. Raises RobotError."""
    for d in robot.drives:
        if d.joint == joint:
            return d
    raise RobotError(f"no drive named {quoted(joint)}; there are: {listed(robot.motor_names)}")


def span(joint: Joint) -> tuple[float, float]:
    """(lowest, highest) position that a command or a scale reckons with, rad (m)."""
    most = WIDEST if joint.kind == "hinge" else math.inf
    if joint.upper - joint.lower <= most * (1 + ROUNDED) and math.isfinite(joint.upper - joint.lower):
        return joint.lower, joint.upper
    half = WIDEST / 4 if joint.kind == "hinge" else FULL_M / 2
    middle = (joint.lower + joint.upper) / 2
    middle = middle if math.isfinite(middle) else 0.0
    return middle - half, middle + half


def travel(joint: Joint) -> float:
    """Half the range of a joint, at most 1 rad of a hinge; rad (m)."""
    low, high = span(joint)
    return min((high - low) / 2, 1.0) if joint.kind == "hinge" else (high - low) / 2


def top_speed(joint: Joint, drive: Drive | None = None) -> float:
    """Speed of the drive without load, or that stated for the joint, or half its range in a quarter of a second; rad/s (m/s)."""
    for known in (drive.speed_limit if drive is not None else math.inf, joint.top_speed):
        if 0 < known < math.inf:
            return known
    return 4.0 * travel(joint)


def top_torque(robot: Robot, drive: Drive) -> float:
    """The torque limit, or what the controller asks at half the range, or ten times the inertia in rad/s^2; N.m (N)."""
    for known in (drive.torque_limit, drive.kp * travel(robot.joint(drive.joint))):
        if 0 < known < math.inf:
            return known
    return 10.0 * float(felt_inertia(robot)[robot.motor_names.index(drive.joint)])


def command_span(robot: Robot, drive: Drive) -> tuple[float, float]:
    """(lowest, highest) command that makes sense for a drive, in the unit of its commands. (0, 0) of a passive joint."""
    joint = robot.joint(drive.joint)
    if drive.command == "position":
        return span(joint)
    if drive.command == "none":
        return 0.0, 0.0
    most = top_speed(joint, drive) if drive.command == "speed" else top_torque(robot, drive)
    return -most, most


def command_unit(robot: Robot, drive: Drive) -> str | None:
    """The unit that a command of this drive has; None for a passive joint, which takes none."""
    return _UNITS.get((drive.command, robot.joint(drive.joint).kind))


def command_units(robot: Robot) -> dict[str, str | None]:
    """``command_unit`` of every drive, by joint."""
    return {d.joint: command_unit(robot, d) for d in robot.drives}


def unit_at(robot: Robot, joint: str) -> str:
    """The unit of the commands of a joint; empty where it takes none."""
    return command_units(robot).get(joint) or ""


_UNITS = {
    ("position", "hinge"): "rad",
    ("position", "slide"): "m",
    ("speed", "hinge"): "rad/s",
    ("speed", "slide"): "m/s",
    ("torque", "hinge"): "N.m",
    ("torque", "slide"): "N",
}
