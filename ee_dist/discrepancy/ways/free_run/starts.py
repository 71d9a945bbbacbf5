"""What starts that are off make of a window.

A model starts from what was measured. Where a motion is not stable, a pole that stands upright, what is wrong with that grows
until the window ends, and a perfect model leaves far more than noise.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ee_dist.discrepancy.problem import Index
from ee_dist.discrepancy.ways.free_run.noise import MEAN_ABSOLUTE
from ee_dist.discrepancy.ways.free_run.pieces import Piece, ToPositions
from ee_dist.evaluation.jobs import Evaluator, Job
from ee_dist.robots.model import Robot
from ee_dist.trials.log import Array

GROWN = 10.0
"""Error over that of noise alone, of a perfect model, from which the starts of windows decide: motions that are not stable.
Below it noise is all of the floor: it is a bound, and hid what was found without it in simulated robots."""


def positions_off(robot: Robot, columns: Sequence[int], own: Index, noise: Array) -> Array:
    """(M,) standard deviations of the joint positions that a simulation of a trial starts from; ``own``: which of the
    ``columns`` were recorded in it, ``noise`` (C,) their mean absolute errors."""
    joints = {robot.sensors[columns[c]].target: noise[c] for c in own}
    return np.array([joints.get(m, 0.0) / MEAN_ABSOLUTE for m in robot.motor_names])


def speeds_there(piece: Piece, times_s: Array, off: Array) -> Array:
    """(M,) standard deviations of the speeds that a simulation of a piece begins with, of those at ``times_s`` (T,) of its trial
    since the start, ``off`` (T, M)."""
    anew = piece.start_s + piece.log.times_s[[0, *(k for k, _ in piece.again)]] - piece.log.times_s[0]
    rows = np.clip(np.searchsorted(times_s, anew - 1e-9), 0, len(times_s) - 1)
    return np.asarray(np.sqrt(np.mean(off[rows] ** 2, axis=0)))


def grown_by_start(
    pieces: Sequence[Piece],
    starts: Sequence[tuple[Robot, Array, Array]],
    columns: tuple[int, ...],
    own: Sequence[Index],
    noise: Array,
    evaluator: Evaluator,
) -> Array:
    """(n,) by how much more than noise each value is off, by the robot as it is described, a standard deviation beside each
    measured position and speed. ``starts``: of each piece what is simulated, and (M,) these deviations of both."""
    jobs, count = [], []
    for p, (model, positions, speeds) in zip(pieces, starts, strict=True):
        beside = [p, *p.beside(positions, speeds)]
        jobs += [Job(b.rollout(model, len(p.log), False), ToPositions(columns, p.rows)) for b in beside]
        count.append(len(beside))
    found, grown = iter(evaluator.evaluate(jobs)), []
    for p, many in zip(pieces, count, strict=True):
        as_it_is, *others = (np.asarray(next(found), dtype=float) for _ in range(many))
        with np.errstate(invalid="ignore", over="ignore"):
            spread = (
                np.sqrt(sum(((o - as_it_is) ** 2 for o in others), np.zeros_like(as_it_is))) * MEAN_ABSOLUTE / noise
            )
        grown.append(np.hypot(1.0, np.where(np.isfinite(spread), spread, 0.0))[:, own[p.trial]].ravel())
    return np.concatenate(grown)
