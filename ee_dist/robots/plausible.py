"""Bounds on what a description of a robot may say: nothing there is in the world lies outside of them.

A negative gain drives a joint away from where it is sent, a noise that is no number makes every log so: such a file is a
mistake, and is said to be one instead of being simulated.
"""

from __future__ import annotations

import math
from typing import Any

from ee_dist.robots.model import Robot, RobotError

MOST = 1000
"""Parts, joints, drives or sensors of one robot."""
_ENDLESS = math.inf
_PART = {"mass_kg": (0.0, 1e6)}
_DRIVE = {
    **dict.fromkeys(("kp", "ki", "kd"), (0.0, 1e9)),
    **dict.fromkeys(("torque_limit", "speed_limit"), (0.0, _ENDLESS)),
    **dict.fromkeys(("rotor_inertia", "viscous", "coulomb", "stribeck", "quadratic_friction", "brake"), (0.0, 1e9)),
    **dict.fromkeys(("backlash", "deadband", "compliance", "supply_nominal_v"), (0.0, 1e6)),
    "delay_s": (0.0, 10.0),
}
_SENSOR = {
    "gain": (-1e9, 1e9), "bias": (-1e9, 1e9), "noise": (0.0, 1e9), "quantum": (0.0, 1e9), "delay_s": (0.0, 10.0),
    "stuck": (0.0, 1.0), "dropout": (0.0, 1.0), "missed_touch": (0.0, 1e6),
}  # fmt: skip
_WORLD = {"gravity_m_s2": (-1e4, 1e4), "friction": (0.0, 1e6), "compliance_m_n": (0.0, 1e6), "drag_n_s_m": (0.0, 1e9)}
_STEP_S = (1e-6, 1.0)


def checked(robot: Robot) -> Robot:
    """The robot. Raises RobotError for the first number that cannot be, with its place and what would be right."""
    for what, items in (("parts", robot.parts), ("joints", robot.joints), ("drives", robot.drives),
                        ("sensors", robot.sensors)):  # fmt: skip
        if len(items) > MOST:
            raise RobotError(f"robot.{what}: {len(items)} of them; a robot may have {MOST}")
    for part in robot.parts:
        _within(f"robot, part {part.name!r}", part, _PART)
    for drive in robot.drives:
        _within(f"robot, drive of {drive.joint!r}", drive, _DRIVE)
    for sensor in robot.sensors:
        _within(f"robot, sensor {sensor.name!r}", sensor, _SENSOR)
    _within("robot, world", robot.world, _WORLD)
    _within("robot", robot, {"time_step_s": _STEP_S})
    return robot


def _within(where: str, item: Any, bounds: dict[str, tuple[float, float]]) -> None:
    for name, (low, high) in bounds.items():
        value = getattr(item, name)
        if not low <= value <= high:
            raise RobotError(f"{where}: {name} is {value:g}; it must be from {low:g} to {high:g}")
