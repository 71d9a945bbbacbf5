"""Instruments beside those that a robot has: a meter of each motor's current, read as the torque that it stands for."""

from __future__ import annotations

from dataclasses import replace

from ee_dist.robots.model import Robot, Sensor

MOTOR_TORQUE = "motor_torque"
"""Kind of a sensor that shows what the motor gave, before friction and all else that comes after it."""


def with_motor_torques(robot: Robot) -> Robot:
    """The robot with a sensor ``motor_torque_JOINT`` (N.m; N of a slide), after its own, for each motor that has none yet."""
    known = {s.target for s in robot.sensors if s.kind == MOTOR_TORQUE}
    added = tuple(
        Sensor(f"{MOTOR_TORQUE}_{d.joint}", MOTOR_TORQUE, d.joint, "N" if _slides(robot, d.joint) else "N.m")
        for d in robot.drives
        if d.command != "none" and d.joint not in known
    )
    return replace(robot, sensors=(*robot.sensors, *added))


def _slides(robot: Robot, joint: str) -> bool:
    return bool(robot.joint(joint).kind == "slide")


def torque_delays(robot: Robot) -> tuple[float, ...]:
    """s, by sensor: how old its reading is beyond its own delay, since its motor's torque is read late. A simulation reads
    nothing ahead of time: where it is the positions that are late (below zero), which no torque tells, all is read at once."""
    late = {d.joint: max(d.torque_read_late_s, 0.0) for d in robot.drives}
    return tuple(late[s.target] if s.kind == MOTOR_TORQUE else 0.0 for s in robot.sensors)


def measures_torques(robot: Robot) -> bool:
    """Whether some sensor of the robot says how large a torque is, a joint's or a motor's."""
    return any(s.kind in ("torque", MOTOR_TORQUE) for s in robot.sensors)
