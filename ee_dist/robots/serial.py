"""A robot as plain dictionaries or JSON, and back, exactly.

The form follows the dataclasses of ``model.py`` field by field, so that a new field needs no line here: tuples are
lists, and a field with a default may be left out, so that files written before the field existed still load. Numbers
come back as they were written (Python writes the shortest decimal that reads back to the same bits). JSON has no
infinity: numbers that are not finite are the strings "inf", "-inf" and "nan".
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import MISSING, fields, is_dataclass
from functools import cache
from typing import Any, cast, get_args, get_origin, get_type_hints

from ee_dist.basics.quoted import quoted
from ee_dist.robots.model import Robot, RobotError
from ee_dist.robots.untrusted import UntrustedError, json_of

VERSION = 1
_NOT_FINITE = {"inf": math.inf, "-inf": -math.inf, "nan": math.nan}


class RobotFormatError(RobotError):
    """Data that is not a robot; one line: what is wrong, and where."""


def robot_to_dict(robot: Robot) -> dict[str, Any]:
    """``{"version": 1, "robot": {...}}`` out of dictionaries, lists, strings and finite numbers."""
    return {"version": VERSION, "robot": plain(robot)}


def robot_from_dict(data: Any) -> Robot:
    """The robot that ``robot_to_dict`` was given. Raises RobotFormatError."""
    if not isinstance(data, Mapping):
        raise RobotFormatError(f"robot: expected a mapping with 'version' and 'robot', not {quoted(data)}")
    _check_keys(data, required={"version", "robot"}, allowed={"version", "robot"}, where="file")
    if data["version"] != VERSION:
        raise RobotFormatError(f"version: expected {VERSION}, not {quoted(data['version'])}")
    return cast(Robot, built(Robot, data["robot"], "robot"))


def robot_to_json(robot: Robot) -> str:
    """The dictionary form as JSON text, one line; equal robots give equal text."""
    return json.dumps(robot_to_dict(robot), ensure_ascii=False, allow_nan=False)


def robot_from_json(text: str | bytes) -> Robot:
    """The robot that ``robot_to_json`` was given. Raises RobotFormatError."""
    try:
        data = json_of(text)
    except UntrustedError as error:
        raise RobotFormatError(f"robot: {error}") from error
    return robot_from_dict(data)


def plain(value: Any) -> Any:
    """A dataclass, or what one holds, out of dictionaries, lists, strings and finite numbers."""
    if is_dataclass(value):
        return {f.name: plain(getattr(value, f.name)) for f in fields(value)}
    if isinstance(value, tuple):
        return [plain(v) for v in value]
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else str(float(value))
    return value


@cache
def _fields_of(kind: type) -> tuple[dict[str, Any], frozenset[str]]:
    """Types of the fields by name, and the names that have no default."""
    hints = get_type_hints(kind)
    required = {f.name for f in fields(kind) if f.default is MISSING and f.default_factory is MISSING}
    return {f.name: hints[f.name] for f in fields(kind)}, frozenset(required)


def built(kind: Any, value: Any, where: str) -> Any:
    """A value of type ``kind`` out of plain data. Raises RobotFormatError."""
    if is_dataclass(kind):
        types, required = _fields_of(cast(type, kind))
        if not isinstance(value, Mapping):
            raise RobotFormatError(f"{where}: expected a mapping, not {quoted(value)}")
        _check_keys(value, required, types.keys(), where)
        return cast(type, kind)(**{k: built(types[k], v, f"{where}.{k}") for k, v in value.items()})
    if get_origin(kind) is tuple:
        return _build_tuple(get_args(kind), value, where)
    if kind is float:
        if isinstance(value, str) and value in _NOT_FINITE:
            return _NOT_FINITE[value]
        accepted = isinstance(value, (int, float)) and not isinstance(value, bool)
    elif kind is int:
        accepted = isinstance(value, int) and not isinstance(value, bool)
    elif kind in (str, bool):
        accepted = isinstance(value, kind)
    else:
        raise TypeError(f"{where}: no rule for a field of type {kind}")
    if not accepted:
        expected = {float: "a number", int: "a whole number", str: "a text", bool: "true or false"}[kind]
        raise RobotFormatError(f"{where}: expected {expected}, not {quoted(value)}")
    return value


def _build_tuple(kinds: tuple[Any, ...], value: Any, where: str) -> tuple[Any, ...]:
    if not isinstance(value, (list, tuple)):
        raise RobotFormatError(f"{where}: expected a list, not {quoted(value)}")
    if len(kinds) == 2 and kinds[1] is Ellipsis:
        kinds = (kinds[0],) * len(value)
    if len(value) != len(kinds):
        raise RobotFormatError(f"{where}: expected {len(kinds)} entries, not {len(value)}")
    return tuple(built(k, v, f"{where}[{i}]") for i, (k, v) in enumerate(zip(kinds, value, strict=True)))


def _check_keys(value: Mapping[Any, Any], required: Any, allowed: Any, where: str) -> None:
    unknown = [k for k in value if k not in allowed]
    if unknown:
        raise RobotFormatError(f"{where}: unknown key {quoted(unknown[0])}; there are: {', '.join(sorted(allowed))}")
    missing = sorted(k for k in required if k not in value)
    if missing:
        raise RobotFormatError(f"{where}: missing key {quoted(missing[0])}")
