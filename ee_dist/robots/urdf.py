"""A user's URDF as parts and joints: masses, inertia, limits and collision primitives come from the file.

Units are URDF's own: m, kg, rad. What the file cannot say (drives, sensors, whether the base is bolted down) is said in
a robot description; see ``describe.py``. Meshes are skipped, with a note: contact with the floor needs a primitive.

Links without mass that are rigidly attached (tool frames, sensor mounts) are merged into what carries them.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ee_dist.robots.inertia import rotation_matrix
from ee_dist.robots.kinematics import compose
from ee_dist.robots.model import NO_TURN, ZERO3, Joint, Part, Quat, RobotError, Shape, Vec3
from ee_dist.robots.untrusted import UntrustedError, text_of

CONTINUOUS_RAD = 200 * math.pi
"""Stops of a joint that has none: a hundred turns either way."""
LARGEST = 16 * 2**20
"""Bytes of a URDF: meshes are files of their own."""
KINDS = {"revolute": "hinge", "continuous": "hinge", "prismatic": "slide", "fixed": "fixed"}


class UrdfError(RobotError):
    """A URDF that cannot be used; one line: the file, the element, what is wrong and what would be right."""


@dataclass
class UrdfBody:
    """What a URDF describes. ``effort``, ``damping`` and ``friction`` are by joint, where the file gives them."""

    name: str
    parts: tuple[Part, ...]
    joints: tuple[Joint, ...]
    effort: dict[str, float] = field(default_factory=dict)
    damping: dict[str, float] = field(default_factory=dict)
    friction: dict[str, float] = field(default_factory=dict)
    notes: tuple[str, ...] = ()


def read_urdf(path: str | Path) -> UrdfBody:
    """The body that a URDF file describes, parts in an order in which each follows the part that carries it.

    Raises UrdfError: no file, not XML, no inertia on a moving link, a joint without its links, a loop, a joint kind that
    is not hinge, slide or fixed, a number that is none.
    """
    file = Path(path)
    try:
        text = text_of(file, LARGEST)
        if "<!DOCTYPE" in text or "<!ENTITY" in text:
            raise UrdfError(f"{file}: declares a document type or entities; a URDF needs neither, take them out")
        root = ET.fromstring(text)
    except FileNotFoundError:
        raise UrdfError(f"{file}: no such file; expected a URDF") from None
    except UrdfError:
        raise
    except UntrustedError as error:
        raise UrdfError(f"{file}: {error}") from None
    except (ET.ParseError, ValueError, RecursionError) as error:
        raise UrdfError(f"{file}: not well-formed XML: {error}") from None
    except OSError as error:
        raise UrdfError(f"{file}: cannot be read ({error.strerror})") from None
    if root.tag != "robot":
        raise UrdfError(f"{file}: the outermost element is <{root.tag}>; a URDF begins with <robot>")
    return _Reader(file, root).body()


class _Reader:
    def __init__(self, file: Path, root: ET.Element) -> None:
        self.file, self.root = file, root
        self.notes: list[str] = []

    def fail(self, where: str, what: str) -> UrdfError:
        return UrdfError(f"{self.file}: {where}: {what}")

    def body(self) -> UrdfBody:
        links = {self.named(e, "link"): e for e in self.root.findall("link")}
        if not links:
            raise self.fail("robot", "no <link> in it")
        joints = [self.joint(e, links) for e in self.root.findall("joint")]
        carried: dict[str, Joint] = {}
        for j in joints:
            if j.child in carried:
                raise self.fail(f"link {j.child!r}", f"hangs on two joints, {carried[j.child].name!r} and {j.name!r}")
            carried[j.child] = j
        roots = [name for name in links if name not in carried]
        if len(roots) != 1:
            found = ", ".join(repr(r) for r in roots) or "none (the joints form a loop)"
            raise self.fail("robot", f"expected one link that no joint carries, found {found}")
        order = self.order(roots[0], joints)
        if len(order) != len(links):
            lost = next(name for name in links if name not in order)
            raise self.fail(f"link {lost!r}", f"is not connected to {roots[0]!r}: the joints form a loop")
        parts = {name: self.part(name, links[name], carried.get(name), name == roots[0]) for name in order}
        kept_parts, kept_joints = _merged(parts, {name: carried[name] for name in order[1:]}, roots[0])
        limits = {self.named(e, "joint"): e for e in self.root.findall("joint")}
        moving = [j.name for j in kept_joints if j.kind != "fixed"]
        return UrdfBody(
            self.root.get("name") or self.file.stem,
            tuple(kept_parts),
            tuple(kept_joints),
            self.table(limits, moving, "limit", "effort"),
            self.table(limits, moving, "dynamics", "damping"),
            self.table(limits, moving, "dynamics", "friction"),
            tuple(self.notes),
        )

    def order(self, root: str, joints: list[Joint]) -> list[str]:
        order = [root]
        for name in order:
            order.extend(j.child for j in joints if j.parent == name)
        return order

    def table(self, elements: dict[str, ET.Element], names: list[str], tag: str, key: str) -> dict[str, float]:
        out = {}
        for name in names:
            found = elements[name].find(tag)
            if found is not None and found.get(key) is not None:
                out[name] = self.number(found, key, f"joint {name!r}")
        return out

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
                raise self.fail(where, f"<{element.tag}> lacks {key!r}")
            return default
        try:
            value = float(text)
        except ValueError:
            raise self.fail(where, f"<{element.tag} {key}={text!r}> is not a number") from None
        if not math.isfinite(value):
            raise self.fail(where, f"<{element.tag} {key}={text!r}> is not finite")
        return value

    def vector(self, element: ET.Element, key: str, where: str, default: Vec3) -> Vec3:
        text = element.get(key)
        if text is None:
            return default
        try:
            values = tuple(float(v) for v in text.split())
        except ValueError:
            values = ()
        if len(values) != 3 or not all(map(math.isfinite, values)):
            raise self.fail(where, f"<{element.tag} {key}={text!r}>: expected three numbers")
        return values[0], values[1], values[2]

    def origin(self, element: ET.Element, where: str) -> tuple[Vec3, Quat]:
        found = element.find("origin")
        if found is None:
            return ZERO3, NO_TURN
        return self.vector(found, "xyz", where, ZERO3), turn_of_rpy(self.vector(found, "rpy", where, ZERO3))

    def joint(self, e: ET.Element, links: dict[str, ET.Element]) -> Joint:
        name = self.named(e, "joint")
        where = f"joint {name!r}"
        kind = e.get("type", "")
        if kind not in KINDS:
            raise self.fail(where, f"kind {kind!r} is not supported; there are: {', '.join(KINDS)}")
        if e.find("mimic") is not None:
            raise self.fail(where, "<mimic> is not supported: give the joint a drive of its own or fix it")
        ends = {}
        for tag in ("parent", "child"):
            found = e.find(tag)
            link = found.get("link", "") if found is not None else ""
            if link not in links:
                raise self.fail(where, f"its {tag} link {link!r} is not in the file; there are: {', '.join(links)}")
            ends[tag] = link
        position, rotation = self.origin(e, where)
        axis_element = e.find("axis")
        axis = (1.0, 0.0, 0.0) if axis_element is None else self.vector(axis_element, "xyz", where, (1.0, 0.0, 0.0))
        length = math.sqrt(sum(v * v for v in axis))
        if kind != "fixed" and length < 1e-9:
            raise self.fail(where, "its axis has no direction (0 0 0)")
        unit = (axis[0] / length, axis[1] / length, axis[2] / length) if length > 0 else (1.0, 0.0, 0.0)
        lower, upper = 0.0, 0.0
        if kind == "continuous":
            lower, upper = -CONTINUOUS_RAD, CONTINUOUS_RAD
        elif kind != "fixed":
            limit = e.find("limit")
            if limit is None:
                raise self.fail(where, f"a {kind} joint needs <limit lower=... upper=...>")
            lower, upper = self.number(limit, "lower", where, 0.0), self.number(limit, "upper", where, 0.0)
            if not lower < upper:
                raise self.fail(where, f"its limits leave no range: lower {lower:g}, upper {upper:g}")
        return Joint(name, KINDS[kind], ends["parent"], ends["child"], position, unit, lower, upper, rotation)

    def part(self, name: str, e: ET.Element, joint: Joint | None, root: bool) -> Part:
        where = f"link {name!r}"
        shapes = tuple(s for c in e.findall("collision") if (s := self.shape(c, where)) is not None)
        inertial = e.find("inertial")
        if inertial is None:
            if joint is not None and joint.kind != "fixed":
                raise self.fail(
                    where, f"no <inertial>, but joint {joint.name!r} moves it: give it a mass and an inertia"
                )
            return Part(name, 0.0, ZERO3, (0.0,) * 6, shapes)
        com, turn = self.origin(inertial, where)
        mass_element, tensor = inertial.find("mass"), inertial.find("inertia")
        if mass_element is None or tensor is None:
            missing = "mass" if mass_element is None else "inertia"
            raise self.fail(where, f"<inertial> lacks <{missing}>")
        mass = self.number(mass_element, "value", where)
        keys = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
        xx, xy, xz, yy, yz, zz = (
            self.number(tensor, k, where, 0.0 if k in ("ixy", "ixz", "iyz") else None) for k in keys
        )
        own = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        moments = np.linalg.eigvalsh(own)
        if mass < 0 or (joint is not None and joint.kind != "fixed" and mass == 0):
            raise self.fail(where, f"mass {mass:g} kg; expected a positive number")
        if mass > 0 and (moments[0] <= 0 or moments[2] > (moments[0] + moments[1]) * 1.001):
            raise self.fail(
                where, "no rigid body has this inertia: principal moments " + ", ".join(f"{m:.3g}" for m in moments)
            )
        axes = rotation_matrix(turn)
        turned = axes @ own @ axes.T
        entries = tuple(float(turned[i, j]) for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)))
        return Part(name, mass, com, entries, shapes)  # type: ignore[arg-type]

    def shape(self, collision: ET.Element, where: str) -> Shape | None:
        position, rotation = self.origin(collision, where)
        geometry = collision.find("geometry")
        found = geometry[0] if geometry is not None and len(geometry) else None
        if found is None:
            raise self.fail(where, "<collision> without a geometry")
        if found.tag == "box":
            x, y, z = self.vector(found, "size", where, (0.0, 0.0, 0.0))
            return Shape("box", (x / 2, y / 2, z / 2), position, rotation)
        if found.tag == "sphere":
            return Shape("sphere", (self.number(found, "radius", where),), position, rotation)
        if found.tag in ("cylinder", "capsule"):
            size = self.number(found, "radius", where), self.number(found, "length", where)
            return Shape(found.tag, size, position, rotation)
        self.notes.append(
            f"{where}: collision <{found.tag}> skipped; only box, sphere, cylinder and capsule touch the floor"
        )
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


def _merged(parts: dict[str, Part], carried: dict[str, Joint], root: str) -> tuple[list[Part], list[Joint]]:
    """Parts and joints without rigidly attached links that have no mass: their shapes and joints go to the carrier."""
    joints = dict(carried)
    for name in list(joints)[::-1]:
        joint, part = joints[name], parts[name]
        if joint.kind != "fixed" or part.mass_kg > 0:
            continue
        at = _pose(joint.position_m, joint.rotation)
        carrier = parts[joint.parent]
        moved = tuple(_moved_shape(at, s) for s in part.shapes)
        parts[joint.parent] = replace(carrier, shapes=(*carrier.shapes, *moved))
        for child, other in joints.items():
            if other.parent == name:
                position, rotation = _split(compose(at, _pose(other.position_m, other.rotation)))
                joints[child] = replace(other, parent=joint.parent, position_m=position, rotation=rotation)
        del joints[name], parts[name]
    if parts[root].mass_kg == 0:
        # A bolted root needs no mass of its own; engines want a number.
        parts[root] = replace(parts[root], mass_kg=1.0, inertia_kg_m2=(1e-3, 1e-3, 1e-3, 0.0, 0.0, 0.0))
    return list(parts.values()), [joints[name] for name in parts if name != root]


def _moved_shape(at: NDArray[np.float64], shape: Shape) -> Shape:
    position, rotation = _split(compose(at, _pose(shape.position_m, shape.rotation)))
    return replace(shape, position_m=position, rotation=rotation)


def _pose(position: Vec3, rotation: Quat) -> NDArray[np.float64]:
    return np.array([*position, *rotation])


def _split(pose: NDArray[np.float64]) -> tuple[Vec3, Quat]:
    x, y, z, a, b, c, d = (float(v) for v in pose)
    return (x, y, z), (a, b, c, d)
