"""Drives that sit at their torque limits in a simulation: what their controllers ask for makes no difference there.

A limit that is far too low makes a switch of any controller, and gains, damping and loads are then blamed for what the limit
does: one that nobody stated is often such.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ee_dist.basics.names import counted, listed
from ee_dist.discrepancy.compare import MOVING_SHARE
from ee_dist.discrepancy.measured_trial import MeasuredTrial
from ee_dist.discrepancy.meters import AtLimit, meters
from ee_dist.discrepancy.problem import Problem
from ee_dist.effects.catalogue import Hypothesis, apply
from ee_dist.effects.targets import motors_with_torque_limit
from ee_dist.robots.model import Drive, Robot
from ee_dist.robots.ranges import drive_of
from ee_dist.trials.log import Array, SensorLog

OFTEN = 0.25
"""Share of the rows in which a joint does not rest from which it is told that it is at its limit in them: less of them is what
steps and reversals ask for. Where it rests below its limit nothing was asked of it, however long it was watched."""
NEARLY = 0.99
"""Of the limit from which it is at it: the speed behind a gear that gives is not quite that of the joint."""
NAMED = 3
"""Joints that are named, those most often at their limits first."""


def often_at_limit(problem: Problem, hypothesis: Hypothesis) -> list[AtLimit]:
    """The joints that are at their limits in more than ``OFTEN`` of the simulated rows in which they do not rest, the most often
    first; none where a way simulates nothing. Raises EffectError for a hypothesis that does not fit the robot."""
    robot = problem.robot
    joints = motors_with_torque_limit(robot)
    if not joints:
        return []
    rows = [
        _rows(trial, trial.models(robot, [hypothesis])[0], joints, log)
        for trial, log in zip(problem.measured, problem.simulated(hypothesis, meters(robot)), strict=True)
        if log is not None
    ]
    if not rows:
        return []
    model, found = apply(robot, hypothesis), []
    at_limit, not_at_rest = np.sum(rows, axis=0)
    for joint, share in zip(joints, (at_limit / np.maximum(not_at_rest, 1)).tolist(), strict=True):
        if share > OFTEN:
            limit = drive_of(model, joint).torque_limit
            guessed = (joint, "torque_limit") in robot.assumed and limit == drive_of(robot, joint).torque_limit
            unit = "N" if robot.joint(joint).kind == "slide" else "N.m"
            found.append(AtLimit(joint, limit, unit, share, guessed))
    return sorted(found, key=lambda a: -a.share)


def unsaid(robot: Robot, found: Sequence[AtLimit], terms: Hypothesis) -> list[AtLimit]:
    """Those of the joints whose limits ``terms``, which a verdict tells with their values, leave as they are described."""
    if not found:
        return []
    model = apply(robot, terms)
    return [a for a in found if drive_of(model, a.joint).torque_limit == drive_of(robot, a.joint).torque_limit]


def limit_lines(found: Sequence[AtLimit], lead: str = "") -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The same as warnings, and as notes: a limit that nobody stated may decide everything."""
    told = tuple(limit_text(found, lead))
    return (told, ()) if any(a.assumed for a in found) else ((), told)


def limit_text(found: Sequence[AtLimit], lead: str = "") -> list[str]:
    """A line for people on joints that are often at their limits, which begins with ``lead``; none where none is."""
    if not found:
        return []
    first, *others = [(f"{a.joint} ({a.limit:.3g} {a.unit})", f"in {100 * a.share:.0f} %") for a in found[:NAMED]]
    told = [
        f"{first[0]} is at its torque limit {first[1]} of the simulated rows in which it does not rest",
        *(" ".join(o) for o in others),
    ]
    if len(found) > NAMED:
        told.append(f"and {counted(len(found) - NAMED, 'more joint')} in more than {100 * OFTEN:.0f} %")
    guessed = [a.joint for a in found if a.assumed]
    which = "that limit" if len(found) == 1 else f"the limit of {listed(guessed)}"
    doubt = f", and the description only assumes {which}" if guessed else ""
    return [f"{lead}{', '.join(told)}: to ask for more changes nothing there{doubt}."]


def _rows(trial: MeasuredTrial, model: Robot, joints: Sequence[str], log: SensorLog) -> Array:
    """(2, J) in how many steps each joint was at its limit, and in how many it was that or moved, by the last columns of a log:
    torques, then speeds."""
    torque, speed = np.split(log.sensors[:, -2 * len(joints) :], 2, axis=1)
    # A meter of torque shows the step before its row.
    steps = zip((drive_of(model, j) for j in joints), torque[1:].T, speed[:-1].T, strict=True)
    at = [np.abs(_without_emf(d, t, w)) >= NEARLY * _limit(d, trial.log.supply_v, len(t)) for d, t, w in steps]
    at_limit, size = np.stack(at, axis=1), np.abs(speed[:-1])
    moves = size > MOVING_SHARE * size.max(axis=0, initial=0.0)
    return np.array([at_limit.sum(axis=0), (at_limit | moves).sum(axis=0)])


def _without_emf(drive: Drive, torque: Array, speed: Array) -> Array:
    """(N,) what a motor would give at rest, of what its current stands for at some speeds: what back-EMF took is put back."""
    by_voltage = math.isfinite(drive.speed_limit) and drive.command in ("position", "speed")
    lost = drive.back_emf + (drive.torque_limit / drive.speed_limit if by_voltage else 0.0)
    return np.asarray(torque * drive.current_gain + lost * speed)


def _limit(drive: Drive, supply_v: Array | None, rows: int) -> Array:
    """(N,) the limit in each step: of a supply that was measured, as much as it leaves."""
    if supply_v is None or not drive.supply_nominal_v > 0:
        return np.full(rows, drive.torque_limit)
    return np.asarray(drive.torque_limit * supply_v[:rows] / drive.supply_nominal_v)
