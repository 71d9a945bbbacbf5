"""MuJoCo's actuators, passive joint forces and sensors as drives and sensors.

An actuator on a joint with gear g makes the torque g * (G * ctrl + b0 + b1 * g * q + b2 * g * speed). With b1 < 0 that is a
position controller with kp = -b1 g^2, kd = -b2 g^2; with b2 = -G alone a speed controller with kp = G g^2; with neither, torque.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import mujoco

from ee_dist.basics.names import listed
from ee_dist.robots.model import Sensor

NEAR = 1e-3
"""rad (m) by which a range of commands may be narrower than that of the joint: people round."""
Fields = dict[str, float | str]
_JOINT = (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT))
_S = mujoco.mjtSensor
_FIXED = int(mujoco.mjtGain.mjGAIN_FIXED)
_NO_BIAS, _AFFINE = int(mujoco.mjtBias.mjBIAS_NONE), int(mujoco.mjtBias.mjBIAS_AFFINE)
_NO_DYNAMICS = int(mujoco.mjtDyn.mjDYN_NONE)
_FILTERS = (_NO_DYNAMICS, int(mujoco.mjtDyn.mjDYN_FILTER), int(mujoco.mjtDyn.mjDYN_FILTEREXACT))


def drives_of(m: Any, joints: Mapping[int, str]) -> tuple[dict[str, Fields], tuple[str, ...], list[str]]:
    """Fields of the drive of each joint by name, the joints that need one, and notes. ``joints`` are names by MuJoCo's number."""
    found: dict[str, Fields] = {name: _passive(m, j) for j, name in joints.items()}
    notes: list[str] = []
    skipped: list[str] = []
    further: list[str] = []
    actuated: dict[str, str] = {}
    for a in range(m.nu):
        label = mujoco.mj_id2name(m, mujoco.mjtObj.mjOBJ_ACTUATOR, a) or f"actuator_{a}"
        name = joints.get(int(m.actuator_trnid[a, 0])) if int(m.actuator_trntype[a]) in _JOINT else None
        law = None if name is None else _law(m, a)
        if name is None or law is None:
            skipped.append(label)
        elif name not in actuated:
            actuated[name] = label
            found[name] = _combined(found[name], law, m, a, label, notes)
        elif law["command"] == "speed" and found[name]["command"] == "position":
            found[name]["kd"] = float(found[name]["kd"]) + float(law["kp"])
            notes.append(f"actuator {label} is taken as damping of {actuated[name]}: its own command as 0")
        else:
            further.append(label)
    if further:
        notes.append(f"actuators left out (only one drive of a joint is read, the first): {', '.join(further)}")
    if skipped:
        notes.append(f"actuators left out (not one of a joint, or of no known law): {', '.join(skipped)}")
    if skipped and (loose := [n for n, fields in found.items() if "command" not in fields]):
        notes.append(f"joints that nothing drives here, and that swing: {listed(loose)}")
    # Where the file drives some joints, it leaves the others to swing on purpose.
    driven = tuple(n for n, fields in found.items() if m.nu or any(k != "torque_limit" for k in fields))
    for name in driven:
        found[name].setdefault("command", "none")
        found[name].setdefault("torque_limit", math.inf)
    return found, driven, notes


def _passive(m: Any, j: int) -> Fields:
    """What acts on the joint whatever is commanded; only what is not zero. An actuator's own armature and damping come through
    its gear."""
    dof, at = int(m.jnt_dofadr[j]), int(m.jnt_qposadr[j])
    on = [a for a in range(m.nu) if int(m.actuator_trntype[a]) in _JOINT and int(m.actuator_trnid[a, 0]) == j]
    values = {
        "viscous": float(m.dof_damping[dof]) + _geared(m, on, m.actuator_damping),
        "coulomb": float(m.dof_frictionloss[dof]),
        "rotor_inertia": float(m.dof_armature[dof]) + _geared(m, on, m.actuator_armature),
        "spring": float(m.jnt_stiffness[j]),
    }
    found: Fields = {k: v for k, v in values.items() if v}
    if "spring" in found:
        found["spring_rest"] = float(m.qpos_spring[at])
    if m.jnt_limited[j]:
        found.setdefault("coulomb", 0.0)  # a joint with stops needs a drive to have them
    if m.jnt_actfrclimited[j]:
        found["torque_limit"] = max(abs(float(v)) for v in m.jnt_actfrcrange[j])
    return found


def _geared(m: Any, actuators: Sequence[int], values: Any) -> float:
    return sum(float(m.actuator_gear[a, 0] ** 2 * values[a]) for a in actuators)


def _law(m: Any, a: int) -> Fields | None:
    """The law of an actuator at its joint; None for one that has no place here."""
    kinds = int(m.actuator_gaintype[a]), int(m.actuator_biastype[a]), int(m.actuator_dyntype[a])
    if kinds[0] != _FIXED or kinds[1] not in (_NO_BIAS, _AFFINE) or kinds[2] not in _FILTERS:
        return None
    gear, gain = float(m.actuator_gear[a, 0]), float(m.actuator_gainprm[a, 0])
    b0, b1, b2 = (float(v) for v in m.actuator_biasprm[a, :3])
    if kinds[1] == _NO_BIAS:
        b0 = b1 = b2 = 0.0
    if gear == 0 or b1 > 0 or b2 > 0:
        return None
    law: Fields = {"command": "torque", "kp": 0.0, "kd": 0.0}
    unit = gear * gain
    if b1 < 0:
        law, unit = {"command": "position", "kp": -b1 * gear**2, "kd": -b2 * gear**2}, -gain / (b1 * gear)
    elif b2 < 0 and gain == -b2:
        law, unit = {"command": "speed", "kp": gain * gear**2}, 1 / gear
    elif b2 < 0:
        law["viscous"] = -b2 * gear**2
    if b0:
        law["offset_torque"] = gear * b0
    return law | {"unit": unit}


def _combined(passive: Fields, law: Fields, m: Any, a: int, label: str, notes: list[str]) -> Fields:
    unit = float(law.pop("unit"))
    viscous = float(passive.get("viscous", 0.0)) + float(law.pop("viscous", 0.0))
    found = passive | law | ({"viscous": viscous} if viscous else {})
    if not math.isclose(unit, 1.0, rel_tol=1e-9):
        what = {"position": "the joint's position", "speed": "the joint's speed"}.get(
            str(law["command"]), "torque at the joint"
        )
        notes.append(f"actuator {label}: commands here are {what}, {unit:.6g} times MuJoCo's ctrl")
    if int(m.actuator_dyntype[a]) != _NO_DYNAMICS:
        notes.append(f"actuator {label}: its filter of {float(m.actuator_dynprm[a, 0]):g} s is left out")
    gear = abs(float(m.actuator_gear[a, 0]))
    limits = [float(v) for v in (found.get("torque_limit"),) if v is not None]
    if m.actuator_forcelimited[a]:
        limits.append(gear * max(abs(float(v)) for v in m.actuator_forcerange[a]))
    if m.actuator_ctrllimited[a] and law["command"] == "torque":
        limits.append(abs(unit) * max(abs(float(v)) for v in m.actuator_ctrlrange[a]))
    if limits:
        found["torque_limit"] = min(limits)
    if m.actuator_delay[a] > 0:
        found["delay_s"] = float(m.actuator_delay[a])
    notes += [f"actuator {label}: {what}" for what in _not_kept(found, unit, m, a)]
    return found


def _not_kept(found: Fields, unit: float, m: Any, a: int) -> Iterator[str]:
    """What of an actuator's limits a drive has no place for."""
    command, j = found["command"], int(m.actuator_trnid[a, 0])
    torques = [m.actuator_forcerange[a]] if m.actuator_forcelimited[a] else []
    torques += [m.actuator_ctrlrange[a]] if m.actuator_ctrllimited[a] and command == "torque" else []
    torques += [m.jnt_actfrcrange[j]] if m.jnt_actfrclimited[j] else []
    if any(low != -high for low, high in torques):
        yield "its torque is not limited alike both ways: the larger limit is taken for both"
    if "offset_torque" in found and "torque_limit" in found:
        yield "its constant torque is not part of what its limit holds down"
    if m.actuator_ctrllimited[a] and command in ("position", "speed"):
        low, high = sorted(unit * float(v) for v in m.actuator_ctrlrange[a])
        least, most = (float(v) for v in m.jnt_range[j]) if m.jnt_limited[j] else (-math.inf, math.inf)
        if command == "speed" or low > least + NEAR or high < most - NEAR:
            yield f"commands here may leave its ctrlrange, {low:.4g} to {high:.4g} at the joint"


def sensors_of(
    m: Any, joints: Mapping[int, str], parts: set[str], body_name: Callable[[int], str]
) -> tuple[tuple[Sensor, ...], list[str]]:
    """The sensors of joints and touch that the file has, and a note of others."""
    found: list[Sensor] = []
    others: list[str] = []
    kinds = {
        int(_S.mjSENS_JOINTPOS): "position",
        int(_S.mjSENS_JOINTVEL): "velocity",
        int(_S.mjSENS_JOINTACTFRC): "motor_torque",
        int(_S.mjSENS_ACTUATORPOS): "position",
        int(_S.mjSENS_ACTUATORVEL): "velocity",
        int(_S.mjSENS_ACTUATORFRC): "motor_torque",
    }
    units = {"position": ("rad", "m"), "velocity": ("rad/s", "m/s"), "motor_torque": ("N.m", "N")}
    for s in range(m.nsensor):
        label = mujoco.mj_id2name(m, mujoco.mjtObj.mjOBJ_SENSOR, s) or f"sensor_{s}"
        kind, target = kinds.get(int(m.sensor_type[s])), int(m.sensor_objid[s])
        if kind and int(m.sensor_objtype[s]) == int(mujoco.mjtObj.mjOBJ_ACTUATOR):
            direct = int(m.actuator_trntype[target]) in _JOINT and m.actuator_gear[target, 0] == 1.0
            target = int(m.actuator_trnid[target, 0]) if direct else -1
        noise = float(m.sensor_noise[s])
        if kind and target in joints:
            slide = int(m.jnt_type[target]) == int(mujoco.mjtJoint.mjJNT_SLIDE)
            found.append(Sensor(label, kind, joints[target], units[kind][slide], noise=noise))
        elif int(m.sensor_type[s]) == int(_S.mjSENS_TOUCH) and (part := body_name(int(m.site_bodyid[target]))) in parts:
            found.append(Sensor(label, "touch", part))
        else:
            others.append(label)
    note = [
        f"sensors left out (not of a joint or touch): {', '.join(others[:6])}" + (" ..." if len(others) > 6 else "")
    ]
    return tuple(found), note if others else []
