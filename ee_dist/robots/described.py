"""A body from a file, and what a person says about it, made a robot: drives, sensors, base, floor, time step."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import fields, replace
from typing import Any

from ee_dist.basics.names import did_you_mean, listed
from ee_dist.basics.quoted import quoted
from ee_dist.robots import held
from ee_dist.robots.body import Body
from ee_dist.robots.model import COMMANDS, DRIVE_NUMBERS, Drive, Joint, Part, Robot, RobotError, Sensor, Wiring, World
from ee_dist.robots.moments import refused
from ee_dist.robots.numbers import checked, number
from ee_dist.robots.pivots import PIVOT_HINT, about_centre
from ee_dist.robots.time_step import FINE_S, default_step_s, too_coarse

FIXED = held.KEY
KEYS = (
    "name",
    "free_base",
    "time_step_s",
    "has_floor",
    "start_position_m",
    "gravity_m_s2",
    "inertia_about",
    "velocity_limits",
    FIXED,
    "drives",
    "sensors",
)
SENSOR_KINDS = (
    "touch",
    "angle",
    "position",
    "velocity",
    "torque",
    "motor_torque",
    "height",
    "roll",
    "pitch",
    "x",
    "y",
    "speed_x",
    "turn_rate",
)
UNITS = {
    ("position", "hinge"): "rad",
    ("position", "slide"): "m",
    ("velocity", "hinge"): "rad/s",
    ("velocity", "slide"): "m/s",
    ("torque", "hinge"): "N.m",
    ("torque", "slide"): "N",
    ("motor_torque", "hinge"): "N.m",
    ("motor_torque", "slide"): "N",
}
OF_BASE = {
    "height": "m",
    "x": "m",
    "y": "m",
    "roll": "rad",
    "pitch": "rad",
    "speed_x": "m/s",
    "turn_rate": "rad/s",
}
"""Units of what sensors say of a base that moves."""
ASSUMED = "assumed"
"""Key of a drive: names of those of its numbers that nobody knows; a search puts them right first."""
SCALE, OBEYED = "scale", "obeyed"
"""What ``velocity_limits`` of a file are: a scale for what is measured, or limits that the controllers keep to."""
OF_JOINT = ("angle", *dict.fromkeys(kind for kind, _ in UNITS))
GRAVITY_M_S2 = 9.81


def robot_of_body(body: Body, data: Mapping[str, Any], where: str) -> tuple[Robot, tuple[str, ...]]:
    """The robot and notes for people. ``data`` are the keys of KEYS; what it leaves out is taken from the body.

    Raises RobotError.
    """
    still = data.get(FIXED)
    body = held.held_still(body, still, where)
    data = _without(data, still or {})
    drives = _obeying(_drives(data.get("drives"), body, where), data.get("velocity_limits", SCALE), body, where)
    joints = {j.name: j for j in body.joints}
    driven = [joints[d.joint] for d in drives]
    given = data.get("sensors")
    sensors = body.sensors if given is None and body.sensors else _sensors(given, driven, body, where)
    free = data.get("free_base", bool(body.free_base))
    if not isinstance(free, bool):
        raise RobotError(f"{where}: free_base: expected true or false, not {quoted(free)}")
    if free and body.bolted_only:
        raise RobotError(
            f"{where}: links {listed(body.bolted_only)}: {refused()}; a base that is bolted down (free_base: false) needs none"
        )
    floor = data.get("has_floor", free if body.has_floor is None else body.has_floor)
    if not isinstance(floor, bool):
        raise RobotError(f"{where}: has_floor: expected true or false, not {quoted(floor)}")
    start = data.get("start_position_m", body.start_position_m)
    if not isinstance(start, (list, tuple)) or len(start) != 3:
        raise RobotError(f"{where}: start_position_m: expected three numbers, not {quoted(start)}")
    gravity = GRAVITY_M_S2 if body.gravity_m_s2 is None else body.gravity_m_s2
    step = FINE_S if body.time_step_s is None else body.time_step_s
    notes = _with_hints(body, data.get("inertia_about", "centre"))
    passive = [j.name for j in body.moving if j.name not in {d.joint for d in drives}]
    if passive:
        notes.append(f"joints without a drive swing freely: {', '.join(passive)}")
    limited = [d.joint for d in drives if d.command == "torque" and math.isfinite(d.speed_limit)]
    if limited:
        notes.append(
            f"speed_limit of {listed(limited)}: no torque falls with its speed there: a drive that obeys torques makes up for "
            "back-EMF; a controller that lets a joint go no faster is 'command_speed'"
        )
    if free and body.root_without_mass:
        notes.append(f"the base {quoted(body.parts[0].name)} has no mass in the file: 1 kg is assumed")
    robot = Robot(
        name=str(data.get("name", body.name)),
        parts=_parts(body, data.get("inertia_about", "centre"), where),
        joints=body.joints,
        drives=drives,
        sensors=sensors,
        wiring=Wiring(tuple(range(len(drives)))),
        world=World(gravity_m_s2=number(data.get("gravity_m_s2", gravity), f"{where}: gravity_m_s2"), has_floor=floor),
        free_base=free,
        start_position_m=tuple(number(v, f"{where}: start_position_m") for v in start),  # type: ignore[arg-type]
        start_rotation=body.start_rotation,
        time_step_s=number(data.get("time_step_s", step), f"{where}: time_step_s"),
        assumed=_assumed(data.get("drives"), where),
    )
    robot = checked(robot, where)
    if body.time_step_s is None and "time_step_s" not in data:
        robot = replace(robot, time_step_s=default_step_s(robot))
    if coarse := too_coarse(robot):
        notes.append(coarse)
    return robot, tuple(notes)


def _without(data: Mapping[str, Any], still: Mapping[str, float]) -> Mapping[str, Any]:
    """What a description says, less the drives and sensors of joints that stand still, which may be left in it."""
    drives, sensors = data.get("drives"), data.get("sensors")
    if isinstance(drives, Mapping):
        data = {**data, "drives": {name: entry for name, entry in drives.items() if name not in still}}
    if isinstance(sensors, list):
        kept = [
            s
            for s in sensors
            if not (isinstance(s, Mapping) and s.get("kind") in OF_JOINT and s.get("target") in still)
        ]
        data = {**data, "sensors": kept}
    return data


def _hinged(body: Body) -> tuple[str, ...]:
    """Names of the parts that a hinge carries."""
    carried = {j.child for j in body.joints if j.kind == "hinge"}
    return tuple(p.name for p in body.parts if p.name in carried)


def _with_hints(body: Body, about: Any) -> list[str]:
    """The notes of the file. A hint that was taken need not be given again; one that names a link or two says how to put right
    these alone, for others may be right as they are."""
    taken, many = about == "joint" or isinstance(about, list), len(_hinged(body))
    all_of_them = f", which means all {many} links that hinges carry; 'inertia_about: [LINK, ...]' means those it names"
    hints = [n for n in body.notes if n.startswith(PIVOT_HINT)]
    more = all_of_them if many > 1 else ""
    return [n + more if n in hints else n for n in body.notes if not (taken and n in hints)]


def _parts(body: Body, about: Any, where: str) -> tuple[Part, ...]:
    """The parts; inertias about the joints, of all or some by name that a hinge carries, are brought to their centres."""
    hinged = _hinged(body)
    some = about if isinstance(about, list) else {"centre": [], "joint": hinged}.get(str(about))
    if some is None:
        raise RobotError(
            f"{where}: inertia_about: expected 'centre' (of mass, as URDF means it), 'joint' or a list of links, "
            f"not {quoted(about)}"
        )
    for name in some:
        if name not in hinged:
            raise RobotError(
                f"{where}: inertia_about: no link named {quoted(name)} that a hinge carries; {near(str(name), hinged)}"
            )
    return tuple(about_centre(p, where) if p.name in some else p for p in body.parts)


def _drives(data: Any, body: Body, where: str) -> tuple[Drive, ...]:
    """Drives of the joints that the description or the file itself gives one, in the order of the joints."""
    given = {} if data is None else data
    if not isinstance(given, Mapping):
        raise RobotError(f"{where}: drives: expected 'joint: {{kp: ...}}', not {quoted(data)}")
    moving = tuple(j.name for j in body.moving)
    known = ("command", *DRIVE_NUMBERS, ASSUMED)
    for name, entry in given.items():
        here = f"{where}: drives: {name}"
        if name not in moving:
            raise RobotError(f"{where}: drives: no moving joint named {quoted(name)}; {near(str(name), moving)}")
        if not isinstance(entry, Mapping):
            raise RobotError(f"{here}: expected at least 'kp' (torque per position error) or 'command: torque'")
        for key in entry:
            if key not in known:
                raise RobotError(f"{here}: unknown key {quoted(key)}; {near(str(key), known)}")
        if entry.get("command", "position") not in COMMANDS:
            raise RobotError(f"{here}: command: {quoted(entry['command'])}; expected one of {', '.join(COMMANDS)}")
    return tuple(
        _drive(name, given.get(name) or {}, body.drives.get(name, {}), where)
        for name in moving
        if name in given or name in body.driven
    )


def _assumed(drives: Mapping[str, Mapping[str, Any]] | None, where: str) -> tuple[tuple[str, str], ...]:
    """(joint, field) of what the description marks as assumed."""
    found = []
    for joint, entry in (drives or {}).items():
        names = entry.get(ASSUMED, [])
        if not isinstance(names, list):
            raise RobotError(
                f"{where}: drives: {joint}: {ASSUMED}: expected a list such as [kp, kd], not {quoted(names)}"
            )
        found += [(joint, str(name)) for name in names]
    return tuple(found)


def _obeying(drives: tuple[Drive, ...], asked: Any, body: Body, where: str) -> tuple[Drive, ...]:
    """The drives; their controllers with the velocity limits of the file, if that is asked for."""
    if asked not in (SCALE, OBEYED):
        raise RobotError(
            f"{where}: velocity_limits: expected '{SCALE}' (for what is measured) or '{OBEYED}' (by the controllers), "
            f"not {quoted(asked)}"
        )
    if asked == SCALE:
        return drives
    tops = {j.name: j.top_speed for j in body.joints}
    if not any(math.isfinite(tops[d.joint]) for d in drives):
        raise RobotError(f"{where}: velocity_limits: {OBEYED}: the file states none; give drives a 'command_speed'")
    return tuple(replace(d, command_speed=min(d.command_speed, tops[d.joint])) for d in drives)


def _drive(name: str, entry: Mapping[str, Any], found: Mapping[str, float | str], where: str) -> Drive:
    here = f"{where}: drives: {name}"
    numbers: dict[str, Any] = {k: v for k, v in found.items() if k != "command"}
    numbers |= {str(k): number(v, f"{here}: {k}") for k, v in entry.items() if k not in ("command", ASSUMED)}
    command = str(entry.get("command", found.get("command", "position")))
    if command in ("position", "speed") and "kp" not in numbers:
        raise RobotError(f"{here}: expected at least 'kp' (torque per {command} error), or 'command: torque'")
    for only in ("command_acceleration", "command_duration", "feed_forward"):
        if command != "position" and only in numbers:
            raise RobotError(f"{here}: {only} is of controllers of positions, and this one's command is {command}")
    if "torque_limit" not in numbers:
        if command != "none":
            raise RobotError(f"{here}: no torque_limit, and the file gives no effort limit")
        numbers["torque_limit"] = float("inf")
    return Drive(
        joint=name, command=command, **({"kp": 0.0, "ki": 0.0, "kd": 0.0, "speed_limit": float("inf")} | numbers)
    )


OF_JOINTS = "joints"
"""In a list of sensors: position and velocity of every driven joint, as where no list is given."""


def _sensors(data: Any, driven: list[Joint], body: Body, where: str) -> tuple[Sensor, ...]:
    usual = [
        Sensor(f"{kind}_{j.name}", kind, j.name, UNITS[kind, j.kind])
        for kind in ("position", "velocity")
        for j in driven
    ]
    if data is None:
        return tuple(usual)
    if not isinstance(data, list):
        raise RobotError(f"{where}: sensors: expected a list of {{name, kind, target}}, not {quoted(data)}")
    known = tuple(f.name for f in fields(Sensor))
    joints = {j.name: j for j in driven}
    parts = tuple(p.name for p in body.parts)
    sensors: list[Sensor] = []
    for i, entry in enumerate(data):
        here = f"{where}: sensors[{i}]"
        if entry == OF_JOINTS:
            sensors += usual
            continue
        if not isinstance(entry, Mapping) or not {"name", "kind"} <= set(entry):
            raise RobotError(
                f"{here}: expected {{name, kind, target}}, or {OF_JOINTS} for those of every joint, not {quoted(entry)}"
            )
        for key in entry:
            if key not in known:
                raise RobotError(f"{here}: unknown key {quoted(key)}; {near(str(key), known)}")
        kind, target = str(entry["kind"]), str(entry.get("target", ""))
        if kind not in SENSOR_KINDS:
            raise RobotError(f"{here}: no sensor kind {quoted(kind)}; {near(kind, SENSOR_KINDS)}")
        allowed = parts if kind == "touch" else tuple(joints) if kind in OF_JOINT else None
        if allowed is not None and target not in allowed:
            what = "part" if kind == "touch" else "driven joint"
            raise RobotError(f"{here}: no {what} named {quoted(target)}; {near(target, allowed)}")
        common = OF_BASE.get(kind) or UNITS.get((kind, joints[target].kind if target in joints else ""), "1")
        unit = str(entry.get("unit", common))
        numbers = {
            str(k): number(v, f"{here}: {k}") for k, v in entry.items() if k not in ("name", "kind", "target", "unit")
        }
        sensors.append(replace(Sensor(str(entry["name"]), kind, target, unit), **numbers))  # type: ignore[arg-type]
    return tuple(sensors)


def near(name: str, allowed: tuple[str, ...]) -> str:
    """The nearest names, or all, as the end of a message."""
    return did_you_mean(name, allowed)
