"""Shared effects: one effect on a group of joints or sensors with one set of values.

What is wrong with one joint of a robot is often wrong with all of them: the same motors, the same grease, the same
controller. One number for all of them is a simpler explanation than one number each, and the one an engineer would give.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from ee_dist.effects.targets import powered
from ee_dist.robots.model import Drive, Robot
from ee_dist.robots.system import System

ALL_JOINTS = "all_joints"
"""All that have friction, stops or a spring: those with a drive, be it a passive one."""
DRIVEN_JOINTS = "driven_joints"
"""Those that a motor moves, where that is not all: what is of motors and controllers is shared by these."""
OF_A_KIND = {"hinge": "all_hinges", "slide": "all_slides"}
"""Where a robot has both: what is in N.m at the one and in N at the other is no one number."""
WHOLE = (ALL_JOINTS, DRIVEN_JOINTS, *OF_A_KIND.values())
JOIN = "+"
_SETTINGS = tuple(f for f in Drive.__dataclass_fields__ if f != "joint")


def groups(robot: System) -> dict[str, tuple[str, ...]]:
    """Names of groups and their members (two or more): all joints with a drive, those of them that a motor moves, all hinges and
    all slides, joints of equal drives where these differ (named by their members, ``a+b+c``), all parts, all sensors of a
    kind. A system that is no robot has none."""
    if not isinstance(robot, Robot):
        return {}
    joints = _of_joints(robot)
    alike = {JOIN.join(names): names for names in like_joints(robot) if names not in joints.values()}
    return _free(joints | alike | _of_others(robot))


def _of_joints(robot: Robot) -> dict[str, tuple[str, ...]]:
    """All joints with a drive, those of them that a motor moves, all hinges and all slides."""
    joints, driven = robot.motor_names, powered(robot)
    if len(joints) < 2:
        return {}
    found = {ALL_JOINTS: joints}
    if 1 < len(driven) < len(joints):
        found[DRIVEN_JOINTS] = driven
    return found | _of_a_kind(robot)


def _of_others(robot: Robot) -> dict[str, tuple[str, ...]]:
    """All parts, and all sensors of a kind."""
    found = {}
    parts = tuple(p.name for p in robot.parts[0 if robot.free_base else 1 :])
    if len(parts) > 1:
        found["all_parts"] = parts
    for kind in dict.fromkeys(s.kind for s in robot.sensors):
        names = tuple(s.name for s in robot.sensors if s.kind == kind)
        if len(names) > 1:
            found[f"all_{kind}_sensors"] = names
    return found


def _free(found: dict[str, tuple[str, ...]]) -> dict[str, tuple[str, ...]]:
    """Groups of which no member has the name."""
    taken = {n for names in found.values() for n in names}
    return {name: members for name, members in found.items() if name not in taken}


def _of_a_kind(robot: Robot) -> dict[str, tuple[str, ...]]:
    """Two hinges or slides and more, of a robot that has both."""
    of = {name: tuple(m for m in robot.motor_names if robot.joint(m).kind == kind) for kind, name in OF_A_KIND.items()}
    return {name: joints for name, joints in of.items() if 1 < len(joints) < len(robot.motor_names)}


def like_joints(robot: Robot, within: float = 0.0) -> list[tuple[str, ...]]:
    """Driven joints of equal drives, or of drives whose numbers differ by a share ``within`` at most (files that derive a gain
    from a joint's inertia give four equal motors four numbers): each class of two or more, in the order of the robot."""
    alike: list[list[Drive]] = []
    for drive in robot.drives:
        mates = next((c for c in alike if _alike(c[0], drive, within)), None)
        if mates is None:
            alike.append([drive])
        else:
            mates.append(drive)
    return [tuple(d.joint for d in mates) for mates in alike if len(mates) > 1]


def _alike(one: Drive, other: Drive, within: float) -> bool:
    for name in _SETTINGS:
        a, b = getattr(one, name), getattr(other, name)
        near = isinstance(a, float) and isinstance(b, float) and math.isclose(a, b, rel_tol=within)
        if a != b and not near:
            return False
    return True


def name_of(robot: System, members: tuple[str, ...]) -> str:
    """A place or several as one target: the name of their group if they have one; empty for none."""
    named = {of: name for name, of in groups(robot).items()}
    return named.get(members, JOIN.join(members))


def members_of(robot: System, target: str, allowed: tuple[str, ...]) -> tuple[str, ...]:
    """The members of a group, or of any list ``a+b+c``, if an effect can act on each of them; empty otherwise."""
    if JOIN in target:
        found = tuple(target.split(JOIN))
    elif isinstance(robot, Robot):
        # Which drives are equal takes a look at each, and names those with a join.
        found = _free(_of_joints(robot) | _of_others(robot)).get(target, ())
    else:
        found = ()
    return found if set(found) <= set(allowed) else ()


def shared_targets(robot: Robot, allowed: tuple[str, ...]) -> tuple[str, ...]:
    """Groups on which an effect can act that acts on ``allowed`` one by one."""
    able = set(allowed)
    return tuple(name for name, members in groups(robot).items() if set(members) <= able)


def common(ranges: list[Mapping[str, tuple[float, float]]]) -> dict[str, tuple[float, float]]:
    """The range of each parameter that is worth trying at every member."""
    return {name: (max(r[name][0] for r in ranges), min(r[name][1] for r in ranges)) for name in ranges[0]}
