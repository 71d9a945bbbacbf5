"""An MJCF as parts and joints, by MuJoCo's own reader and compiler, so that defaults, classes and units are what it says.

What a robot here has no place for (tendons, equality constraints, meshes that touch, muscles) is left out and said.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from ee_dist.basics.names import listed
from ee_dist.basics.quoted import quoted
from ee_dist.engines.mujoco.mjcf_bare import MjcfError, bare_model
from ee_dist.engines.mujoco.mjcf_drives import drives_of, sensors_of
from ee_dist.engines.mujoco.mjcf_floor import floor_of
from ee_dist.engines.mujoco.mjcf_left_out import carries_all, left_out
from ee_dist.robots.body import Body
from ee_dist.robots.fold import DUMMY_KG, entries, folded, posed
from ee_dist.robots.kinematics import quat_multiply, quat_rotate
from ee_dist.robots.mass_matrix import rotation_matrix
from ee_dist.robots.model import (
    CONTINUOUS_M,
    CONTINUOUS_RAD,
    NO_TURN,
    ZERO3,
    Joint,
    Part,
    Quat,
    Shape,
    Vec3,
)
from ee_dist.trials.log import Array

LINK_KG, LINK_KG_M2 = 1e-5, 1e-9
"""Of the link between two joints that MJCF puts on one body: less than shows, more than rounding."""
_KINDS = {int(mujoco.mjtJoint.mjJNT_HINGE): "hinge", int(mujoco.mjtJoint.mjJNT_SLIDE): "slide"}
_FREE, _BALL = (int(k) for k in (mujoco.mjtJoint.mjJNT_FREE, mujoco.mjtJoint.mjJNT_BALL))
_SHAPES = {
    int(mujoco.mjtGeom.mjGEOM_BOX): "box",
    int(mujoco.mjtGeom.mjGEOM_SPHERE): "sphere",
    int(mujoco.mjtGeom.mjGEOM_CAPSULE): "capsule",
    int(mujoco.mjtGeom.mjGEOM_CYLINDER): "cylinder",
}


def read_mjcf(path: str | Path) -> Body:
    """The body that an MJCF describes, with a drive for each actuator of a joint. Raises MjcfError."""
    m, untouching, stepped = bare_model(path)
    return _Reader(Path(path), m, stepped, untouching).body()


@dataclass
class _Reader:
    """Reads a compiled model. ``at`` is by body where the part's frame lies in MuJoCo's frame of the body."""

    file: Path
    m: Any
    stepped: bool
    """Whether the file names a time step."""
    untouching: Counter[int] = field(default_factory=Counter)
    """By body how many shapes would touch the floor, but have none of the forms that do."""
    notes: list[str] = field(default_factory=list)
    assumed: list[str] = field(default_factory=list)
    parts: dict[str, Part] = field(default_factory=dict)
    carried: dict[str, Joint] = field(default_factory=dict)
    at: dict[int, Array] = field(default_factory=dict)
    joints: dict[int, str] = field(default_factory=dict)

    def body(self) -> Body:
        m = self.m
        self.key = m.key_qpos[0] if m.nkey else None
        free = [j for j in range(m.njnt) if m.jnt_type[j] == _FREE]
        tops = [b for b in range(1, m.nbody) if m.body_parentid[b] == 0]
        if not tops:
            raise MjcfError(
                f"{self.file}: no <body> within its <worldbody>; a part that others include is no robot by itself"
            )
        if (m.jnt_type == _BALL).any():
            j = int(np.argmax(m.jnt_type == _BALL))
            raise MjcfError(f"{self.file}: joint {quoted(self.name(j, 'joint'))} is a ball; write it as three hinges")
        if free and (len(free) > 1 or len(tops) > 1 or m.body_parentid[m.jnt_bodyid[free[0]]] != 0):
            raise MjcfError(f"{self.file}: several bodies of which some move freely; name the file of the robot alone")
        start: tuple[Vec3, Quat] = (ZERO3, NO_TURN)
        if len(tops) == 1 and (free or m.body_jntnum[tops[0]] == 0):
            root = self.name(tops[0], "body")
            placed = (
                self.key[:7]
                if free and self.key is not None
                else np.array([*m.body_pos[tops[0]], *m.body_quat[tops[0]]])
            )
            start = _vec(placed[:3]), _turn(placed[3:])
        else:
            root = "world"
            self.parts[root] = Part(root, 0.0, ZERO3, (0.0,) * 6)
            self.at[0] = np.zeros(3)
        self.floor, said = floor_of(m)
        for b in range(1, m.nbody):
            self.add(b, root)
        parts, joints, own, given, idle = folded(self.parts, self.carried, root)
        if own != (ZERO3, NO_TURN):
            start = posed(start, own)
        if self.floor is not None:
            (x, y, z), turn = start
            start = (x, y, z - self.floor.height_at((x, y, z))), turn
        if idle:
            raise MjcfError(f"{self.file}: body {quoted(idle[0])}: no mass, but a joint moves it")
        present = {j.name for j in joints}
        names = {j: n for j, n in self.joints.items() if n in present}
        self.notes += said
        drives, driven, said = drives_of(m, names)
        self.notes += said
        sensors, said = sensors_of(m, names, {p.name for p in parts}, lambda b: self.name(b, "body"))
        self.notes += said
        has_floor = bool(free) or self.floor is not None
        self.say_what_is_left_out(has_floor)
        weightless = int(m.opt.disableflags) & int(mujoco.mjtDisableBit.mjDSBL_GRAVITY)
        gravity = np.zeros(3) if weightless else np.array(m.opt.gravity)
        if gravity[:2].any():
            self.notes.append("gravity is not straight down: only its vertical share is taken")
        carried = bool(gravity.any()) and carries_all(m)
        if carried:
            self.notes.append("the file compensates the weight of all bodies that move (gravcomp): gravity_m_s2 is 0")
        return Body(
            name=m.names[: m.names.index(b"\0")].decode() or self.file.stem,
            parts=tuple(parts),
            joints=tuple(joints),
            drives=drives,
            driven=driven,
            sensors=sensors,
            root_without_mass=parts[0].name in given,
            free_base=bool(free),
            has_floor=has_floor,
            gravity_m_s2=0.0 if carried else float(-gravity[2]) + 0.0,
            weight_carried=carried,
            time_step_s=float(m.opt.timestep) if self.stepped else None,
            start_position_m=start[0],
            start_rotation=start[1],
            notes=(*self.notes, *self.assumed),
            assumed=tuple(self.assumed),
        )

    def name(self, k: int, what: str) -> str:
        kind = mujoco.mjtObj.mjOBJ_BODY if what == "body" else mujoco.mjtObj.mjOBJ_JOINT
        return mujoco.mj_id2name(self.m, kind, k) or f"{what}_{k}"

    # -- bodies ------------------------------------------------------------------------------------------------------

    def add(self, b: int, root: str) -> None:
        """A body as a part, with its joint; of several joints each but the last carries a link of next to no mass."""
        m, name = self.m, self.name(b, "body")
        first = int(m.body_jntadr[b])
        own = [j for j in range(first, first + int(m.body_jntnum[b])) if m.jnt_type[j] != _FREE]
        origin = np.array(m.jnt_pos[own[-1]]) if own else np.zeros(3)
        self.at[b] = origin
        self.parts[name] = self.part(b, name, origin)
        if name == root:
            return
        parent = int(m.body_parentid[b])
        above, turn = self.name(parent, "body") if parent else root, _turn(m.body_quat[b])
        place, back = np.array(m.body_pos[b]) - self.at[parent], np.zeros(3)
        if not own:
            self.carried[name] = Joint(
                f"{name} bond", "fixed", above, name, _vec(place), (1.0, 0.0, 0.0), 0.0, 0.0, turn
            )
            return
        for j in own:
            child = name if j == own[-1] else f"{name} before {self.name(own[own.index(j) + 1], 'joint')}"
            if child != name:
                inertia = (LINK_KG_M2,) * 3 + (0.0,) * 3
                self.parts[child] = Part(child, LINK_KG, ZERO3, inertia)
            here = place + quat_rotate(np.array(turn), np.array(m.jnt_pos[j]) - back)
            self.carried[child] = self.joint(j, above, child, here, turn)
            above, place, turn, back = child, np.zeros(3), NO_TURN, np.array(m.jnt_pos[j])
        if len(own) > 1:
            # Parts come in the order in which they carry one another.
            self.parts[name] = self.parts.pop(name)

    def joint(self, j: int, parent: str, child: str, place: Array, turn: Quat) -> Joint:
        m, kind = self.m, _KINDS[int(self.m.jnt_type[j])]
        name = self.joints[j] = self.name(j, "joint")
        axis, reference = np.array(m.jnt_axis[j]), float(m.qpos0[m.jnt_qposadr[j]])
        if reference and kind == "slide":
            place = place - reference * quat_rotate(np.array(turn), axis)
        elif reference:
            half = -reference / 2
            turn = _quat(quat_multiply(np.array(turn), np.array([*(math.sin(half) * axis), math.cos(half)])))
        far = CONTINUOUS_RAD if kind == "hinge" else CONTINUOUS_M
        lower, upper = (float(v) for v in m.jnt_range[j]) if m.jnt_limited[j] else (-far, far)
        if not lower < upper:
            raise MjcfError(f"{self.file}: joint {quoted(name)}: its range {lower:g} to {upper:g} leaves nothing")
        start = float((m.qpos0 if self.key is None else self.key)[m.jnt_qposadr[j]])
        return Joint(
            name, kind, parent, child, _vec(place), _vec(axis), lower, upper, turn, start=min(max(start, lower), upper)
        )

    def part(self, b: int, name: str, origin: Array) -> Part:
        m = self.m
        axes = rotation_matrix(_turn(m.body_iquat[b]))
        inertia = entries(axes @ np.diag(m.body_inertia[b]) @ axes.T)
        if not np.abs(inertia[3:]).max() > 1e-9 * max(inertia):
            inertia = (*inertia[:3], 0.0, 0.0, 0.0)
        shapes, grip = [], 0.0
        for g in range(m.body_geomadr[b], m.body_geomadr[b] + m.body_geomnum[b]):
            if not (m.geom_contype[g] or m.geom_conaffinity[g]):
                continue
            kind = _SHAPES.get(int(m.geom_type[g]))
            if kind is None:
                self.untouching[b] += 1
                continue
            size = tuple(float(v) for v in m.geom_size[g])
            size = size if kind == "box" else size[:1] if kind == "sphere" else (size[0], 2 * size[1])
            shapes.append(Shape(kind, size, _vec(m.geom_pos[g] - origin), _turn(m.geom_quat[g])))
            own = float(m.geom_friction[g, 0])
            grip = max(grip, own if self.floor is None else self.floor.grip(own, int(m.geom_priority[g])))
        mass = float(m.body_mass[b])
        if mass <= DUMMY_KG:
            part = Part(name, 0.0, ZERO3, (0.0,) * 6, tuple(shapes))
        else:
            part = Part(name, mass, _vec(m.body_ipos[b] - origin), inertia, tuple(shapes))
        return replace(part, grip=grip) if shapes else part

    def say_what_is_left_out(self, has_floor: bool) -> None:
        self.notes += left_out(self.m)
        touching = sum(bool(p.shapes) for p in self.parts.values())
        if not touching:
            self.notes.append(
                "nothing touches the floor: meshes are left out, only boxes, spheres, cylinders and capsules count"
            )
        elif has_floor and (without := [f"{n} of {self.name(b, 'body')}" for b, n in self.untouching.items() if b > 0]):
            self.notes.append(
                f"shapes that touch are left out ({listed(without)}): only boxes, spheres, cylinders and capsules count"
            )


def _vec(values: Any) -> Vec3:
    x, y, z = (float(v) for v in values)
    return x, y, z


def _quat(values: Any) -> Quat:
    x, y, z, w = (float(v) for v in values)
    return x, y, z, w


def _turn(scalar_first: Any) -> Quat:
    w, x, y, z = (float(v) for v in scalar_first)
    return x, y, z, w
