"""Joints that end before the end of their range that is described: at one side, as a jam (transmission.py) is at both."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from ee_dist.effects.catalogue import effect
from ee_dist.effects.effect import Parameter
from ee_dist.effects.scales import Range, drive_of
from ee_dist.effects.targets import stopped_joints
from ee_dist.robots.model import Robot
from ee_dist.trials.log import Array

BEYOND, NEAR = 0.1, 0.05
"""Shares of what is commanded by which commands go beyond the farthest reading, and within which readings are near it,"""
ROWS, MOSTLY = 0.01, 0.8
"""in so many of all rows, and in so many of these: a joint that stops is there as long as it is told to go on."""
AT_END = 0.02
"""Share of a joint's range at its end in which it is at the stop that is described."""
SIDES = {"upper": 1.0, "lower": -1.0}


def _room(robot: Robot, target: str, side: str) -> float:
    """From where a joint begins to its end on one side: a stop before that would throw it. One that begins beyond an end, as a
    knee whose range leaves out zero, begins at that end."""
    joint = robot.joint(target)
    begin = min(max(joint.start, joint.lower), joint.upper)
    return joint.upper - begin if side == "upper" else begin - joint.lower


def _with_room(robot: Robot, side: str) -> tuple[str, ...]:
    return tuple(t for t in stopped_joints(robot) if _room(robot, t, side) > 0)


def _seen(robot: Robot, target: str, told: Array, at: Array, side: str) -> Mapping[str, float]:
    """By how much nearer a stop is, where positions (T,) end while commands (T,), as late as they are, go on; empty where they do
    not."""
    sign, joint = SIDES[side], robot.joint(target)
    if drive_of(robot, target).command != "position" or not len(at):
        return {}
    told, at, end = sign * told, sign * at, max(sign * joint.lower, sign * joint.upper)
    span, top = float(np.ptp(told)), float(at.max())
    beyond = told > top + BEYOND * span
    if top > end - AT_END * (joint.upper - joint.lower) or beyond.mean() < ROWS:
        return {}
    there = at[beyond]
    if np.mean(there > top - NEAR * span) < MOSTLY:
        return {}
    # One reading beyond it is no stop: where they pile up is.
    nearer = end - float(np.median(there[there > top - NEAR * span]))
    return {"nearer_rad": nearer} if nearer <= _room(robot, target, side) else {}


def _upper_seen(robot: Robot, target: str, told: Array, at: Array) -> Mapping[str, float]:
    return _seen(robot, target, told, at, "upper")


def _upper_targets(robot: Robot) -> tuple[str, ...]:
    return _with_room(robot, "upper")


def _upper_ranges(robot: Robot, target: str) -> dict[str, Range]:
    return {"nearer_rad": (0.0, _room(robot, target, "upper"))}


def _lower_seen(robot: Robot, target: str, told: Array, at: Array) -> Mapping[str, float]:
    return _seen(robot, target, told, at, "lower")


def _lower_targets(robot: Robot) -> tuple[str, ...]:
    return _with_room(robot, "lower")


def _lower_ranges(robot: Robot, target: str) -> dict[str, Range]:
    return {"nearer_rad": (0.0, _room(robot, target, "lower"))}


PARAMETERS = (
    Parameter(
        "nearer_rad", "rad", 0.0, math.inf, 0.0, "by how much the joint ends before the end that is described", 0.02
    ),
)
PHYSICS = (
    "The joint ends before the {side} end that is described: at a stop, a cable, or where its controller lets it go no "
    "farther."
)
SIGNATURE = (
    "However far the command goes beyond it, the joint stays there, and comes back as soon as the command does: the residual "
    "is all that was commanded beyond."
)


@effect(
    "upper_stop",
    family="body",
    targets=_upper_targets,
    parameters=PARAMETERS,
    physics=PHYSICS.format(side="upper"),
    signature=SIGNATURE,
    ranges=_upper_ranges,
    seen_at=_upper_seen,
)
def upper_stop(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    nearer, joint = min(values["nearer_rad"], _room(robot, target, "upper")), robot.joint(target)
    return robot.with_joint(target, upper=max(joint.upper - nearer, joint.lower))


@effect(
    "lower_stop",
    family="body",
    targets=_lower_targets,
    parameters=PARAMETERS,
    physics=PHYSICS.format(side="lower"),
    signature=SIGNATURE,
    ranges=_lower_ranges,
    seen_at=_lower_seen,
)
def lower_stop(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    nearer, joint = min(values["nearer_rad"], _room(robot, target, "lower")), robot.joint(target)
    return robot.with_joint(target, lower=min(joint.lower + nearer, joint.upper))
