"""A robot's body as a URDF: links, joints, limits, primitives. What drives it is in the controller shim."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ee_dist.robots.mass_matrix import rotation_matrix
from ee_dist.robots.model import CONTINUOUS_M, CONTINUOUS_RAD, NO_TURN, ZERO3, Joint, Part, Quat, Robot, Shape
from ee_dist.robots.ranges import top_speed, top_torque
from ee_dist.robots.urdf import WORLD

_KINDS = {"hinge": "revolute", "slide": "prismatic", "fixed": "fixed"}


def urdf_text(robot: Robot) -> str:
    """The parts that are present. Friction and damping are 0: the shim has them, and would count them twice."""
    mounted = not robot.free_base and (robot.start_position_m, robot.start_rotation) != (ZERO3, NO_TURN)
    if mounted and robot.root.name == WORLD:
        robot = _with_root(robot, _unused("base", [part.name for part in robot.parts]))
    root = ET.Element("robot", name=robot.name)
    for part in robot.present_parts:
        _link(root, part)
    if mounted:
        _mount(root, robot)
    for joint in robot.present_joints:
        _joint(root, robot, joint)
    ET.indent(root)
    return '<?xml version="1.0"?>\n' + ET.tostring(root, encoding="unicode") + "\n"


def _mount(root: ET.Element, robot: Robot) -> None:
    """A world that the robot is bolted to, for how it stands decides what gravity does to it."""
    world = _unused(WORLD, [part.name for part in robot.present_parts])
    ET.SubElement(root, "link", name=world)
    name = _unused("mount", [joint.name for joint in robot.present_joints])
    element = ET.SubElement(root, "joint", name=name, type="fixed")
    ET.SubElement(element, "origin", xyz=_text(robot.start_position_m), rpy=_text(rpy_of(robot.start_rotation)))
    ET.SubElement(element, "parent", link=world)
    ET.SubElement(element, "child", link=robot.root.name)


def _with_root(robot: Robot, name: str) -> Robot:
    """The body with another name of its root: a simulator takes "world" for its own, which cannot stand elsewhere."""
    joints = tuple(replace(j, parent=name) if j.parent == robot.root.name else j for j in robot.joints)
    return replace(robot, parts=(replace(robot.root, name=name), *robot.parts[1:]), joints=joints)


def _unused(name: str, taken: Sequence[str]) -> str:
    while name in taken:
        name += "_"
    return name


def _link(root: ET.Element, part: Part) -> None:
    link = ET.SubElement(root, "link", name=part.name)
    inertial = ET.SubElement(link, "inertial")
    ET.SubElement(inertial, "origin", xyz=_text(part.com_m), rpy="0 0 0")
    ET.SubElement(inertial, "mass", value=repr(part.mass_kg))
    keys = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
    ET.SubElement(inertial, "inertia", {k: repr(v) for k, v in zip(keys, part.inertia_kg_m2, strict=True)})
    for shape in part.shapes:
        for tag in ("collision", "visual"):
            element = ET.SubElement(link, tag)
            ET.SubElement(element, "origin", xyz=_text(shape.position_m), rpy=_text(rpy_of(shape.rotation)))
            _geometry(ET.SubElement(element, "geometry"), shape)


def _geometry(element: ET.Element, shape: Shape) -> None:
    if shape.kind == "box":
        ET.SubElement(element, "box", size=_text([2 * v for v in shape.size]))
    elif shape.kind == "sphere":
        ET.SubElement(element, "sphere", radius=repr(shape.size[0]))
    else:
        ET.SubElement(element, shape.kind, radius=repr(shape.size[0]), length=repr(shape.size[1]))


def _joint(root: ET.Element, robot: Robot, joint: Joint) -> None:
    endless = joint.kind == "hinge" and joint.upper - joint.lower >= 2 * CONTINUOUS_RAD
    element = ET.SubElement(root, "joint", name=joint.name, type="continuous" if endless else _KINDS[joint.kind])
    ET.SubElement(element, "origin", xyz=_text(joint.position_m), rpy=_text(rpy_of(joint.rotation)))
    ET.SubElement(element, "parent", link=joint.parent)
    ET.SubElement(element, "child", link=joint.child)
    if joint.kind == "fixed":
        return
    ET.SubElement(element, "axis", xyz=_text(joint.axis))
    drive = next((d for d in robot.drives if d.joint == joint.name), None)
    limit = {
        "velocity": repr(top_speed(joint, drive)),
        "effort": repr(0.0 if drive is None else top_torque(robot, drive)),
    }
    if not endless:
        far = CONTINUOUS_M if joint.kind == "slide" else CONTINUOUS_RAD
        limit |= {"lower": repr(max(joint.stops[0], -far)), "upper": repr(min(joint.stops[1], far))}
    ET.SubElement(element, "limit", limit)


def rpy_of(turn: Quat) -> tuple[float, float, float]:
    """URDF's roll, pitch, yaw (rad) about fixed axes of a quaternion, scalar last."""
    m = rotation_matrix(turn)
    pitch = math.asin(min(1.0, max(-1.0, -float(m[2, 0]))))
    if abs(m[2, 0]) < 1 - 1e-12:
        return math.atan2(m[2, 1], m[2, 2]), pitch, math.atan2(m[1, 0], m[0, 0])
    return 0.0, pitch, math.atan2(-m[0, 1], m[1, 1])


def _text(values: Sequence[float]) -> str:
    return " ".join(repr(float(np.float64(v))) for v in values)
