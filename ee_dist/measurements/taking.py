"""Torques that take work out of a motion, as no drive does that moves a joint to and fro."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ee_dist.basics.names import listed
from ee_dist.measurements import signals
from ee_dist.measurements.need import torques_needed
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
    for k, name in enumerate(robot.motor_names):
        torque, position = torques[:, k], joints[:, k]
        if np.isfinite(torque).all() and np.isfinite(position).all() and (work := work_taken(torque, position, step_s)):
            found[name] = work, k
    moves = [k for k, column in enumerate(joints.T) if not np.isfinite(column).all() or np.ptp(column) > 0]
    if len(moves) < 2 or not found:
        return {name: work for name, (work, _) in found.items()}
    # Where others move too a joint may be led by them all the way and be held back by its drive, in any arm without friction.
    needed = torques_needed(robot, joints, step_s) if np.isfinite(joints).all() else None
    if needed is None:
        return {}
    return {
        name: work
        for name, (work, k) in found.items()
        if work_taken(torques[:, k], joints[:, k], step_s, needed[0][:, k]) is not None
    }


def work_taken(torque: Array, position: Array, step_s: float, needed: Array | None = None) -> Work | None:
    """The work of a drive (torque and position (T,) of its joint) that takes more out of a motion to and fro than it puts in, by
    whatever masses if nothing else moves: friction takes work, gravity gives back what it took, and no robot without another
    motor has any to give. Where others move too, more than what the masses of the model exchange with them (``needed`` (T,)
    torques). Speeds are smoothed; from the first time that the joint is in the middle to the last, so that what its weight did
    on the way there is not counted. None for a drive that gives, and a joint that does not turn round often enough to tell."""
    width = max(3, round(SMOOTHED_S / step_s))
    speed = np.gradient(signals.smooth(position[:, None], width)[:, 0], step_s)
    at = np.flatnonzero(np.diff(np.sign(position - np.median(position))))
    quick = np.sign(speed[np.abs(speed) > SLOW * np.abs(speed).max()])
    if len(at) < 2 or np.count_nonzero(np.diff(quick)) < REVERSALS:
        return None
    work = (torque * speed)[at[0] : at[-1]] * step_s
    most, total = float(np.abs(work).sum()), float(work.sum())
    beyond = total if needed is None else total - float((needed * speed)[at[0] : at[-1]].sum() * step_s)
    if not np.isfinite(most) or most == 0 or max(total, beyond) > -TAKES * most:
        return None
    return Work(-float(work[work < 0].sum()), float(work[work > 0].sum()))


def power_suspicion(name: str, work: Work) -> str:
    """A line on it for a column ``name`` that is being imported."""
    return (
        f"{name}: takes {work.taken_j:.3g} J out of the motion and gives it {work.given_j:.3g}, where a joint "
        "that goes to and fro needs some, and these masses take none: a swapped sign, another joint's column, or no torque?"
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
        f"The torque of {joint} takes more work out of the motion than it gives it, during {listed(trials)}; a joint that goes "
        "to and fro needs some, and the model's masses take none there. A swapped sign, another joint's column, or no torque? "
        "Left out of the mapping, the others are compared without it."
        for joint, trials in where.items()
    ]
