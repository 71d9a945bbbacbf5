"""Robots by name, by URDF, by MJCF or by a short description in YAML: the way in for a user's own robot.

A description is either one of ours with its numbers changed ::

    robot: servo_pendulum
    gain: 100

or a URDF (or ``mjcf: arm.xml``) with what the file cannot say ::

    urdf: arm.urdf              # beside this file
    free_base: false            # bolted to the world (default), or free to move
    time_step_s: 0.002
    has_floor: false
    velocity_limits: scale      # or obeyed, where the controllers keep to the file's velocity limits
    inertia_about: centre       # or joint, where the file's inertias are about the joints
    drives:                     # joint: any field of a drive; unnamed joints swing freely
      shoulder: {kp: 40, kd: 1, torque_limit: 12}
      elbow: {command: torque, torque_limit: 6}
    sensors:                    # left out: position and velocity of every driven joint
      - {name: shoulder_angle, kind: position, target: shoulder}
"""

from __future__ import annotations

import importlib
import inspect
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from ee_dist.basics.files import real
from ee_dist.basics.names import listed
from ee_dist.basics.quoted import quoted
from ee_dist.robots.body import Body
from ee_dist.robots.described import KEYS, near, robot_of_body
from ee_dist.robots.linear_stage import linear_stage
from ee_dist.robots.model import Robot, RobotError
from ee_dist.robots.moments import spread_too_far
from ee_dist.robots.numbers import checked, number
from ee_dist.robots.quadruped import quadruped
from ee_dist.robots.quadruped_lab import quadruped_lab
from ee_dist.robots.serial import robot_from_dict
from ee_dist.robots.servo_pendulum import servo_pendulum
from ee_dist.robots.texts import read_text
from ee_dist.robots.xml import read_xml

BUILT_IN: dict[str, Callable[..., Robot]] = {
    "quadruped": quadruped,
    "quadruped_lab": quadruped_lab,
    "servo_pendulum": servo_pendulum,
    "linear_stage": linear_stage,
}
LONGEST_NAME = 1000
"""Characters of the name of a file, with its folders; systems take some more."""
READERS = {"urdf": "ee_dist.robots.urdf:read_urdf", "mjcf": "ee_dist.engines.mujoco.mjcf:read_mjcf"}
"""What reads a file of a kind, loaded when there is one to read: robots know no engine, but one engine knows its own files."""


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
    if path.suffix.lower() in (".urdf", ".xacro", ".xml", ".mjcf"):
        return _described({kind_of(path): str(path)}, Path("."), str(path))
    if path.suffix.lower() in (".yaml", ".yml", ".json"):
        return _described(_yaml(path), path.parent, str(path))
    raise RobotError(f"no robot named {quoted(text)}; there are: {', '.join(BUILT_IN)}, or a file (.urdf, .xml, .yaml)")


def kind_of(path: Path) -> str:
    """``urdf`` or ``mjcf``, by what the file begins with. Raises RobotError."""
    if path.suffix.lower() != ".xml":
        return "mjcf" if path.suffix.lower() == ".mjcf" else "urdf"
    tag = read_xml(path)[0].tag
    if tag not in ("robot", "mujoco"):
        raise RobotError(f"{path}: the outermost element is <{tag}>; expected <robot> (URDF) or <mujoco> (MJCF)")
    return "urdf" if tag == "robot" else "mjcf"


def read_body(kind: str, path: str | Path) -> Body:
    """What a file of a kind of READERS says. Raises RobotError."""
    module, _, function = READERS[kind].partition(":")
    body: Body = getattr(importlib.import_module(module), function)(path)
    if odd := spread_too_far(body.parts, body.joints):
        raise RobotError(
            f"{path}: inertia of {listed(odd)}: no part of this robot has it; inertias are in kg.m^2 (1 kg.cm^2 is 1e-4, "
            "1 kg.mm^2 is 1e-6), or is an exponent mistyped?"
        )
    return body


def _yaml(path: Path) -> Mapping[str, Any]:
    found = read_text(path, "the description of a robot")
    if not isinstance(found, Mapping):
        raise RobotError(f"{path}: expected a mapping with 'robot', 'urdf' or 'mjcf'")
    return found


def _described(data: Mapping[str, Any], folder: Path, where: str) -> tuple[Robot, tuple[str, ...]]:
    if "version" in data:
        return checked(robot_from_dict(data), where), ()
    for kind in READERS:
        if kind in data:
            return _of_file(kind, data, folder, where)
    named = data.get("robot", "")
    name = named if isinstance(named, str) else ""
    if name not in BUILT_IN:
        raise RobotError(
            f"{where}: no robot named {quoted(named)}; {near(name, tuple(BUILT_IN))}, or give 'urdf' or 'mjcf'"
        )
    make = BUILT_IN[name]
    allowed = tuple(inspect.signature(make).parameters)
    numbers = {}
    for key, value in data.items():
        if key == "robot":
            continue
        if key not in allowed:
            raise RobotError(f"{where}: {name} has no {quoted(key)}; {near(str(key), allowed)}")
        numbers[str(key)] = number(value, f"{where}: {key}")
        if key.endswith("samples"):
            numbers[str(key)] = int(numbers[str(key)])
    return checked(make(**numbers), where), ()


def _of_file(kind: str, data: Mapping[str, Any], folder: Path, where: str) -> tuple[Robot, tuple[str, ...]]:
    for key in data:
        if key not in (kind, *KEYS):
            raise RobotError(f"{where}: unknown key {quoted(key)}; {near(str(key), (kind, *KEYS))}")
    name = data[kind]
    if not isinstance(name, str) or not name.isprintable() or not 0 < len(name) <= LONGEST_NAME:
        raise RobotError(f"{where}: {kind}: expected the name of a file, not {quoted(name)}")
    return robot_of_body(read_body(kind, folder / name), data, where)


def robot_of(name: str, source: str | None = None, drives: str | None = None) -> tuple[Robot, tuple[str, ...]]:
    """The robot of three settings: a name or file; or ``urdf`` or ``mjcf`` with the file ``source`` and the description
    ``drives`` that goes with it, which may itself name a file of either kind.

    Raises RobotError.
    """
    if name not in READERS:
        return load_robot(name)
    if drives is None:
        if source is None:
            setting = "robot.urdf=FILE.urdf" if name == "urdf" else "robot.file=FILE.xml"
            raise RobotError(f"robot={name} needs {setting}, or robot.drives=FILE.yaml that names one")
        return _described({name: source}, Path("."), source)
    path = Path(drives)
    data = dict(_yaml(path))
    if source is not None:
        data[name] = str(real(source))
    if not any(kind in data for kind in READERS):
        setting = "robot.urdf" if name == "urdf" else "robot.file"
        raise RobotError(f"{path}: names no {name.upper()}; add '{name}: FILE' or give {setting}=FILE")
    return _described(data, path.parent, str(path))
