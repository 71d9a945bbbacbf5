"""How each effect leaves the house: native to another simulator, in the controller shim, or not at all.

An effect is judged by what it changes in the robot, so that one of a user's own is judged like ours.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from ee_dist.effects.catalogue import Hypothesis, Term, apply
from ee_dist.engines.drive import stiff_joints
from ee_dist.robots.inertia import felt_inertia, steady_inertia
from ee_dist.robots.model import DRIVE_NUMBERS, Drive, Robot, Sensor

NATIVE, SHIM, NOT = "native", "shim", "not expressible"
ACTUATOR = frozenset({"kp", "kd", "torque_limit", "speed_limit", "strength", "command_gain", "zero_offset", "back_emf"})
"""Of a drive, what an actuator of MuJoCo has: gains, limits, a damping, a bias."""
READING = frozenset({"current_gain", "torque_read_late_s"})
"""Of a drive, what no motion depends on."""
JOINT = frozenset({"rotor_inertia", "viscous", "coulomb", "brake", "spring", "spring_rest", "offset_torque"})
NATIVE_DRIVE: Mapping[str, frozenset[str]] = {
    "mjcf": ACTUATOR | JOINT | READING,
    "urdf": READING,
    "yaml": frozenset(DRIVE_NUMBERS),
    "python": READING,
}
BODY = frozenset({"parts", "joints", "lost"})
MOUNT = frozenset({"start_position_m", "start_rotation"})
"""How a bolted base stands."""
NATIVE_ROBOT: Mapping[str, frozenset[str]] = {
    "mjcf": BODY | {"free_base"} | MOUNT,
    "urdf": BODY | {"free_base"},
    "yaml": frozenset(f.name for f in fields(Robot)),
    "python": frozenset(),
}
NATIVE_WORLD: Mapping[str, frozenset[str]] = {
    "mjcf": frozenset({"gravity_m_s2", "tilt_x_rad", "tilt_y_rad", "friction", "compliance_m_n", "has_floor"}),
    "urdf": frozenset(),
    "yaml": frozenset({"all"}),
    "python": frozenset(),
}
SHIM_WORLD = frozenset({"push_x_n", "push_y_n", "drag_n_s_m", "supply_sag"})


@dataclass(frozen=True)
class Fate:
    """What becomes of one effect of a model, and why."""

    term: Term
    how: str
    why: str


def fates(robot: Robot, terms: Hypothesis, to: str) -> tuple[Fate, ...]:
    """For each effect of a model of ``robot``, in order."""
    found = []
    for t in terms:
        after = apply(robot, [t])
        how, why = _fate(robot, after, to)
        found.append(Fate(t, how, why))
        robot = after
    return tuple(found)


def _fate(before: Robot, after: Robot, to: str) -> tuple[str, str]:
    ways: list[tuple[str, str]] = [(NATIVE, "")]
    for f in fields(Robot):
        old, new = getattr(before, f.name), getattr(after, f.name)
        if old == new:
            continue
        if f.name == "world":
            changed = [w.name for w in fields(new) if getattr(old, w.name) != getattr(new, w.name)]
            ways += [_world(name, to) for name in changed]
        elif f.name == "drives":
            ways += [_drive(name, to) for name in _changed(old, new)]
        elif f.name == "sensors":
            ways.append((NATIVE, "") if to == "yaml" else (SHIM, "sensors report through read()"))
        elif f.name == "wiring":
            ways.append(_wiring(old, new, to))
        elif f.name == "laws":
            ways.append((NATIVE, "") if to == "yaml" else (NOT, "a law of its own code: call that in your loop"))
        elif f.name == "joints" and to != "yaml" and any(a.freedom != b.freedom for a, b in zip(old, new, strict=True)):
            ways.append((SHIM, "stops within the joint's range"))
        elif f.name in NATIVE_ROBOT[to] or (to == "urdf" and f.name in MOUNT and not after.free_base):
            ways.append((NATIVE, ""))
        else:
            ways.append((NOT, f"{to} has no place for {f.name}"))
    return max(ways, key=lambda w: (NATIVE, SHIM, NOT).index(w[0]))


def _changed(old: tuple[Drive, ...], new: tuple[Drive, ...]) -> list[str]:
    return [n for n in DRIVE_NUMBERS if any(getattr(a, n) != getattr(b, n) for a, b in zip(old, new, strict=True))]


def _world(name: str, to: str) -> tuple[str, str]:
    if to == "yaml" or name in NATIVE_WORLD[to]:
        return NATIVE, ""
    if name in SHIM_WORLD:
        return SHIM, "force()" if name != "supply_sag" else ""
    return NOT, f"{to} says nothing of the surroundings: set {name} in your simulator"


def _drive(name: str, to: str) -> tuple[str, str]:
    if name in NATIVE_DRIVE[to]:
        return NATIVE, ""
    if name == "rotor_inertia":
        return NOT, f"{to} has no rotor inertia: set it in your simulator"
    return SHIM, ""


def _wiring(old: Any, new: Any, to: str) -> tuple[str, str]:
    if to == "yaml":
        return NATIVE, ""
    if old.hidden_gain != new.hidden_gain:
        return NOT, "it is inside the network that controls the robot"
    if old.early_s != new.early_s:
        return NOT, "it is of the log, and none of the robot: set lead_s in its mapping"
    return SHIM, "which output drives which motor"


def needs_shim(robot: Robot, to: str) -> bool:
    """Whether what a robot's drives, sensors and surroundings do needs the controller shim beside the file."""
    if to == "yaml":
        return False
    if to != "mjcf":
        return bool(robot.drives)
    neutral = {f.name: f.default for f in fields(Drive)}
    allowed = NATIVE_DRIVE[to]
    special = any(
        getattr(d, n) != neutral[n]
        for d in robot.drives
        for n in DRIVE_NUMBERS
        if n not in allowed and n in _WITH_DEFAULT
    )
    w = robot.world
    plain = tuple(range(len(robot.drives)))
    return (
        special
        or any(d.ki for d in robot.drives)
        or any((w.push_x_n, w.push_y_n, w.drag_n_s_m, w.supply_sag))
        or robot.wiring.source != plain
        or any(j.freedom != 1.0 for j in robot.joints)
        or any(replace(s, name="", kind="", target="", unit="") != _PLAIN_SENSOR for s in robot.sensors)
    )


_WITH_DEFAULT = frozenset(f.name for f in fields(Drive) if isinstance(f.default, float)) - {
    "stribeck_speed",
    "stribeck_load_speed",
    "supply_nominal_v",
}


_PLAIN_SENSOR = Sensor("", "", "", "")


def native_damping(robot: Robot) -> list[float]:
    """N.m.s/rad that a simulator has to take at the end of its step, for controllers too steep for an explicit one."""
    slopes = [{"position": d.kd, "speed": d.kp}.get(d.command, 0.0) * d.strength for d in robot.drives]
    return [s if stiff else 0.0 for s, stiff in zip(slopes, stiff_joints(robot).tolist(), strict=True)]


def parameters(robot: Robot) -> dict[str, Any]:
    """What the shim is made with: plain numbers and lists. A law of a user's own is not in it."""
    present = {j.name for j in robot.present_joints}
    numbers = [f.name for f in fields(Sensor) if isinstance(f.default, float)]
    joints = [robot.joint(d.joint) for d in robot.drives]
    return {
        "time_step_s": robot.time_step_s,
        "joints": list(robot.motor_names),
        "commands": [d.command for d in robot.drives],
        "drive": {n: [float(getattr(d, n)) for d in robot.drives] for n in DRIVE_NUMBERS},
        "stops": [list(map(float, j.ends)) for j in joints],
        "jammed": [j.freedom != 1.0 for j in joints],
        "present": [d.joint in present for d in robot.drives],
        "felt_inertia": np.asarray(felt_inertia(robot)).tolist(),
        "steady_inertia": np.asarray(steady_inertia(robot)).tolist(),
        "native_damping": native_damping(robot),
        "source": list(robot.wiring.source),
        "supply_sag": robot.world.supply_sag,
        "push_n": [robot.world.push_x_n, robot.world.push_y_n, 0.0],
        "drag_n_s_m": robot.world.drag_n_s_m,
        "sensors": list(robot.sensor_names),
        "sensor_kinds": [s.kind for s in robot.sensors],
        "sensor": {n: [float(getattr(s, n)) for s in robot.sensors] for n in numbers},
    }
