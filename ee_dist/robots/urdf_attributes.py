"""What the attributes of a URDF's elements say: names, numbers and vectors, or one line on what is wrong with them."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from pathlib import Path

from ee_dist.basics.quoted import quoted
from ee_dist.robots.model import NO_TURN, ZERO3, Quat, RobotError, Vec3

LARGEST = 1e9
"""Of any number in SI units: what is beyond is a mistake, and would leave the finite numbers when squared."""


class UrdfError(RobotError):
    """A URDF that cannot be used; one line: the file, the element, what is wrong and what would be right."""


class Attributes:
    """Of the elements of one file. ``where`` names an element to people; UrdfError is raised for what is missing or wrong."""

    def __init__(self, file: Path) -> None:
        self.file = file

    def fail(self, where: str, what: str) -> UrdfError:
        return UrdfError(f"{self.file}: {where}: {what}")

    def named(self, element: ET.Element, what: str) -> str:
        name = element.get("name")
        if not name:
            raise self.fail(what, f"a <{what}> without a name")
        return name

    def number(self, element: ET.Element, key: str, where: str, default: float | None = None) -> float:
        text = element.get(key)
        if text is None:
            if default is None:
                raise self.fail(where, f"<{element.tag}> lacks {quoted(key)}")
            return default
        try:
            value = float(text)
        except ValueError:
            raise self.fail(where, f"<{element.tag} {key}={quoted(text)}> is not a number") from None
        if not abs(value) <= LARGEST:
            raise self.fail(where, f"<{element.tag} {key}={quoted(text)}>: expected a number of at most {LARGEST:g}")
        return value

    def positive(self, element: ET.Element, key: str, where: str) -> float:
        value = self.number(element, key, where)
        if value <= 0:
            raise self.fail(where, f"<{element.tag} {key}={value:g}>; expected a positive number")
        return value

    def vector(self, element: ET.Element, key: str, where: str, default: Vec3) -> Vec3:
        text = element.get(key)
        if text is None:
            return default
        try:
            values = tuple(float(v) for v in text.split())
        except ValueError:
            values = ()
        if len(values) != 3 or not all(abs(v) <= LARGEST for v in values):
            raise self.fail(where, f"<{element.tag} {key}={quoted(text)}>: expected three numbers")
        return values[0], values[1], values[2]

    def origin(self, element: ET.Element, where: str) -> tuple[Vec3, Quat]:
        found = element.find("origin")
        if found is None:
            return ZERO3, NO_TURN
        return self.vector(found, "xyz", where, ZERO3), turn_of_rpy(self.vector(found, "rpy", where, ZERO3))


def turn_of_rpy(rpy: Vec3) -> Quat:
    """Quaternion (scalar last) of URDF's roll, pitch, yaw about fixed axes x, y, z (rad)."""
    (cr, sr), (cp, sp), (cy, sy) = ((math.cos(a / 2), math.sin(a / 2)) for a in rpy)
    return (
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        cr * cp * cy + sr * sp * sy,
    )
