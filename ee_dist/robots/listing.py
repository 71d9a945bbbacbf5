"""The orders in which the files of a robot list its joints, whatever order the robot has them in."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ee_dist.robots.describe import READERS
from ee_dist.robots.model import RobotError
from ee_dist.robots.texts import read_text
from ee_dist.robots.xml import XmlError, read_xml


def listings(*files: Any) -> tuple[tuple[str, tuple[str, ...]], ...]:
    """(what it is called, joints) of each description, URDF or MJCF, with that which a description names. What is none of these,
    or cannot be read, is left out: whoever needs the robot itself says what is wrong with it."""
    found: list[tuple[str, tuple[str, ...]]] = []
    for path in (Path(str(f)) for f in files):
        if path.suffix.lower() not in (".yaml", ".yml", ".json"):
            found += _of_body(path)
            continue
        try:
            data = read_text(path, "the description of a robot")
        except RobotError:
            continue
        data = data if isinstance(data, Mapping) else {}
        if isinstance(data.get("drives"), Mapping):
            found.append((f"as {path.name} lists them", tuple(map(str, data["drives"]))))
        found += [line for kind in READERS if kind in data for line in _of_body(path.parent / str(data[kind]))]
    return tuple(found)


def _of_body(path: Path) -> list[tuple[str, tuple[str, ...]]]:
    try:
        root = read_xml(path)[0] if path.is_file() else None
    except (XmlError, OSError):
        return []
    if root is None:
        return []
    # Wherever they stand: a URDF lists joints side by side, an MJCF in the bodies that they move.
    return [(f"as {path.name} lists them", tuple(e.get("name", "") for e in root.iter("joint")))]
