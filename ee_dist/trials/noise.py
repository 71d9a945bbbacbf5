"""How wide a channel's range is, and a robot whose sensors are as noisy as their data sheet says."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, TypeVar, cast

from ee_dist.robots.model import Robot, Sensor
from ee_dist.robots.ranges import drive_of, span, top_speed, top_torque
from ee_dist.robots.system import System

BODY_RANGE = {"roll": 1.0, "pitch": 1.0, "height": 0.25, "x": 2.0, "y": 2.0, "speed_x": 1.0, "turn_rate": 4.0}
"""Full range of channels of the body: rad, rad, m, m, m, m/s, rad/s. Typical of small inertial units and range finders."""
SCALED = {"touch": 2.0, "angle": 2.0, "expression": 1.0}
"""Full range of channels that are shares of their own full scale."""
Model = TypeVar("Model", bound=System)


def channel_range(robot: System, sensor: Sensor) -> float:
    """Full range of a channel in its own unit, always finite: of the joint, of its drive, or of the instrument.

    Where a description leaves it open it is an assumption; see ``robots/ranges.py``.
    """
    if sensor.kind in SCALED:
        return SCALED[sensor.kind]
    if sensor.kind in BODY_RANGE:
        return BODY_RANGE[sensor.kind]
    assert isinstance(robot, Robot), "the other kinds of channels are of joints"
    joint = robot.joint(sensor.target)
    if sensor.kind == "position":
        low, high = span(joint)
        return high - low
    drive = drive_of(robot, sensor.target)
    return 2.0 * (top_speed(joint, drive) if sensor.kind == "velocity" else top_torque(robot, drive))


def with_noise(robot: Model, share: float) -> Model:
    """The robot with sensor noise of ``share`` (1 standard deviation) of each channel's range."""
    if share == 0.0:
        return robot
    noisy = tuple(replace(s, noise=share * channel_range(robot, s)) for s in robot.sensors)
    return cast(Model, replace(cast(Any, robot), sensors=noisy))
