"""What an untouched robot shows beyond noise, taken from a residual: the data that ``unmodelled`` is made of."""

from __future__ import annotations

import numpy as np

from ee_dist.discrepancy.recorded import means_of
from ee_dist.discrepancy.ways.open_loop.problem import OpenLoop
from ee_dist.trials.log import Array


def unmodelled_by(problem: OpenLoop, residual: Array) -> dict[str, Array]:
    """What ``residual`` (n,), of an untouched robot, holds beyond noise and beyond the spread of equally good models; of trials
    of one name the mean over those in which a channel was recorded, and 0 where it was in none."""
    squares: dict[str, list[Array]] = {}
    recorded: dict[str, list[Array]] = {}
    for k, name in enumerate(problem.trials):
        shape = (problem.views.raw_blocks(k, residual) ** 2 - problem.weights.deviation[k] ** 2).mean(axis=0)
        grain = (problem.views.raw_grain(k, residual) ** 2 - problem.weights.grain_deviation[k] ** 2).mean(axis=0)
        squares.setdefault(name, []).append(np.stack([shape, grain]).ravel())
        recorded.setdefault(name, []).append(np.tile(problem.parts[k].run.recorded(problem.robot), 2))
    means = {name: means_of(np.stack(found), np.stack(recorded[name])) for name, found in squares.items()}
    return {name: np.sqrt(np.maximum(found, 0.0)).reshape(2, -1) for name, found in means.items()}
