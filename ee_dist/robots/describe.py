"""Robots by name, by URDF or by a short description in YAML: the way in for a user's own robot.

A description is either one of ours with its numbers changed ::

    robot: servo_pendulum
    gain: 100

or a URDF with what a URDF cannot say ::

    urdf: arm.urdf              # beside this file
    free_base: false            # bolted to the world (default), or free to move
    time_step_s: 0.002
    has_floor: false
    drives:                     # joint: any field of a drive; unnamed joints swing freely
      shoulder: {kp: 40, kd: 1, torque_limit: 12}
    sensors:                    # left out: position and velocity of every driven joint
      - {name: shoulder_angle, kind: position, target: shoulder}
"""

from __future__ import annotations

import difflib
import inspect
from collections.abc import Callable, Mapping
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

from ee_dist.robots.linear_stage import linear_stage
from ee_dist.robots.model import Drive, Joint, Robot, RobotError, Sensor, Wiring, World
from ee_dist.robots.plausible import checked
from ee_dist.robots.quadruped import quadruped
from ee_dist.robots.quadruped_lab import quadruped_lab
from ee_dist.robots.serial import robot_from_dict
from ee_dist.robots.servo_pendulum import servo_pendulum
from ee_dist.robots.untrusted import UntrustedError, yaml_of
from ee_dist.robots.urdf import UrdfBody, read_urdf

BUILT_IN: dict[str, Callable[..., Robot]] = {
    "quadruped": quadruped,
    "quadruped_lab": quadruped_lab,
    "servo_pendulum": servo_pendulum,
    "linear_stage": linear_stage,
}
_URDF_KEYS = (
    "urdf",
    "name",
    "free_base",
    "time_step_s",
    "has_floor",
    "start_position_m",
    "gravity_m_s2",
    "drives",
    "sensors",
)
_KINDS = (
    "touch",
    "angle",
    "position",
    "velocity",
    "torque",
    "height",
    "roll",
    "pitch",
    "x",
    "y",
    "speed_x",
    "turn_rate",
)
_UNITS = {
    ("position", "hinge"): "rad",
    ("position", "slide"): "m",
    ("velocity", "hinge"): "rad/s",
    ("velocity", "slide"): "m/s",
    ("torque", "hinge"): "N.m",
    ("torque", "slide"): "N",
}


def load_robot(source: str | Path | Mapping[str, Any], folder: str | Path = ".") -> tuple[Robot, tuple[str, ...]]:
    """The robot, and notes for people about what was left out. Relative paths are looked up in ``folder``.

    ``source`` is a name, a ``.urdf``, a ``.yaml`` description, or the mapping that such a file holds. Raises RobotError.
    """
    if isinstance(source, Mapping):
        return _described(source, Path(folder), "robot")
    text = str(source)
    if text in BUILT_IN:
        return BUILT_IN[text](), ()
    path = Path(folder) / text
    if path.suffix.lower() in (".urdf", ".xml"):
        return _described({"urdf": str(path)}, Path("."), str(path))
    if path.suffix.lower() in (".yaml", ".yml", ".json"):
        return _described(_yaml(path), path.parent, str(path))
    raise RobotError(f"no robot named {text!r}; there are: {', '.join(BUILT_IN)}, or a file (.urdf, .yaml)")


def _yaml(path: Path) -> Mapping[str, Any]:
    try:
        found = yaml_of(path)
    except FileNotFoundError:
        raise RobotError(f"{path}: no such file; expected the description of a robot") from None
    except UntrustedError as error:
        raise RobotError(f"{path}: {error}") from None
    except OSError as error:
        raise RobotError(f"{path}: cannot be read ({error.strerror})") from None
    if not isinstance(found, Mapping):
        raise RobotError(f"{path}: expected a mapping with 'robot' or 'urdf'")
    return found


def _described(data: Mapping[str, Any], folder: Path, where: str) -> tuple[Robot, tuple[str, ...]]:
    if "version" in data:
        return checked(robot_from_dict(data)), ()
    if "urdf" in data:
        return _of_urdf(data, folder, where)
    name = str(data.get("robot", ""))
    if name not in BUILT_IN:
        raise RobotError(f"{where}: no robot named {name!r}; {_near(name, tuple(BUILT_IN))}, or give 'urdf'")
    make = BUILT_IN[name]
    allowed = tuple(inspect.signature(make).parameters)
    numbers = {str(k): v for k, v in data.items() if k != "robot"}
    for key, value in numbers.items():
        if key not in allowed:
            raise RobotError(f"{where}: {name} has no {key!r}; {_near(key, allowed)}")
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise RobotError(f"{where}: {key}: expected a number, not {value!r}")
    return checked(make(**numbers)), ()


def _of_urdf(data: Mapping[str, Any], folder: Path, where: str) -> tuple[Robot, tuple[str, ...]]:
    for key in data:
        if key not in _URDF_KEYS:
            raise RobotError(f"{where}: unknown key {key!r}; {_near(str(key), _URDF_KEYS)}")
    body = read_urdf(folder / str(data["urdf"]))
    drives = _drives(data.get("drives") or {}, body, where)
    joints = {j.name: j for j in body.joints}
    sensors = _sensors(data.get("sensors"), [joints[d.joint] for d in drives], body, where)
    free = data.get("free_base", False)
    if not isinstance(free, bool):
        raise RobotError(f"{where}: free_base: expected true or false, not {free!r}")
    start = data.get("start_position_m", (0.0, 0.0, 0.0))
    if not isinstance(start, (list, tuple)) or len(start) != 3:
        raise RobotError(f"{where}: start_position_m: expected three numbers, not {start!r}")
    notes = list(body.notes)
    passive = [j.name for j in body.joints if j.kind != "fixed" and j.name not in {d.joint for d in drives}]
    if passive:
        notes.append(f"joints without a drive swing freely: {', '.join(passive)}")
    step = _number(data.get("time_step_s", 0.002), f"{where}: time_step_s")
    if not 0 < step <= 0.1:
        raise RobotError(
            f"{where}: time_step_s: {step:g} s; expected more than 0 and at most 0.1 (seconds, not milliseconds)"
        )
    robot = Robot(
        name=str(data.get("name", body.name)),
        parts=body.parts,
        joints=body.joints,
        drives=drives,
        sensors=sensors,
        wiring=Wiring(tuple(range(len(drives)))),
        world=World(
            gravity_m_s2=_number(data.get("gravity_m_s2", 9.81), f"{where}: gravity_m_s2"),
            has_floor=bool(data.get("has_floor", free)),
        ),
        free_base=free,
        start_position_m=tuple(_number(v, f"{where}: start_position_m") for v in start),  # type: ignore[arg-type]
        time_step_s=step,
    )
    return checked(robot), tuple(notes)


def _drives(data: Any, body: UrdfBody, where: str) -> tuple[Drive, ...]:
    if not isinstance(data, Mapping):
        raise RobotError(f"{where}: drives: expected 'joint: {{kp: ...}}', not {data!r}")
    moving = tuple(j.name for j in body.joints if j.kind != "fixed")
    known = tuple(f.name for f in fields(Drive) if f.name != "joint")
    for name, entry in data.items():
        if name not in moving:
            raise RobotError(f"{where}: drives: no moving joint named {name!r}; {_near(str(name), moving)}")
        if not isinstance(entry, Mapping) or "kp" not in entry:
            raise RobotError(f"{where}: drives: {name}: expected at least 'kp' (torque per position error)")
        for key in entry:
            if key not in known:
                raise RobotError(f"{where}: drives: {name}: unknown key {key!r}; {_near(str(key), known)}")
    drives = []
    for name in moving:
        if name not in data:
            continue
        own = {str(k): _number(v, f"{where}: drives: {name}: {k}") for k, v in data[name].items()}
        given = {
            "ki": 0.0,
            "kd": 0.0,
            "torque_limit": body.effort.get(name, 0.0),
            "speed_limit": float("inf"),
            "viscous": body.damping.get(name, 0.0),
            "coulomb": body.friction.get(name, 0.0),
        } | own
        if given["torque_limit"] <= 0:
            raise RobotError(f"{where}: drives: {name}: no torque_limit, and the URDF gives no effort limit")
        drives.append(Drive(joint=name, **given))
    return tuple(drives)


def _sensors(data: Any, driven: list[Joint], body: UrdfBody, where: str) -> tuple[Sensor, ...]:
    if data is None:
        return tuple(
            Sensor(f"{kind}_{j.name}", kind, j.name, _UNITS[kind, j.kind])
            for kind in ("position", "velocity")
            for j in driven
        )
    if not isinstance(data, list):
        raise RobotError(f"{where}: sensors: expected a list of {{name, kind, target}}, not {data!r}")
    known = tuple(f.name for f in fields(Sensor))
    joints = {j.name: j for j in driven}
    parts = tuple(p.name for p in body.parts)
    sensors: list[Sensor] = []
    for i, entry in enumerate(data):
        here = f"{where}: sensors[{i}]"
        if not isinstance(entry, Mapping) or not {"name", "kind"} <= set(entry):
            raise RobotError(f"{here}: expected {{name, kind, target}}, not {entry!r}")
        for key in entry:
            if key not in known:
                raise RobotError(f"{here}: unknown key {key!r}; {_near(str(key), known)}")
        kind, target = str(entry["kind"]), str(entry.get("target", ""))
        if kind not in _KINDS:
            raise RobotError(f"{here}: no sensor kind {kind!r}; {_near(kind, _KINDS)}")
        allowed = (
            parts if kind == "touch" else tuple(joints) if kind in ("angle", "position", "velocity", "torque") else None
        )
        if allowed is not None and target not in allowed:
            what = "part" if kind == "touch" else "driven joint"
            raise RobotError(f"{here}: no {what} named {target!r}; {_near(target, allowed)}")
        unit = str(entry.get("unit", _UNITS.get((kind, joints[target].kind if target in joints else ""), "1")))
        numbers = {
            str(k): _number(v, f"{here}: {k}") for k, v in entry.items() if k not in ("name", "kind", "target", "unit")
        }
        sensors.append(replace(Sensor(str(entry["name"]), kind, target, unit), **numbers))  # type: ignore[arg-type]
    names = [s.name for s in sensors]
    for name in names:
        if names.count(name) > 1:
            raise RobotError(f"{where}: sensors: two are named {name!r}")
    return tuple(sensors)


def _number(value: Any, where: str) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise RobotError(f"{where}: expected a number, not {value!r}")
    return float(value)


def _near(name: str, allowed: tuple[str, ...]) -> str:
    near = difflib.get_close_matches(name, allowed, n=3, cutoff=0.4)
    return f"did you mean {' or '.join(near)}?" if near else f"there are: {', '.join(allowed)}"


def robot_of(name: str, urdf: str | None = None, drives: str | None = None) -> tuple[Robot, tuple[str, ...]]:
    """The robot of three settings: a name or file; or ``urdf`` with the description ``drives`` that goes with it.

    Raises RobotError.
    """
    if name != "urdf":
        return load_robot(name)
    if drives is None:
        if urdf is None:
            raise RobotError("robot=urdf needs robot.urdf=FILE.urdf, or robot.drives=FILE.yaml that names one")
        return load_robot(urdf)
    path = Path(drives)
    data = dict(_yaml(path))
    if urdf is not None:
        data["urdf"] = str(Path(urdf).resolve())
    if "urdf" not in data:
        raise RobotError(f"{path}: names no URDF; add 'urdf: FILE.urdf' or give robot.urdf=FILE.urdf")
    return _described(data, path.parent, str(path))
