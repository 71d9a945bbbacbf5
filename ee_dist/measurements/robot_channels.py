"""What a robot has that a log can fill: its sensors, and for each drive a command of its kind."""

from __future__ import annotations

from ee_dist.basics.quoted import quoted
from ee_dist.measurements.errors import MeasurementError, nearest
from ee_dist.measurements.mapping import Mapping
from ee_dist.robots import ranges
from ee_dist.robots.model import Drive, Robot


def command_kind(drive: Drive) -> str:
    """What a drive obeys: position, speed, torque or none."""
    return drive.command


def command_kinds(robot: Robot) -> set[str]:
    """What its drives obey; passive joints, which obey nothing, do not count."""
    return {command_kind(d) for d in robot.drives} - {"none"}


def command_units(robot: Robot) -> dict[str, str]:
    """The unit of the command of each driven joint; passive joints have none."""
    return {joint: unit for joint, unit in ranges.command_units(robot).items() if unit is not None}


def torque_units(robot: Robot) -> dict[str, str]:
    """The unit of the torque (force) of each driven joint."""
    kinds = {j.name: j.kind for j in robot.joints}
    return {d.joint: "N.m" if kinds[d.joint] == "hinge" else "N" for d in robot.drives}


def check_names(mapping: Mapping, robot: Robot) -> None:
    """Raises MeasurementError where the mapping names sensors or joints that the robot does not have, or leaves some out."""
    where, motors = str(mapping.source), robot.motor_names
    named = {*mapping.sensors, *mapping.commands}
    if named and not named & {*robot.sensor_names, *motors}:
        raise MeasurementError(
            f"{where}: is for another robot: none of its names ({', '.join(sorted(named))}) is one of {robot.name}'s: "
            f"{', '.join((*robot.sensor_names, *motors))}"
        )
    for group, names, allowed in (
        ("sensors", mapping.sensors, robot.sensor_names),
        ("commands", mapping.commands, motors),
        ("torques", mapping.torques, motors),
        ("external", mapping.external, motors),
    ):
        for name in names:
            if name not in allowed:
                raise MeasurementError(
                    f"{where}: {group}: {robot.name} has no {quoted(name)}; {nearest(name, allowed)}"
                )
    missing = [m for m in command_units(robot) if m not in mapping.commands]
    # A log without any command is of use to a balance of forces, which needs torques, of whichever joints.
    if missing and (mapping.commands or not mapping.torques):
        raise MeasurementError(
            f"{where}: commands: no column for joint {quoted(missing[0])} of {robot.name}; a joint that "
            "no motor moves is described by 'command: none' in its drive"
        )
    absent = [s for s in robot.sensor_names if s not in mapping.sensors]
    if absent:
        raise MeasurementError(
            f"{where}: sensors: no column for {quoted(absent[0])} of {robot.name}; add one, or for a speed "
            "'speed_of: <position>', or take the sensor out of the robot's description"
        )
