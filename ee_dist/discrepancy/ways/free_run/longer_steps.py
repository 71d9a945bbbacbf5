"""Longer steps for a search of free runs: from one row that is compared to the next.

Where motions are not stable what starts that are off make of a window hides what a longer step is off by, and a search simulates
windows ten thousand times.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from ee_dist.discrepancy.measured_trial import MeasuredTrial
from ee_dist.discrepancy.ways.free_run.pieces import Piece, ToPositions
from ee_dist.engines.halfway import goes_halfway
from ee_dist.evaluation.jobs import Evaluator, Job
from ee_dist.robots.model import Robot
from ee_dist.trials.log import Array

SLIGHT = 0.1
"""Share of the noise floor by which longer steps may move what is foretold, for a search to go in them."""


def every_row_is_known(trials: Sequence[MeasuredTrial], robot: Robot) -> bool:
    """Whether nothing is lost between rows: all of them were read, no drive was released in one, and no controller steps with
    them."""
    known = all(t.log.filled is None and np.isfinite(t.log.commands).all() for t in trials)
    return known and goes_halfway(robot)


def moved_by(
    windows: Sequence[Piece],
    count: int,
    models: Callable[[int], Sequence[Robot]],
    columns: tuple[int, ...],
    evaluator: Evaluator,
) -> list[Array]:
    """(rows, C) of each window: by how much positions differ that are foretold in steps of ``count`` rows and of one; ``models``:
    what is simulated so many rows at a time, by trial."""

    def foretold(some: Sequence[Piece], steps: int) -> list[Array]:
        of_trial = models(steps)
        jobs = [Job(p.rollout(of_trial[p.trial], len(p.log), False), ToPositions(columns, p.rows)) for p in some]
        return [np.asarray(found) for found in evaluator.evaluate(jobs)]

    fine, coarse = foretold(windows, 1), foretold([p.coarser(count) for p in windows], count)
    return [np.abs(a - b) for a, b in zip(fine, coarse, strict=True)]
