"""Joints that stand still: although they are commanded, which no unit explains and which tells nothing of units; or because they
are told to rest, which is nothing to suspect."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from ee_dist.basics.runs import runs
from ee_dist.measurements.units import TURNS_ON
from ee_dist.robots.model import Joint, Robot
from ee_dist.trials.log import Array

PART = 0.1
"""Of its command's way a joint that stands still goes less than this share,"""
REST = 0.02
"""and less than this share of its reach,"""
WITHIN = 1.15
"""while its command stays within its reach, times this, as no number in another unit would,"""
ASKED = 0.01
"""and goes through more than this share of it."""
ROUNDING = 1e-9
"""Share of the largest reading below which two that differ are one."""
GOES_ON, MOSTLY = 0.05, 0.5
"""Share of its command's way by which that goes on after a joint came to an end of its readings, if these are cut off, and of the
rows at that end in which it does not, if the joint rests there."""


def stands_still(asked: Array, seen: Array, reach: float) -> bool:
    """Whether a joint does next to nothing of what it was asked for; both (T,) in the unit of its ``reach``."""
    way, moved = float(np.ptp(asked)), float(np.ptp(seen))
    return bool(
        moved < PART * way and moved < REST * reach and way > ASKED * reach and np.abs(asked).max() <= WITHIN * reach
    )


def step_of(readings: Array) -> float:
    """The step in which readings (T,) come, as those of an encoder do: the least by which one differs from the one before it. 0
    of what never changes; NaN are no readings."""
    read = readings[np.isfinite(readings)]
    changes = np.abs(np.diff(read))
    changes = changes[changes > ROUNDING * np.abs(read).max(initial=0.0)]
    return float(changes.min(initial=math.inf)) if len(changes) else 0.0


def reach_of(joint: Joint) -> float:
    """How far from zero a joint gets; of one that turns without an end, by a few turns."""
    reach = max(abs(joint.lower), abs(joint.upper))
    return reach if reach > 0 and math.isfinite(reach) else TURNS_ON if joint.kind == "hinge" else math.inf


def dwells(asked: Array, seen: Array, highest: bool) -> bool:
    """Whether a joint rests at the highest (or lowest) of its readings (T,) because its command (T,) goes no farther: it stays
    there, or turns, and friction holds the joint. Of a signal that is cut off the command goes on."""
    way = float(np.nanmax(asked) - np.nanmin(asked)) if np.isfinite(asked).any() else 0.0
    stays = runs(seen == (seen.max() if highest else seen.min()))
    resting = 0
    for first, last in stays:
        told = (1.0 if highest else -1.0) * asked[first:last][np.isfinite(asked[first:last])]
        if len(told) and told.max() - told[0] < GOES_ON * way:
            resting += last - first
    return resting > MOSTLY * sum(last - first for first, last in stays)


def told_to_rest(robot: Robot, commands: Array, position_of: Mapping[str, Array]) -> tuple[str, ...]:
    """The joints that rest as they are told to, ``commands`` (T, M) one number all the time, while others go somewhere; none of a
    robot of which nothing moves."""
    at_rest = {j: float(np.ptp(at)) < REST * reach_of(robot.joint(j)) for j, at in position_of.items()}
    if all(at_rest.values()):
        return ()
    told = [d.joint for k, d in enumerate(robot.drives) if d.command != "none" and np.ptp(commands[:, k]) == 0]
    return tuple(j for j in told if at_rest.get(j, False))
