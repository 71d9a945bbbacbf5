"""Every number of a robot is looked at once: finite, of the right sign, of a size that something real can have."""

from __future__ import annotations

import math
from typing import Any

from ee_dist.basics.names import did_you_mean
from ee_dist.basics.quoted import quoted
from ee_dist.robots.model import COMMANDS, DRIVE_NUMBERS, Robot, RobotError

Bounds = tuple[float, float]
HUGE = 1e9
MOST = 1000
"""Parts, and sensors: far beyond any robot, and some seconds of work."""
AT_LEAST_0: Bounds = (0.0, HUGE)
ANY: Bounds = (-HUGE, HUGE)
DRIVE: dict[str, Bounds] = dict.fromkeys(DRIVE_NUMBERS, AT_LEAST_0) | {
    "torque_limit": (1e-12, math.inf),
    "speed_limit": (1e-12, math.inf),
    "command_speed": (1e-12, math.inf),
    "command_acceleration": (1e-12, math.inf),
    "command_duration": (0.0, 60.0),
    "current_gain": (1e-3, 1e3),
    "strength": (0.0, 100.0),
    "command_gain": (-100.0, 100.0),
    "zero_offset": ANY,
    "delay_s": (0.0, 2.0),
    "back_emf": ANY,
    "stribeck_speed": (1e-12, HUGE),
    "stribeck_load": (0.0, 10.0),
    "stribeck_load_speed": (0.0, HUGE),
    "load_friction": (0.0, 10.0),
    "backdrive_friction": (-10.0, 10.0),
    "friction_asymmetry": ANY,
    "viscous_asymmetry": ANY,
    "offset_torque": ANY,
    "spring_rest": ANY,
    "feed_forward": (0.0, 10.0),
    "torque_read_late_s": (-2.0, 2.0),
}
SENSOR: dict[str, Bounds] = {
    "gain": (-1e6, 1e6),
    "bias": ANY,
    "noise": AT_LEAST_0,
    "delay_s": (0.0, 2.0),
    "quantum": AT_LEAST_0,
    "stuck": (0.0, 1.0),
    "stuck_from_s": AT_LEAST_0,
    "dropout": (0.0, 1.0),
    "missed_touch": (0.0, 10.0),
}
WORLD: dict[str, Bounds] = {
    "gravity_m_s2": (-1e3, 1e3),
    "friction": (0.0, 100.0),
    "compliance_m_n": (0.0, 1e3),
    "supply_sag": (0.0, 1.0),
} | dict.fromkeys(("tilt_x_rad", "tilt_y_rad", "push_x_n", "push_y_n", "drag_n_s_m"), ANY)
LONGEST_STEP_S = 0.1


def number(value: Any, where: str) -> float:
    """A number, also as YAML has it for 1e-3, which it takes for a text. Raises RobotError."""
    if isinstance(value, str):
        try:
            value = float(value)
        except ValueError:
            raise RobotError(f"{where}: expected a number, not {quoted(value)}") from None
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise RobotError(f"{where}: expected a number, not {quoted(value)}")
    try:
        return float(value)
    except OverflowError:
        raise RobotError(
            f"{where}: expected a number of at most {HUGE:g}, not one of {len(str(value))} digits"
        ) from None


def checked(robot: Robot, where: str) -> Robot:
    """The robot, if each of its numbers can be and its parts hang together. Raises RobotError for the first that cannot."""
    if not 0 < robot.time_step_s <= LONGEST_STEP_S:
        raise RobotError(
            f"{where}: time_step_s: {robot.time_step_s:g} s; expected more than 0 and at most {LONGEST_STEP_S:g} "
            "(seconds, not milliseconds)"
        )
    for what, items in (("parts", robot.parts), ("sensors", robot.sensors)):
        if len(items) > MOST:
            raise RobotError(f"{where}: {len(items)} {what}; at most {MOST} can be simulated in a sensible time")
    for p in robot.parts:
        _within(p.mass_kg, AT_LEAST_0, f"{where}: part {quoted(p.name)}: mass_kg")
        for what, values in (("com_m", p.com_m), ("inertia_kg_m2", p.inertia_kg_m2)):
            for v in values:
                _within(v, ANY, f"{where}: part {quoted(p.name)}: {what}")
    for j in robot.joints:
        here = f"{where}: joint {quoted(j.name)}"
        for v in (*j.position_m, *j.axis, *j.rotation):
            _within(v, ANY, f"{here}: place or axis")
        if j.kind != "fixed" and not (j.lower < j.upper and any(j.axis)):
            raise RobotError(f"{here}: limits {j.lower:g} to {j.upper:g} and axis {j.axis}: nothing can move there")
        _within(j.freedom, (0.0, 1.0), f"{here}: freedom")
        _within(j.top_speed, (1e-12, math.inf), f"{here}: top_speed")
        _within(j.lag_s, (0.0, 1e3), f"{here}: lag_s")
        _within(j.start, ANY, f"{here}: start")
    for d in robot.drives:
        here = f"{where}: drives: {d.joint}"
        if d.command not in COMMANDS:
            raise RobotError(f"{here}: command: {quoted(d.command)}; expected one of {', '.join(COMMANDS)}")
        for name, bounds in DRIVE.items():
            _within(getattr(d, name), bounds, f"{here}: {name}")
    for joint, name in robot.assumed:
        here = f"{where}: drives: {joint}: assumed"
        if joint not in robot.motor_names:
            raise RobotError(f"{here}: no drive of that name; {did_you_mean(joint, robot.motor_names)}")
        if name not in ("command", *DRIVE_NUMBERS):
            raise RobotError(f"{here}: unknown key {quoted(name)}; {did_you_mean(name, DRIVE_NUMBERS)}")
    for s in robot.sensors:
        for name, bounds in SENSOR.items():
            _within(getattr(s, name), bounds, f"{where}: sensors: {s.name}: {name}")
    for name, bounds in WORLD.items():
        _within(getattr(robot.world, name), bounds, f"{where}: {name}")
    for v in (*robot.start_position_m, *robot.start_rotation):
        _within(v, ANY, f"{where}: start position")
    _connected(robot, where)
    return robot


def _within(value: float, bounds: Bounds, where: str) -> None:
    low, high = bounds
    if not low <= value <= high:
        most = "" if math.isinf(high) else f" to {high:g}"
        least = "more than 0" if 0 < low < 1e-6 else f"{low:g}"
        raise RobotError(f"{where}: {value:g}; expected {least}{most or ' or more'}")


def _connected(robot: Robot, where: str) -> None:
    """One tree from the root, each name once."""
    if not robot.parts:
        raise RobotError(f"{where}: no part in it")
    for what, names in (
        ("parts", [p.name for p in robot.parts]),
        ("joints", [j.name for j in robot.joints]),
        ("drives", list(robot.motor_names)),
        ("sensors", list(robot.sensor_names)),
    ):
        for name in names:
            if names.count(name) > 1:
                raise RobotError(f"{where}: {what}: two are named {quoted(name)}")
    parts = {p.name for p in robot.parts}
    children = [j.child for j in robot.joints]
    for j in robot.joints:
        for end in (j.parent, j.child):
            if end not in parts:
                raise RobotError(f"{where}: joint {quoted(j.name)}: no part named {quoted(end)}")
        if children.count(j.child) > 1:
            raise RobotError(f"{where}: part {quoted(j.child)} hangs on two joints")
    reached = set(robot.subtree(robot.root.name)) if robot.root.name not in children else set()
    if reached != parts:
        lost = next(p.name for p in robot.parts if p.name not in reached)
        raise RobotError(
            f"{where}: part {quoted(lost)} does not hang on the root {quoted(robot.root.name)}: the joints form a loop"
        )
    moving = {j.name for j in robot.joints if j.kind != "fixed"}
    for d in robot.drives:
        if d.joint not in moving:
            raise RobotError(f"{where}: drives: no moving joint named {quoted(d.joint)}")
    _within(robot.wiring.early_s, (0.0, 2.0), f"{where}: wiring: early_s")
    if len(robot.wiring.source) != len(robot.drives) or any(
        not 0 <= k < len(robot.drives) for k in robot.wiring.source
    ):
        raise RobotError(f"{where}: wiring: {robot.wiring.source}; expected the place of an output for each drive")
