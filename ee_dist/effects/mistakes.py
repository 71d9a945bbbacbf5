"""What a description or a mapping may have the wrong way round: no robot catches it, and any way of comparing tells it.

They have no values. A model with one of them is right at once, but the file is where it belongs: each says where to mend it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from ee_dist.basics.altered import altered
from ee_dist.effects.catalogue import effect
from ee_dist.effects.targets import has_few_joints, is_bolted, joint_pairs, motors, powered, takes_torques
from ee_dist.robots.kinematics import quat_multiply
from ee_dist.robots.model import Quat, Robot


@effect(
    "axis_reversed",
    family="body",
    targets=motors,
    physics="A joint turns the other way than the description says: its axis points backwards in the file, or its encoder counts "
    "the other way. Where position zero is stays, and the stops are those of both ways. Mend the axis in the description, or "
    "put 'sign: -1' on the joint's columns in the mapping: position, speed, torque and command.",
    signature="The weight of what the joint carries, and what it does to the joints before it, come with the other sign.",
    mistake=True,
)
def axis_reversed(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    joint = robot.joint(target)
    x, y, z = (0.0 - a for a in joint.axis)
    ends = min(joint.lower, -joint.upper), max(joint.upper, -joint.lower)
    return robot.with_joint(target, axis=(x, y, z), lower=ends[0], upper=ends[1])


@effect(
    "joints_swapped",
    family="body",
    targets=joint_pairs,
    physics="Two joints have each other's place: their columns are exchanged in the log or the mapping, or their names in the "
    "description. Mend it there: positions, speeds, torques and commands alike.",
    signature="Each of two joints does what the other one should, and what they do to the joints between them fits neither.",
    worth_proposing=has_few_joints,
    mistake=True,
)
def joints_swapped(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    one, two = target.split("+")
    other = {one: two, two: one}
    joints = tuple(altered(j, name=other.get(j.name, j.name)) for j in robot.joints)
    # The drive goes with its joint, and the order of the channels stays that of the names.
    own = {d.joint: d for d in robot.drives}
    drives = tuple(altered(own[other.get(d.joint, d.joint)], joint=d.joint) for d in robot.drives)
    return altered(robot, joints=joints, drives=drives)


@effect(
    "command_reversed",
    family="drive",
    targets=powered,
    physics="The motor turns the other way than it is told to: its two wires are swapped, or the command was logged with the "
    "other sign. Put 'sign: -1' on the joint's command in the mapping. Which way a joint goes that is told a position or a speed "
    "is seen without a model.",
    signature="Whatever the commands do to the motion they do the other way round.",
    worth_proposing=takes_torques,
    mistake=True,
)
def command_reversed(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    return robot.map_drive(target, lambda d: altered(d, command_gain=-d.command_gain))


_HALF = math.sqrt(0.5)
TURNS: Mapping[str, Quat] = {
    "x_up": (0.0, -_HALF, 0.0, _HALF),
    "x_down": (0.0, _HALF, 0.0, _HALF),
    "y_up": (_HALF, 0.0, 0.0, _HALF),
    "y_down": (-_HALF, 0.0, 0.0, _HALF),
    "upside_down": (1.0, 0.0, 0.0, 0.0),
}
"""How a base that is described upright may be bolted on otherwise: by which of its axes points up or down."""


def _sides(robot: Robot) -> tuple[str, ...]:
    return () if robot.free_base else tuple(TURNS)


@effect(
    "base_turned",
    family="world",
    targets=_sides,
    physics="The base is bolted on by another side than described, to a wall or a ceiling, or the file has another axis up: "
    "gravity pulls along another axis of it. Mend it in the file, by a fixed joint or body that carries the base turned.",
    signature="All that weight does to the joints is wrong at once, and right again if gravity comes from a quarter of a turn or "
    "half a turn away.",
    worth_proposing=is_bolted,
    mistake=True,
)
def base_turned(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    x, y, z, w = map(float, quat_multiply(np.array(TURNS[target]), np.array(robot.start_rotation)))
    return altered(robot, start_rotation=(x, y, z, w)).with_world(has_floor=False)
