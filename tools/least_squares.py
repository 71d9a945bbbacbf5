"""What an expert fits by hand: the rigid body as described, and per joint rotor inertia, Coulomb, viscous and offset, all by
plain least squares, held out by the same folds as ours. A payload is four more columns: mass, and mass times centre."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ee_dist.discrepancy.evidence.holdout import Cut
from ee_dist.discrepancy.problem import Mask
from ee_dist.discrepancy.ways.force_balance.problem import ForceBalance
from ee_dist.effects.catalogue import Hypothesis, apply
from ee_dist.measurements.sampling import decimated
from ee_dist.robots.bodies import bodies_of
from ee_dist.robots.inverse_dynamics import parameters, regressor
from ee_dist.trials.log import Array

PER_JOINT = 4
"""Rotor inertia, Coulomb, viscous, offset."""


@dataclass(frozen=True, eq=False)
class LeastSquares:
    """``residual`` and ``heldout`` (n,) in the problem's units; ``joints`` (M, 4); ``load`` (4,): mass, mass times centre, of
    the part that carries one (zeros without); ``count`` of numbers that were fitted."""

    residual: Array
    heldout: Array
    joints: Array
    load: Array
    count: int


def least_squares(
    problem: ForceBalance, cut: Cut, part: str | None = None, known: Hypothesis = (), rows: Mask | None = None
) -> LeastSquares:
    """The fit on all values, and on what each turn of ``cut`` sees. ``known``: terms that the robot has beside it; ``part``:
    at a joint, what a payload hangs on; ``rows`` (n,): values that are fitted at all."""
    robot, size, motors = apply(problem.robot, known), problem.scale, len(problem.channels)
    blocks, wanted = [], []
    order = [joint.child for joint in bodies_of(robot).moving]
    for motion in problem.motions:
        q, v, a = motion.position, motion.speed, motion.acceleration
        each = regressor(robot, q, v, a)
        count = len(q)
        columns = np.zeros((count, motors, PER_JOINT * motors + (4 if part else 0)))
        for k in range(motors):
            own = (a[:, k], np.sign(v[:, k]), v[:, k], np.ones(count))
            columns[:, k, PER_JOINT * k : PER_JOINT * (k + 1)] = np.stack(own, axis=1)
        if part:
            at = 10 * order.index(part)
            columns[:, :, -4:] = each[:, :, at : at + 4]
        every = problem.processing.keep_every
        wanted.append(decimated(motion.torque - each @ parameters(robot), every) / size)
        flat = decimated(columns.reshape(count, -1), every).reshape(-1, motors, columns.shape[2])
        blocks.append(flat / size[:, None])
    table, target = np.concatenate(blocks).reshape(-1, blocks[0].shape[2]), np.concatenate(wanted).ravel()
    used = np.ones(len(target), dtype=bool) if rows is None else rows
    whole = np.linalg.lstsq(table[used], target[used], rcond=None)[0]
    held = np.zeros(len(target))
    for fold in range(cut.folds):
        seen = cut.seen(problem, fold)
        fit = np.linalg.lstsq(table[seen & used], target[seen & used], rcond=None)[0]
        held[~seen] = target[~seen] - table[~seen] @ fit
    load = whole[-4:] if part else np.zeros(4)
    return LeastSquares(
        target - table @ whole, held, whole[: PER_JOINT * motors].reshape(motors, PER_JOINT), load, len(whole)
    )
