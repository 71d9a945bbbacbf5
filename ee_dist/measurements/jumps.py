"""Positions that jump from one row to the next: no joint moves so, and no model can follow."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from ee_dist.basics.names import listed
from ee_dist.robots.model import Robot
from ee_dist.trials.log import Array, SensorLog

LEAST, BEYOND, NEARLY_ALL = 0.3, 8.0, 0.98
"""A step is a jump from so many rad (m), and so many times the largest of nearly all other steps of that joint, on."""
TURN, QUICK, MOST = 0.15, 4.0, 0.9
"""Share by which a step may be off a whole turn and be one, where it is so many times the largest of most other steps."""


def jumps(position: Array, hinge: bool = True) -> tuple[Array, Array]:
    """The steps of a joint's positions (T,) from row to row that are jumps, in rad or m: those by whole turns of a hinge, and the
    others; none in short logs."""
    steps = np.abs(np.diff(position))
    steps = steps[np.isfinite(steps)]
    if len(steps) < 20:
        return np.zeros(0), np.zeros(0)
    most, nearly_all = np.quantile(steps, [MOST, NEARLY_ALL])
    turns = (np.abs(steps / (2 * math.pi) - 1) < TURN) & (steps > QUICK * most) & hinge
    thrown = (steps > max(LEAST, BEYOND * float(nearly_all))) & ~turns
    return steps[turns], steps[thrown]


def jumping(robot: Robot, logs: Sequence[tuple[str, SensorLog]]) -> list[str]:
    """A line on joints whose positions jump by whole turns in some of the named ``logs``, and one on those that do otherwise."""
    turned: dict[str, list[str]] = {}
    thrown: dict[str, list[str]] = {}
    worst: dict[str, float] = {}
    for name, log in logs:
        if log.joints is None:
            continue
        # Between readings a jump is a line.
        for joint, position in zip(robot.motor_names, log.joints[log.readings].T, strict=True):
            turns, others = jumps(position, robot.joint(joint).kind == "hinge")
            if len(turns):
                turned.setdefault(joint, []).append(name)
            if len(others):
                thrown.setdefault(joint, []).append(name)
                worst[joint] = max(worst.get(joint, 0.0), float(others.max()))
    lines = []
    if turned:
        lines.append(
            f"Whole turns are jumped by {_where(turned)}: set 'unwrap: true' at the column and import again; till then errors "
            "there are of the jump."
        )
    if thrown:
        far = max(worst, key=lambda joint: worst[joint])
        unit = "rad" if robot.joint(far).kind == "hinge" else "m"
        lines.append(
            f"Positions jump from one reading to the next, up to {worst[far]:.3g} {unit} at {far}: {_where(thrown)}. Are rows "
            "missing there, or were they not read? Cut the record there, or leave the rows out."
        )
    return lines


def _where(found: Mapping[str, Sequence[str]]) -> str:
    """Joints, and the trials in which each was seen."""
    trials = dict.fromkeys(t for some in found.values() for t in some)
    return f"{listed([*found])} during {listed([*trials])}"
