"""The joints of a URDF: what they connect, how they move, and what the file knows of their drives."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Collection
from pathlib import Path

from ee_dist.basics.names import listed
from ee_dist.basics.quoted import quoted
from ee_dist.robots.model import CONTINUOUS_M, CONTINUOUS_RAD, Joint
from ee_dist.robots.urdf_attributes import Attributes

KINDS = {"revolute": "hinge", "continuous": "hinge", "prismatic": "slide", "fixed": "fixed", "floating": "floating"}


class Joints(Attributes):
    """Reads them one by one, and collects ``notes`` on what is left out and what is ``assumed``."""

    def __init__(self, file: Path) -> None:
        super().__init__(file)
        self.notes: list[str] = []
        self.assumed: list[str] = []

    def joint(self, name: str, e: ET.Element, links: Collection[str]) -> Joint:
        where = f"joint {quoted(name)}"
        kind = e.get("type", "")
        if kind not in KINDS:
            raise self.fail(where, f"kind {quoted(kind)} is not supported; there are: {', '.join(KINDS)}")
        ends = {}
        for tag in ("parent", "child"):
            found = e.find(tag)
            link = found.get("link", "") if found is not None else ""
            if link not in links:
                raise self.fail(where, f"its {tag} link {quoted(link)} is not in the file; there are: {listed(links)}")
            ends[tag] = link
        position, rotation = self.origin(e, where)
        mimic = e.find("mimic")
        if mimic is not None:
            self.notes.append(
                f"{where} mimics {quoted(mimic.get('joint', '?'))}, which is left out: it is held at zero"
            )
            kind = "fixed"
        axis_element = e.find("axis")
        axis = (1.0, 0.0, 0.0) if axis_element is None else self.vector(axis_element, "xyz", where, (1.0, 0.0, 0.0))
        length = math.sqrt(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2])
        if kind not in ("fixed", "floating") and length < 1e-9:
            raise self.fail(where, "its axis has no direction (0 0 0)")
        unit = (axis[0] / length, axis[1] / length, axis[2] / length) if length > 1e-9 else (1.0, 0.0, 0.0)
        lower, upper = self.limits(name, kind, e)
        limit = e.find("limit")
        speed = 0.0 if limit is None else self.number(limit, "velocity", where, 0.0)
        if speed < 0:
            raise self.fail(where, f"<limit velocity={speed:g}>; expected 0 or more")
        top = speed if speed > 0 and kind != "fixed" else math.inf
        return Joint(
            name, KINDS[kind], ends["parent"], ends["child"], position, unit, lower, upper, rotation, top_speed=top
        )

    def limits(self, name: str, kind: str, e: ET.Element) -> tuple[float, float]:
        """(lower, upper) stops of a joint; far away where there are none, or where none are stated."""
        if kind in ("fixed", "floating"):
            return 0.0, 0.0
        far = CONTINUOUS_M if kind == "prismatic" else CONTINUOUS_RAD
        if kind == "continuous":
            return -far, far
        limit, where = e.find("limit"), f"joint {quoted(name)}"
        if limit is None or (limit.get("lower") is None and limit.get("upper") is None):
            self.assumed.append(f"{where} states no limits: taken as without stops")
            return -far, far
        lower, upper = self.number(limit, "lower", where, 0.0), self.number(limit, "upper", where, 0.0)
        blank = ("lower", "upper", "effort", "velocity")
        if all(self.number(limit, k, where, 0.0) == 0.0 for k in blank):
            # What a CAD program writes where nobody entered a limit: a joint that is held still would be a fixed one.
            self.assumed.append(
                f"{where}: its limits are all zero, as an export leaves them blank: taken as without stops"
            )
            return -far, far
        if not lower < upper:
            raise self.fail(where, f"its limits leave no range: lower {lower:g}, upper {upper:g}")
        return lower, upper

    def known(self, e: ET.Element, where: str) -> dict[str, float | str]:
        """What the file says of a joint's drive. An effort of 0 is how tools write that they do not know."""
        found: dict[str, float | str] = {}
        for tag, key, name in (("limit", "effort", "torque_limit"), ("dynamics", "damping", "viscous"),
                               ("dynamics", "friction", "coulomb")):  # fmt: skip
            element = e.find(tag)
            if element is None or element.get(key) is None:
                continue
            value = self.number(element, key, where)
            if value < 0:
                raise self.fail(where, f"<{tag} {key}={value:g}>; expected 0 or more")
            if value > 0 or name != "torque_limit":
                found[name] = value
        return found

    def unlimited(self, e: ET.Element, where: str) -> bool:
        limit = e.find("limit")
        return limit is not None and limit.get("effort") is not None and self.number(limit, "effort", where) == 0
