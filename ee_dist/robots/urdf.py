"""A user's URDF as parts and joints: masses, inertia, limits and collision primitives come from the file.

Units are URDF's own: m, kg, rad. What the file cannot say (drives, sensors, whether the base is bolted down) is said in
a robot description; see ``describe.py``. Meshes are left out, with a note: contact with the floor needs a primitive.
Links without mass are folded into their neighbours; see ``fold.py``.
"""

from __future__ import annotations

import math
import shutil
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ee_dist.basics.names import listed
from ee_dist.basics.quoted import quoted
from ee_dist.robots.body import Body
from ee_dist.robots.fold import DUMMY_KG, HELPER_KG, HELPER_KG_M2, entries, folded, posed
from ee_dist.robots.mass_matrix import rotation_matrix
from ee_dist.robots.model import (
    CONTINUOUS_M,
    CONTINUOUS_RAD,
    NO_TURN,
    ZERO3,
    Joint,
    Part,
    Quat,
    RobotError,
    Shape,
    Vec3,
)
from ee_dist.robots.moments import Moments, one_direction, refused
from ee_dist.robots.pivots import PIVOT_HINT
from ee_dist.robots.xacro import PROGRAM, XacroError, expanded, is_xacro
from ee_dist.robots.xml import XmlError, element_of, read_xml

KINDS = {"revolute": "hinge", "continuous": "hinge", "prismatic": "slide", "fixed": "fixed", "floating": "floating"}
WORLD = "world"
LARGEST = 1e9
"""Of any number in SI units: what is beyond is a mistake, and would leave the finite numbers when squared."""
POINT_M = 0.01
SHOWN = 4
PIVOT_SHARE, PIVOT_M = (1.0, 1.8), 0.05
"""An inertia that is 1 to 1.8 times mass x (distance of the centre from the joint)^2 looks like one about the joint: of a rod it
would be 4/3, of its own centre 1/3. Nearer than 5 cm nothing can be said."""


class UrdfError(RobotError):
    """A URDF that cannot be used; one line: the file, the element, what is wrong and what would be right."""


def read_urdf(path: str | Path) -> Body:
    """The body that a URDF file describes, parts in an order in which each follows the part that carries it.

    Raises UrdfError: no file, not XML, no inertia on a moving link, a joint without its links, a loop, a joint kind that
    is not hinge, slide or fixed, a number that is none.
    """
    file = Path(path)
    try:
        root, _ = read_xml(file, "a URDF")
        made = expanded(file) if is_xacro(file) else None
        if made is not None:
            root = element_of(file, made)
    except (XmlError, XacroError) as error:
        raise UrdfError(str(error)) from None
    if root.tag != "robot":
        raise UrdfError(f"{file}: the outermost element is <{root.tag}>; a URDF begins with <robot>")
    if "xacro" in root.tag or any("xacro" in str(e.tag) for e in root):
        how = "call it .xacro" if shutil.which(PROGRAM) else "install xacro"
        raise UrdfError(
            f"{file}: is a xacro, which makes a URDF: {how}, or run 'xacro {file.name} > robot.urdf' and name that"
        )
    return _Reader(file, root).body()


class _Reader:
    def __init__(self, file: Path, root: ET.Element) -> None:
        self.file, self.root = file, root
        self.notes: list[str] = []
        self.assumed: list[str] = []
        self.meshes: dict[str, None] = {}
        self.empty: dict[str, None] = {}
        self.moments = Moments()

    def fail(self, where: str, what: str) -> UrdfError:
        return UrdfError(f"{self.file}: {where}: {what}")

    def body(self) -> Body:
        links = {self.named(e, "link"): e for e in self.root.findall("link")}
        if not links:
            raise self.fail("robot", "no <link> in it")
        elements = {self.named(e, "joint"): e for e in self.root.findall("joint")}
        self.implicit_world(links)
        joints = [self.joint(name, e, links) for name, e in elements.items()]
        carried: dict[str, Joint] = {}
        for j in joints:
            if j.child in carried:
                raise self.fail(
                    f"link {quoted(j.child)}",
                    f"hangs on two joints, {quoted(carried[j.child].name)} and {quoted(j.name)}",
                )
            carried[j.child] = j
        roots = [name for name in links if name not in carried]
        if len(roots) != 1:
            found = listed(map(quoted, roots), "none (the joints form a loop)")
            raise self.fail("robot", f"expected one link that no joint carries, found {found}")
        order = self.order(roots[0], joints)
        if len(order) != len(links):
            lost = next(name for name in links if name not in order)
            raise self.fail(f"link {quoted(lost)}", f"is not connected to {quoted(roots[0])}: the joints form a loop")
        floats = self.unmoored(carried, order)
        still = {order[0]}
        for name in order[1:]:
            if carried[name].kind == "fixed" and carried[name].parent in still:
                still.add(name)
        axes = one_direction(order, carried)
        parts = {name: self.part(name, links[name], carried.get(name), name in still, axes.get(name)) for name in order}
        if self.moments.unfit:
            raise self.fail(f"links {listed(self.moments.unfit)}", refused())
        kept_parts, kept_joints, start, given, idle = folded(parts, {n: carried[n] for n in order[1:]}, order[0])
        if floats is not None:
            start = posed((floats.position_m, floats.rotation), start)
        for name in idle:
            if carried[name].kind != "fixed":
                raise self.fail(f"link {quoted(name)}", self.without_mass(name, links[name], carried[name]))
        assumed = [*self.assumed, *self.moments.assumed()]
        root_given = kept_parts[0].name in given
        given = [n for n in given if n != kept_parts[0].name]
        if given:
            assumed.append(
                f"helper links without mass get {HELPER_KG:g} kg and {HELPER_KG_M2:g} kg.m^2: {listed(given)}"
            )
        if self.meshes:
            self.notes.insert(0, f"collision meshes of {len(self.meshes)} links left out: only boxes, spheres, cylinders "
                                 f"and capsules touch the floor ({listed(self.meshes)})")  # fmt: skip
        if self.empty:
            self.notes.append(f"collision shapes of size 0 left out: {listed(self.empty)}")
        self.hint_at_pivots(kept_parts, kept_joints)
        moving = [j.name for j in kept_joints if j.kind != "fixed"]
        return Body(
            name=self.root.get("name") or self.file.stem,
            parts=tuple(kept_parts),
            joints=tuple(kept_joints),
            drives={name: self.known(elements[name], f"joint {quoted(name)}") for name in moving},
            unlimited=tuple(name for name in moving if self.unlimited(elements[name], f"joint {quoted(name)}")),
            transmissions=tuple(j.get("name", "") for t in self.root.iter("transmission") for j in t.iter("joint")),
            root_without_mass=root_given,
            bolted_only=(*self.moments.idle, *self.moments.planar),
            free_base=True if floats is not None else None,
            start_position_m=start[0],
            start_rotation=start[1],
            notes=(*self.notes, *assumed),
            assumed=tuple(assumed),
        )

    def implicit_world(self, links: dict[str, ET.Element]) -> None:
        """A ``world`` that joints hang on without declaring it."""
        for e in self.root.findall("joint"):
            parent = e.find("parent")
            if parent is not None and parent.get("link") == WORLD and WORLD not in links:
                links[WORLD] = ET.Element("link", name=WORLD)

    def unmoored(self, carried: dict[str, Joint], order: list[str]) -> Joint | None:
        """Take away a world that the robot only floats in, and the joint by which it does."""
        floating = [j for j in carried.values() if j.kind == "floating"]
        if not floating:
            return None
        first = floating[0]
        if len(floating) > 1 or first.parent != order[0] or sum(j.parent == order[0] for j in carried.values()) > 1:
            raise self.fail(
                f"joint {quoted(first.name)}", "is floating, which only the joint of the whole robot can be"
            )
        del carried[first.child]
        order.remove(first.parent)
        return first

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

    def without_mass(self, name: str, e: ET.Element, joint: Joint) -> str:
        inertial = e.find("inertial")
        if inertial is None:
            return f"no <inertial>, but joint {quoted(joint.name)} moves it: give it a mass and an inertia"
        mass = inertial.find("mass")
        value = 0.0 if mass is None else self.number(mass, "value", f"link {quoted(name)}")
        return f"mass {value:g} kg; expected a positive number, as joint {quoted(joint.name)} moves it"

    def hint_at_pivots(self, parts: list[Part], joints: list[Joint]) -> None:
        """Say where an inertia looks as if it were about the joint: a hint, for nothing proves it."""
        kinds, found = {j.child: j.kind for j in joints}, []
        for part in parts:
            away = float(np.linalg.norm(part.com_m))
            if kinds.get(part.name) != "hinge" or away < PIVOT_M:
                continue
            xx, yy, zz = part.inertia_kg_m2[:3]
            about = (xx + yy + zz) / 2  # of a thin part, the moment across it
            low, high = (share * part.mass_kg * away**2 for share in PIVOT_SHARE)
            if low <= min(max(xx, yy, zz), about) <= high:
                found.append(part.name)
        if found:
            self.notes.append(
                f"{PIVOT_HINT}{listed(found)} looks as if it were about the joint; URDF means the centre of mass: "
                "if it is, add 'inertia_about: joint' to the robot's description"
            )

    def order(self, root: str, joints: list[Joint]) -> list[str]:
        order = [root]
        for name in order:
            order.extend(j.child for j in joints if j.parent == name)
        return order

    # -- elements ----------------------------------------------------------------------------------------------------

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

    def joint(self, name: str, e: ET.Element, links: dict[str, ET.Element]) -> Joint:
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


def turn_of_rpy(rpy: Vec3) -> Quat:
    """Quaternion (scalar last) of URDF's roll, pitch, yaw about fixed axes x, y, z (rad)."""
    (cr, sr), (cp, sp), (cy, sy) = ((math.cos(a / 2), math.sin(a / 2)) for a in rpy)
    return (
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        cr * cp * cy + sr * sp * sy,
    )
