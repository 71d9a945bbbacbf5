"""Positions that jump from one row to the next: no joint moves so, and no model can follow."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ee_dist.basics.names import listed
from ee_dist.robots.model import Robot
from ee_dist.trials.log import Array, SensorLog

LEAST, BEYOND, NEARLY_ALL = 0.3, 8.0, 0.98
"""A step is a jump from so many rad (m), and so many times the largest of nearly all other steps of that joint, on."""
TURN, QUICK, MOST = 0.15, 4.0, 0.9
"""Share by which a step may be off a whole turn and be one, where it is so many times the largest of most other steps."""
HOP, AROUND = 3.0, (-4, -3, -2, 2, 3, 4)
"""A joint that goes one way hops where it goes so many times as far in a row as in those around it, but for the next ones."""
TOGETHER, FEWEST = 2, 3
"""Joints that hop in one row, or rows in which one joint hops where only one moves, that are no accident."""


def jumps(position: Array, hinge: bool = True, gaps: Array | None = None) -> tuple[Array, Array]:
    """The steps of a joint's positions (T,) from row to row that are jumps, in rad or m: those by whole turns of a hinge, and the
    others; none in short logs. ``gaps`` (T - 1,): steps over rows that are known to be lost, in which a joint goes anywhere."""
    steps = np.abs(np.diff(position))
    known, steps = np.isfinite(steps), steps[np.isfinite(steps)]
    if len(steps) < 20:
        return np.zeros(0), np.zeros(0)
    most, nearly_all = np.quantile(steps, [MOST, NEARLY_ALL])
    turns = (np.abs(steps / (2 * math.pi) - 1) < TURN) & (steps > QUICK * most) & hinge
    thrown = (steps > max(LEAST, BEYOND * float(nearly_all))) & ~turns
    if gaps is not None:
        thrown &= ~gaps[known]
    return steps[turns], steps[thrown]


def hops(position: Array, times_s: Array) -> NDArray[np.intp]:
    """The rows (of T) in which a joint goes on as before, and several times as fast as in each of those around: time passed there
    that the times (T,) do not count. Beside a gap in these they do: what was late is told there already."""
    steps_s = np.diff(times_s)
    speeds, reach = np.diff(position) / steps_s, max(AROUND)
    if len(speeds) < 10 * reach:
        return np.zeros(0, dtype=np.intp)
    rows = np.arange(reach, len(speeds) - reach)
    around = np.stack([speeds[rows + k] for k in AROUND])
    one_way = (np.sign(around) == np.sign(speeds[rows])).all(axis=0) & (speeds[rows] != 0)
    gap = steps_s > HOP * np.median(steps_s)
    even = ~np.any([gap[rows + k] for k in range(-reach, reach + 1)], axis=0)
    found: NDArray[np.intp] = rows[one_way & even & (np.abs(speeds[rows]) > HOP * np.abs(around).max(axis=0))]
    return found


def losing_time(logs: Sequence[tuple[str, SensorLog]]) -> list[str]:
    """A line on named ``logs`` whose joints hop: a logger that was late at some rows, under times that say that it was not."""
    places: list[tuple[str, float]] = []
    for name, log in logs:
        if log.joints is None:
            continue
        times_s, joints = log.times_s[log.readings], log.joints[log.readings]
        moving = [column for column in joints.T if np.ptp(column) > 0]
        count = np.zeros(len(times_s), dtype=int)
        for column in moving:
            count[hops(column, times_s)] += 1
        rows = np.flatnonzero(count >= max(1, min(TOGETHER, len(moving))))
        # A row that was late makes two long steps where it was read half way.
        places += [(name, float(times_s[k])) for k in rows[np.diff(rows, prepend=-2) > 1]]
    if len(places) < FEWEST:
        return []
    name, at_s = places[0]
    return [
        f"Rows seem to be lost: at {len(places)} places, in {name} at {at_s:.2f} s first, what moves goes {HOP:g} times as far "
        "from one reading to the next as before and after, and the times do not say so. The logger was late there: cut the "
        "record at such places, or log the time of each reading."
    ]


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
            turns, others = jumps(position, robot.joint(joint).kind == "hinge", log.gaps)
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
    return lines + losing_time(logs)


def _where(found: Mapping[str, Sequence[str]]) -> str:
    """Joints, and the trials in which each was seen."""
    trials = dict.fromkeys(t for some in found.values() for t in some)
    return f"{listed([*found])} during {listed([*trials])}"
