"""Torques that take work out of a motion: no model is needed to see that they cannot be a drive's."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ee_dist.basics.names import listed
from ee_dist.measurements import signals
from ee_dist.robots.model import Robot
from ee_dist.trials.log import Array, SensorLog

SMOOTHED_S, SLOW, REVERSALS, TAKES = 0.04, 0.05, 4, 0.5
"""A drive's work is told by speeds smoothed over so many s, of a joint that turns round so often (by speeds of more than this
share of its highest), and where it takes more than this share of what it exchanges. Friction makes it give; of real joints whose
torques were right none that turned round so often took more than a tenth."""


class Work(NamedTuple):
    """What a drive exchanges with a motion, in J: what it takes out of it and what it gives it."""

    taken_j: float
    given_j: float


def takers(robot: Robot, torques: Array, joints: Array, step_s: float) -> dict[str, Work]:
    """The joints of a trial whose torques (T, J, as ``joints``) take work out of it. Of a robot that stands on something
    nothing is said, nor of joints that were not measured."""
    if robot.free_base:
        return {}
    found = {}
    for name, torque, position in zip(robot.motor_names, torques.T, joints.T, strict=True):
        if np.isfinite(torque).all() and np.isfinite(position).all() and (work := work_taken(torque, position, step_s)):
            found[name] = work
    return found


def work_taken(torque: Array, position: Array, step_s: float) -> Work | None:
    """The work of a drive (torque and position (T,) of its joint) that takes more out of a motion to and fro than it puts in, by
    whatever masses: friction takes work, gravity gives back what it took, and no robot without another motor has any to
    give. Speeds are smoothed; from the first time that the joint is in the middle to the last, so that what its weight did on
    the way there is not counted. None for a drive that gives, and a joint that does not turn round often enough to tell."""
    width = max(3, round(SMOOTHED_S / step_s))
    speed = np.gradient(signals.smooth(position[:, None], width)[:, 0], step_s)
    at = np.flatnonzero(np.diff(np.sign(position - np.median(position))))
    quick = np.sign(speed[np.abs(speed) > SLOW * np.abs(speed).max()])
    if len(at) < 2 or np.count_nonzero(np.diff(quick)) < REVERSALS:
        return None
    work = (torque * speed)[at[0] : at[-1]] * step_s
    most, total = float(np.abs(work).sum()), float(work.sum())
    if not np.isfinite(most) or most == 0 or total > -TAKES * most:
        return None
    return Work(-float(work[work < 0].sum()), float(work[work > 0].sum()))


def power_suspicion(name: str, work: Work) -> str:
    """A line on it for a column ``name`` that is being imported."""
    return (
        f"{name}: takes {work.taken_j:.3g} J out of the motion and gives it {work.given_j:.3g}, where a joint "
        "that goes to and fro needs some, whatever the masses: a swapped sign, another joint's column, or no torque?"
    )


def taking(robot: Robot, logs: Sequence[tuple[str, SensorLog]]) -> list[str]:
    """A line on the joints whose torques do so in some of the named ``logs``; nothing of trials in which something pushed."""
    where: dict[str, list[str]] = {}
    for name, log in logs:
        if log.torques is None or log.joints is None or log.external is not None or len(log.times_s) < 2:
            continue
        for joint in takers(robot, log.torques, log.joints, float(log.times_s[1] - log.times_s[0])):
            where.setdefault(joint, []).append(name)
    return [
        f"The torque of {joint} takes more work out of the motion than it gives it, during {listed(trials)}; whatever the "
        "masses, a joint that goes to and fro needs some. A swapped sign, another joint's column, or no torque? Left out of the "
        "mapping, the others are compared without it."
        for joint, trials in where.items()
    ]
