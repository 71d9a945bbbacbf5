"""A MuJoCo model of a robot: compiled once per structure, with numbers that are filled in per robot.

The structure of a robot is what MuJoCo's compiler turns into addresses and flags: parts, joints, shapes, touch sensors.
Everything else that an effect may change (masses, centres of mass, inertias, rotor inertias, where joints are and about what
they turn, gravity, friction, give of the floor) is a row of numbers, so that a batch of different robots needs one compiled
model and an array. No robot can be felt by those that share its structure: each of these rows is filled in for each.

Joints have no limits, springs or damping here: those are in the drive path. Only the floor is touched, through one
explicit contact pair per shape, which spares the search for colliding shapes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from ee_dist.basics.quoted import quoted
from ee_dist.engines.contract import EngineError
from ee_dist.engines.drive import stiff_joints
from ee_dist.engines.loop import gravity_vector
from ee_dist.engines.mujoco.contact import MARGIN_M
from ee_dist.robots.model import Part, Quat, Robot
from ee_dist.trials.log import Array

_JOINTS = {"hinge": mujoco.mjtJoint.mjJNT_HINGE, "slide": mujoco.mjtJoint.mjJNT_SLIDE}
_SHAPES = {
    "box": mujoco.mjtGeom.mjGEOM_BOX,
    "sphere": mujoco.mjtGeom.mjGEOM_SPHERE,
    "capsule": mujoco.mjtGeom.mjGEOM_CAPSULE,
    "cylinder": mujoco.mjtGeom.mjGEOM_CYLINDER,
}
_OFF = mujoco.mjtDisableBit
UNUSED = (
    _OFF.mjDSBL_EQUALITY
    | _OFF.mjDSBL_FRICTIONLOSS
    | _OFF.mjDSBL_LIMIT
    | _OFF.mjDSBL_SPRING
    | _OFF.mjDSBL_DAMPER  # but for controllers that are too steep for an explicit step
    | _OFF.mjDSBL_ACTUATION
    | _OFF.mjDSBL_ISLAND
    | _OFF.mjDSBL_AUTORESET
)
"""Stages with nothing to do in these models. Auto-reset would hide a robot that left the finite numbers."""
NOTHING_TO_TOUCH = _OFF.mjDSBL_CONTACT | _OFF.mjDSBL_CONSTRAINT | _OFF.mjDSBL_WARMSTART
"""Further ones of a robot without a floor: the same bits, for a sixth less."""
ROOM, ROOM_A_SQUARE = 2**19, 64
"""Bytes of working memory of such a robot, and more for each square of its joints; its steps take some hundred for each. Left to
itself MuJoCo takes 14 MB for each of hundreds of models, as room for contacts that it cannot have."""
ITERATIONS, LINE_SEARCH = 100, 50
"""Upper bounds, MuJoCo's own. Newton needs 3 or 4 iterations here and 13 at worst; a bound of 20 broke robots apart whose
friction was stiff, and saved nothing."""
ROUNDED = 1e-14
"""By how much a length may be off one."""
TOUCH_REACH_M = 100.0
"""Radius of the zone in which a contact of a part counts as touch: all of it."""
OWN = (
    "opt.gravity",
    "body_mass",
    "body_inertia",
    "body_ipos",
    "body_iquat",
    "dof_armature",
    "body_pos",
    "body_quat",
    "jnt_axis",
)
"""Fields of a model that are each robot's own, besides those of the contact with the floor."""


def structure_key(robot: Robot) -> tuple[Any, ...]:
    """What a compiled model cannot change. Equal keys, equal models up to the patched numbers."""
    lost = set(robot.lost)
    # Whether a part's inertia is centred and aligned decides short cuts in MuJoCo's kinematics.
    floor = robot.world.has_floor
    parts = tuple(
        (p.name, p.shapes if floor else (), any(p.com_m), any(p.inertia_kg_m2[3:]))
        for p in robot.parts
        if p.name not in lost
    )
    # So does a joint that turns about one of the axes of its frame.
    joints = tuple(
        (j.name, j.kind, j.parent, j.child, sum(map(bool, j.axis)) == 1) for j in robot.joints if j.child not in lost
    )
    touch = tuple(s.target for s in robot.sensors if s.kind == "touch")
    return (
        parts,
        joints,
        touch,
        robot.motor_names,
        robot.free_base,
        robot.time_step_s,
        floor,
        bool(stiff_joints(robot).any()),
    )


class Model:
    """A compiled structure and where its numbers are.

    ``motors`` lists the motors whose joint is present, ``qpos`` and ``dof`` their addresses in MuJoCo's positions and
    speeds; ``undriven`` present joints without a motor and their addresses; ``touches`` the touch sensors whose part is
    present, in the order of ``sensordata``.
    """

    def __init__(self, robot: Robot) -> None:
        try:
            self.compiled = _spec(robot).compile()
        except ValueError as error:
            raise EngineError(f"mujoco cannot build {quoted(robot.name)}: {' '.join(str(error).split())}") from error
        m = self.compiled
        self.damped = bool(stiff_joints(robot).any())
        self._scratch = mujoco.MjData(m)
        parts = [p.name for p in robot.present_parts]
        self.bodies = np.array([m.body(_body(name)).id for name in parts])
        self.body_of = dict(zip(parts, self.bodies, strict=True))
        self.root = int(self.bodies[0])
        moving = {j.name for j in robot.present_joints if j.kind != "fixed"}
        self.motors = [k for k, name in enumerate(robot.motor_names) if name in moving]
        joints = [m.joint(robot.motor_names[k]).id for k in self.motors]
        self.qpos = [int(m.jnt_qposadr[j]) for j in joints]
        self.dof = [int(m.jnt_dofadr[j]) for j in joints]
        free = sorted(moving - set(robot.motor_names))
        self.undriven = [(name, int(m.joint(name).qposadr[0])) for name in free]
        self.axes = {j.name: int(m.joint(j.name).id) for j in robot.present_joints if j.kind != "fixed"}
        targets = [s.target for s in robot.sensors if s.kind == "touch"]
        self.touches = [k for k, name in enumerate(targets) if name in parts]
        self.pair_body = m.geom_bodyid[m.pair_geom2] if m.npair else np.zeros(0, dtype=int)
        place = {int(body): k for k, body in enumerate(self.bodies)}
        self.pair_part = [place[int(body)] for body in self.pair_body]
        self._fields = [m.opt.gravity, *(getattr(m, name) for name in OWN[1:])]
        self._blank = [np.array(field) for field in self._fields]

    def numbers(self, robot: Robot) -> list[Array]:
        """The robot's own values of the fields in ``OWN``."""
        gravity, mass, inertia, com, turn, rotor, at, frame, axis = (blank.copy() for blank in self._blank)
        gravity[:] = gravity_vector(robot)
        for body, part in zip(self.bodies, robot.present_parts, strict=True):
            mass[body], com[body] = part.mass_kg, part.com_m
            inertia[body], turn[body] = principal(part)
        for k, dof in zip(self.motors, self.dof, strict=True):
            rotor[dof] = robot.drives[k].rotor_inertia
        if not robot.free_base:
            at[self.root], frame[self.root] = robot.start_position_m, of_length_one(_turn(robot.start_rotation))
        for joint in robot.present_joints:
            body = self.body_of[joint.child]
            at[body], frame[body] = joint.position_m, of_length_one(_turn(joint.rotation))
            if joint.kind != "fixed":
                axis[self.axes[joint.name]] = of_length_one(np.array(_plain(joint.axis)))
        return [gravity + 0.0, mass, inertia, com + 0.0, turn, rotor, at + 0.0, frame, axis]

    def fill(self, numbers: Sequence[Array]) -> None:
        """Make these the numbers of the compiled model, and renew what follows from them."""
        for field, value in zip(self._fields, numbers, strict=True):
            field[:] = value
        mujoco.mj_setConst(self.compiled, self._scratch)


def _spec(robot: Robot) -> Any:
    spec = mujoco.MjSpec()
    option = spec.option
    option.timestep = robot.time_step_s
    option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    option.solver = mujoco.mjtSolver.mjSOL_NEWTON
    option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    option.jacobian = mujoco.mjtJacobian.mjJAC_SPARSE  # a contact moves one limb: a tenth faster than dense
    option.iterations, option.ls_iterations = ITERATIONS, LINE_SEARCH
    stiff = bool(stiff_joints(robot).any())
    option.disableflags = int(UNUSED) & ~(int(_OFF.mjDSBL_DAMPER) if stiff else 0)
    if robot.world.has_floor:
        plane = mujoco.mjtGeom.mjGEOM_PLANE
        spec.worldbody.add_geom(name="floor", type=plane, size=[0, 0, 1], contype=0, conaffinity=0)
    else:
        option.disableflags = option.disableflags | int(NOTHING_TO_TOUCH)
        spec.memory = ROOM + ROOM_A_SQUARE * len(robot.joints) ** 2
        if not (stiff or robot.free_base):
            # Nothing to damp and no tumbling: the same bits, and one solve less.
            option.integrator = mujoco.mjtIntegrator.mjINT_EULER
    carried_by = {j.child: j for j in robot.present_joints}
    bodies: dict[str, Any] = {}
    for part in _parents_first(robot):
        joint = carried_by.get(part.name)
        if joint is None:
            body = spec.worldbody.add_body(
                name=_body(part.name), pos=_plain(robot.start_position_m), quat=_turn(robot.start_rotation)
            )
            if robot.free_base:
                body.add_freejoint(name="free base")
        else:
            body = bodies[joint.parent].add_body(
                name=_body(part.name), pos=_plain(joint.position_m), quat=_turn(joint.rotation)
            )
            if joint.kind != "fixed":
                body.add_joint(name=joint.name, type=_JOINTS[joint.kind], axis=_plain(joint.axis))
        bodies[part.name] = body
        body.explicitinertial = True
        body.mass, body.inertia = 1.0, [1.0, 1.0, 1.0]
        body.ipos = [0.1 if any(part.com_m) else 0.0, 0.0, 0.0]
        body.iquat = [0.8, 0.6, 0.0, 0.0] if any(part.inertia_kg_m2[3:]) else [1.0, 0.0, 0.0, 0.0]
        _add_shapes(spec, body, part, robot)
    for sensor in robot.sensors:
        if sensor.kind == "touch" and sensor.target in bodies:
            name = f"touch of {sensor.name}"
            sphere = mujoco.mjtGeom.mjGEOM_SPHERE
            bodies[sensor.target].add_site(name=name, type=sphere, size=[TOUCH_REACH_M, 0, 0])
            spec.add_sensor(
                name=name, type=mujoco.mjtSensor.mjSENS_TOUCH, objtype=mujoco.mjtObj.mjOBJ_SITE, objname=name
            )
    return spec


def _body(part: str) -> str:
    """The name of a part's body: MuJoCo keeps "world" to itself."""
    return "world " if part == "world" else part


def _parents_first(robot: Robot) -> Sequence[Part]:
    """The present parts, each after the part that carries it."""
    parent = {j.child: j.parent for j in robot.present_joints}

    def depth(part: Part) -> int:
        name, steps = part.name, 0
        while name in parent:
            name, steps = parent[name], steps + 1
        return steps

    return sorted(robot.present_parts, key=depth)


def _add_shapes(spec: Any, body: Any, part: Part, robot: Robot) -> None:
    for k, shape in enumerate(part.shapes if robot.world.has_floor else ()):
        size = [0.0, 0.0, 0.0]
        size[: len(shape.size)] = shape.size
        if shape.kind in ("capsule", "cylinder"):
            size[1] /= 2  # MuJoCo counts half the length
        name = f"{part.name} shape {k}"
        body.add_geom(
            name=name,
            type=_SHAPES[shape.kind],
            size=size,
            pos=_plain(shape.position_m),
            quat=_turn(shape.rotation),
            contype=0,
            conaffinity=0,
        )
        spec.add_pair(geomname1="floor", geomname2=name, condim=3, margin=MARGIN_M)


def _plain(values: Sequence[float]) -> list[float]:
    """No negative zeros: robots that compare equal must give the same bits."""
    return [v + 0.0 for v in values]


def _turn(rotation: Quat) -> Array:
    return scalar_first(np.array(_plain(rotation)))


def of_length_one(vector: Array) -> Array:
    """To the last bit as MuJoCo's compiler makes it so: what is of length one already is left alone."""
    square = 0.0
    for v in vector.tolist():  # One by one: from Python 3.12 on sum() of floats rounds once.
        square += v * v
    length = math.sqrt(square)
    return vector if abs(length - 1.0) <= ROUNDED else vector / length


def scalar_first(rotation: Array) -> Array:
    """MuJoCo's order of quaternions (..., 4)."""
    return np.roll(rotation, 1, axis=-1)


def principal(part: Part) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Principal moments (3,) and the quaternion (4,), scalar first, of their axes."""
    xx, yy, zz, xy, xz, yz = part.inertia_kg_m2
    if not (xy or xz or yz):
        return np.array([xx, yy, zz]), np.array([1.0, 0.0, 0.0, 0.0])
    moments, axes, turn = np.zeros(3), np.zeros(9), np.zeros(4)
    mujoco.mju_eig3(moments, axes, turn, np.array([xx, xy, xz, xy, yy, yz, xz, yz, zz]))
    return moments, turn
