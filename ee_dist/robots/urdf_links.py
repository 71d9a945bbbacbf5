"""The links of a URDF as parts: their masses and inertia, and the primitives that they touch the floor with."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ee_dist.basics.quoted import quoted
from ee_dist.robots.fold import DUMMY_KG, entries
from ee_dist.robots.mass_matrix import rotation_matrix
from ee_dist.robots.model import ZERO3, Joint, Part, Shape
from ee_dist.robots.moments import Moments
from ee_dist.robots.urdf_attributes import Attributes

POINT_M = 0.01
"""Radius of gyration that a mass without inertia is given."""


class Links(Attributes):
    """Reads them one by one, and collects what is ``assumed``, whose shapes are ``meshes`` or ``empty`` (names of links, in
    order), and what is wrong with moments of inertia."""

    def __init__(self, file: Path) -> None:
        super().__init__(file)
        self.assumed: list[str] = []
        self.meshes: dict[str, None] = {}
        self.empty: dict[str, None] = {}
        self.moments = Moments()

    def part(
        self, name: str, e: ET.Element, joint: Joint | None, still: bool, axis: NDArray[np.float64] | None = None
    ) -> Part:
        """A link as a part; ``still``: it never moves beside the root; ``axis`` (3,): the one direction about which it turns."""
        where = f"link {quoted(name)}"
        shapes = tuple(s for c in e.findall("collision") if (s := self.shape(name, c)) is not None)
        inertial = e.find("inertial")
        if inertial is None:
            return Part(name, 0.0, ZERO3, (0.0,) * 6, shapes)
        com, turn = self.origin(inertial, where)
        mass_element, tensor = inertial.find("mass"), inertial.find("inertia")
        if mass_element is None:
            raise self.fail(where, "<inertial> lacks <mass>")
        mass = self.number(mass_element, "value", where)
        if mass < 0:
            raise self.fail(where, f"mass {mass:g} kg; expected a positive number")
        if mass <= DUMMY_KG:
            return Part(name, 0.0, ZERO3, (0.0,) * 6, shapes)
        if tensor is None:
            raise self.fail(where, "<inertial> lacks <inertia>")
        keys = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
        xx, xy, xz, yy, yz, zz = (
            self.number(tensor, k, where, 0.0 if k in ("ixy", "ixz", "iyz") else None) for k in keys
        )
        own = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        if not own.any() and joint is not None and joint.kind == "fixed":
            own = np.diag(np.full(3, mass * POINT_M**2))
            self.assumed.append(f"{where}: a mass without inertia: taken as a ball of 1 cm")
        axes = rotation_matrix(turn)
        own = self.moments.usable(name, own, still, None if axis is None else axes.T @ axis)
        return Part(name, mass, com, entries(axes @ own @ axes.T), shapes)

    def shape(self, link: str, collision: ET.Element) -> Shape | None:
        where = f"link {quoted(link)}"
        position, rotation = self.origin(collision, where)
        geometry = collision.find("geometry")
        found = geometry[0] if geometry is not None and len(geometry) else None
        if found is None:
            raise self.fail(where, "<collision> without a geometry")
        if found.tag == "box":
            x, y, z = self.vector(found, "size", where, (0.0, 0.0, 0.0))
            if found.get("size") is not None and x == y == z == 0:
                self.empty[link] = None
                return None
            if min(x, y, z) <= 0:
                raise self.fail(where, f"<box size='{x:g} {y:g} {z:g}'>: expected three positive numbers")
            return Shape("box", (x / 2, y / 2, z / 2), position, rotation)
        keys = {"sphere": ("radius",), "cylinder": ("radius", "length"), "capsule": ("radius", "length")}.get(found.tag)
        if keys is not None:
            if any(self.number(found, k, where) == 0 for k in keys):
                # What tools write of a link that is only a frame.
                self.empty[link] = None
                return None
            return Shape(found.tag, tuple(self.positive(found, k, where) for k in keys), position, rotation)
        self.meshes[link] = None
        return None

    def without_mass(self, name: str, e: ET.Element, joint: Joint) -> str:
        inertial = e.find("inertial")
        if inertial is None:
            return f"no <inertial>, but joint {quoted(joint.name)} moves it: give it a mass and an inertia"
        mass = inertial.find("mass")
        value = 0.0 if mass is None else self.number(mass, "value", f"link {quoted(name)}")
        return f"mass {value:g} kg; expected a positive number, as joint {quoted(joint.name)} moves it"
