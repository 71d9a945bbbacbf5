"""A robot as an MJCF for MuJoCo by itself: the model that the engine steps here, with actuators, friction, springs and stops."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from ee_dist.engines.halfway import goes_halfway
from ee_dist.engines.mujoco.contact import LEAST_FRICTION, contact
from ee_dist.engines.mujoco.model import Model, _body, _spec, principal
from ee_dist.robots.inertia import felt_inertia
from ee_dist.robots.model import Drive, Robot

_FIXED, _AFFINE = mujoco.mjtGain.mjGAIN_FIXED, mujoco.mjtBias.mjBIAS_AFFINE
DIGITS = 1e-5
"""Share by which the digits of a file may change a number."""
STICKING = (0.99, 0.999, 0.001, 0.5, 2.0)
"""Impedance of dry friction: near 1, or a joint that holds creeps."""


MILD = 0.5
"""Share of a joint's speed that damping may take in a step by Runge-Kutta."""


def mjcf_text(robot: Robot, motors_only: bool, damping: Sequence[float]) -> str:
    """``motors_only``: joints are free of friction, springs and stops, and each has a motor that takes its torque, as the
    controller shim wants it; ``damping`` (M,) N.m.s/rad is what the shim leaves to the simulator."""
    model = Model(robot)
    model.fill(model.numbers(robot))
    spec = _spec(robot)
    spec.modelname, spec.compiler.degree = robot.name, False
    # Here friction, stops and damping are MuJoCo's own, which an engine without a floor leaves out.
    spec.option.disableflags, spec.option.integrator = 0, _integrator(robot)
    spec.option.gravity = model.compiled.opt.gravity
    bodies = {b.name: b for b in spec.bodies}
    joints = {j.name: j for j in spec.joints}
    for part in robot.present_parts:
        body = bodies[_body(part.name)]
        body.mass, body.ipos = part.mass_kg, part.com_m
        moments, body.iquat = principal(part)
        body.inertia = _of_a_body(moments)
    for drive, native in zip(robot.drives, damping, strict=True):
        if drive.joint in joints:
            joint = joints[drive.joint]
            joint.armature = drive.rotor_inertia
            if motors_only:
                joint.damping = _linear(native)
                _actuator(spec, drive.joint, drive.joint, 1.0, (0.0, 0.0, 0.0), math.inf)
            else:
                _native(spec, robot, joint, drive)
    _touch(spec, robot, model)
    _start(spec, robot, model.compiled)
    spec.compile()
    text: str = spec.to_xml()
    return text


def _integrator(robot: Robot) -> mujoco.mjtIntegrator:
    """What goes as the robot does here: MuJoCo has no half steps, and by its others links that swing are 20 mrad off after half a
    second. Runge-Kutta takes damping at the start of a step, which has to be mild."""
    per_step = np.array([d.viscous + d.back_emf * d.strength for d in robot.drives]) * robot.time_step_s
    mild = bool((per_step < MILD * felt_inertia(robot)).all())
    return mujoco.mjtIntegrator.mjINT_RK4 if goes_halfway(robot) and mild else mujoco.mjtIntegrator.mjINT_IMPLICITFAST


def _of_a_body(moments: NDArray[np.float64]) -> NDArray[np.float64]:
    """Moments (3,) that MuJoCo reads back: none above the sum of the other two, in the digits of a file too."""
    order = np.argsort(moments)
    least, middle, most = moments[order]
    out = moments.copy()
    out[order[:2]] += max(0.0, 0.5 * (most * (1.0 + DIGITS) - least - middle))
    return out


def _native(spec: Any, robot: Robot, joint: Any, d: Drive) -> None:
    s = d.strength
    own = d.torque_limit / d.speed_limit if math.isfinite(d.speed_limit) and d.command in ("position", "speed") else 0.0
    joint.damping = _linear(d.viscous + (own + d.back_emf) * s)
    joint.frictionloss = d.coulomb + d.brake
    joint.solimp_friction = STICKING
    joint.solref_friction = (2 * robot.time_step_s, 1.0)
    joint.stiffness, joint.springref = _linear(d.spring), d.spring_rest
    limits = robot.joint(d.joint)
    if math.isinf(limits.ends[1]):
        joint.limited = False
    else:
        # A joint that is jammed within its range is the shim's to hold.
        joint.limited, joint.range = True, (limits.lower, limits.upper)
    if d.command == "position":
        bias = (-d.kp * d.zero_offset * s, -d.kp * s, -d.kd * s)
        _actuator(spec, d.joint, d.joint, d.kp * d.command_gain * s, bias, d.torque_limit * s)
    elif d.command == "speed":
        _actuator(spec, d.joint, d.joint, d.kp * d.command_gain * s, (0.0, 0.0, -d.kp * s), d.torque_limit * s)
    elif d.command == "torque":
        _actuator(spec, d.joint, d.joint, d.command_gain * s, (0.0, 0.0, 0.0), d.torque_limit * s)
    if d.offset_torque:
        _actuator(spec, f"offset of {d.joint}", d.joint, 0.0, (d.offset_torque, 0.0, 0.0), math.inf)


def _linear(slope: float) -> Any:
    """MuJoCo's polynomial of a damping or stiffness."""
    return np.array([slope, 0.0, 0.0])


def _actuator(spec: Any, name: str, joint: str, gain: float, bias: tuple[float, float, float], limit: float) -> None:
    actuator = spec.add_actuator(name=name, target=joint, trntype=mujoco.mjtTrn.mjTRN_JOINT)
    actuator.gaintype, actuator.biastype = _FIXED, _AFFINE
    actuator.gainprm[0], actuator.biasprm[:3] = gain, bias
    if math.isfinite(limit):
        actuator.forcelimited, actuator.forcerange = True, (-limit, limit)


def _touch(spec: Any, robot: Robot, model: Model) -> None:
    """Contact with the floor as the engine has it."""
    m = model.compiled
    # The compiler sorts pairs.
    names = [mujoco.mj_id2name(m, mujoco.mjtObj.mjOBJ_GEOM, int(g)) for g in m.pair_geom2[: m.npair]]
    by_geom = {pair.geomname2: pair for pair in spec.pairs}
    if not by_geom:
        return
    weights = m.body_invweight0[None, model.pair_body, 0]
    found = contact(robot.time_step_s, np.array([robot.world.compliance_m_n]), weights)
    spec.option.impratio = float(found.ratio[0])
    grips = [robot.present_parts[k].grip for k in model.pair_part]
    for k, (name, grip) in enumerate(zip(names, grips, strict=True)):
        pair = by_geom[name]
        pair.solref, pair.solreffriction = found.normal[0, k], found.sliding[0, k]
        pair.solimp = found.impedance[0, k]
        pair.friction[:2] = max(robot.world.friction * grip, LEAST_FRICTION)


def _start(spec: Any, robot: Robot, m: Any) -> None:
    qpos = np.array(m.qpos0)
    for joint in robot.present_joints:
        if joint.kind != "fixed":
            qpos[m.joint(joint.name).qposadr[0]] = joint.start
    spec.add_key(name="start", qpos=qpos)
