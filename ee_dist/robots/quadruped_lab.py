"""The quadruped on the bench: the paper's body, instrumented as an engineer would to find out what its model misses.

Eight joint positions (rad) and eight drive torques (N.m) from the servos, four touch sensors, and the body's roll and
pitch (rad, inertial unit) and height (m, range finder). The paper's eight sensors leave the knees and all loads unseen.
"""

from __future__ import annotations

from dataclasses import replace

from ee_dist.robots.model import Robot, Sensor
from ee_dist.robots.quadruped import LEGS, quadruped


def quadruped_lab() -> Robot:
    """``quadruped()`` with 23 channels instead of 8."""
    robot = quadruped()
    sensors = [Sensor(f"touch_{leg}", "touch", f"lower_{leg}") for leg in LEGS]
    sensors += [Sensor(f"position_{j}", "position", j, "rad") for j in robot.motor_names]
    sensors += [Sensor(f"torque_{j}", "torque", j, "N.m") for j in robot.motor_names]
    sensors += [Sensor("roll", "roll", "body", "rad"), Sensor("pitch", "pitch", "body", "rad")]
    sensors += [Sensor("height", "height", "body", "m")]
    return replace(robot, name="quadruped_lab", sensors=tuple(sensors))
