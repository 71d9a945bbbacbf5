"""A user's URDF as parts and joints: masses, inertia, limits and collision primitives come from the file.

Units are URDF's own: m, kg, rad. What the file cannot say (drives, sensors, whether the base is bolted down) is said in
a robot description; see ``describe.py``. Meshes are left out, with a note: contact with the floor needs a primitive.
Links without mass are folded into their neighbours; see ``fold.py``.
"""

from __future__ import annotations

import shutil
import xml.etree.ElementTree as ET
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path

from ee_dist.basics.names import listed
from ee_dist.basics.quoted import quoted
from ee_dist.robots.body import Body
from ee_dist.robots.fold import HELPER_KG, HELPER_KG_M2, folded, posed
from ee_dist.robots.model import Joint, Part
from ee_dist.robots.moments import one_direction, refused
from ee_dist.robots.pivots import hints_at_pivots
from ee_dist.robots.urdf_attributes import Attributes, UrdfError
from ee_dist.robots.urdf_joints import Joints
from ee_dist.robots.urdf_links import Links
from ee_dist.robots.xacro import PROGRAM, XacroError, expanded, is_xacro
from ee_dist.robots.xml import XmlError, element_of, read_xml

WORLD = "world"


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
        self.attributes, self.joints, self.links = Attributes(file), Joints(file), Links(file)
        self.fail = self.attributes.fail

    def body(self) -> Body:
        links = {self.attributes.named(e, "link"): e for e in self.root.findall("link")}
        if not links:
            raise self.fail("robot", "no <link> in it")
        elements = {self.attributes.named(e, "joint"): e for e in self.root.findall("joint")}
        self.implicit_world(links)
        carried, order = self.tree(links, [self.joints.joint(name, e, links) for name, e in elements.items()])
        floats = self.unmoored(carried, order)
        parts = self.parts(links, carried, order)
        kept_parts, kept_joints, start, given, idle = folded(parts, {n: carried[n] for n in order[1:]}, order[0])
        if floats is not None:
            start = posed((floats.position_m, floats.rotation), start)
        for name in idle:
            if carried[name].kind != "fixed":
                raise self.fail(f"link {quoted(name)}", self.links.without_mass(name, links[name], carried[name]))
        moments, root_given = self.links.moments, kept_parts[0].name in given
        assumed = [*self.joints.assumed, *self.links.assumed, *moments.assumed()]
        given = [n for n in given if n != kept_parts[0].name]
        if given:
            assumed.append(
                f"helper links without mass get {HELPER_KG:g} kg and {HELPER_KG_M2:g} kg.m^2: {listed(given)}"
            )
        moving = [j.name for j in kept_joints if j.kind != "fixed"]
        of_drives = [(name, elements[name], f"joint {quoted(name)}") for name in moving]
        return Body(
            name=self.root.get("name") or self.file.stem,
            parts=tuple(kept_parts),
            joints=tuple(kept_joints),
            drives={name: self.joints.known(e, where) for name, e, where in of_drives},
            unlimited=tuple(name for name, e, where in of_drives if self.joints.unlimited(e, where)),
            transmissions=tuple(j.get("name", "") for t in self.root.iter("transmission") for j in t.iter("joint")),
            root_without_mass=root_given,
            bolted_only=(*moments.idle, *moments.planar),
            free_base=True if floats is not None else None,
            start_position_m=start[0],
            start_rotation=start[1],
            notes=(*self.notes(kept_parts, kept_joints), *assumed),
            assumed=tuple(assumed),
        )

    def tree(self, links: Collection[str], joints: Sequence[Joint]) -> tuple[dict[str, Joint], list[str]]:
        """The joint that carries each link, and all links in an order in which each follows the one that carries it."""
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
        order = [roots[0]]
        for name in order:
            order.extend(j.child for j in joints if j.parent == name)
        if len(order) != len(links):
            lost = next(name for name in links if name not in order)
            raise self.fail(f"link {quoted(lost)}", f"is not connected to {quoted(roots[0])}: the joints form a loop")
        return carried, order

    def parts(
        self, links: Mapping[str, ET.Element], carried: Mapping[str, Joint], order: Sequence[str]
    ) -> dict[str, Part]:
        still = {order[0]}
        for name in order[1:]:
            if carried[name].kind == "fixed" and carried[name].parent in still:
                still.add(name)
        axes = one_direction(order, carried)
        parts = {
            name: self.links.part(name, links[name], carried.get(name), name in still, axes.get(name)) for name in order
        }
        if unfit := self.links.moments.unfit:
            raise self.fail(f"links {listed(unfit)}", refused())
        return parts

    def notes(self, parts: Sequence[Part], joints: Sequence[Joint]) -> list[str]:
        """What is left out, and what looks wrong."""
        meshes, empty, notes = self.links.meshes, self.links.empty, []
        if meshes:
            notes.append(
                f"collision meshes of {len(meshes)} links left out: only boxes, spheres, cylinders and capsules touch the "
                f"floor ({listed(meshes)})"
            )
        notes += self.joints.notes
        if empty:
            notes.append(f"collision shapes of size 0 left out: {listed(empty)}")
        return notes + hints_at_pivots(parts, joints)

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
