"""What an untouched robot shows beyond noise, taken from a residual: the data that ``unmodelled`` is made of."""

from __future__ import annotations

import numpy as np

from ee_dist.discrepancy.ways.open_loop.problem import OpenLoop
from ee_dist.trials.log import Array


def unmodelled_by(problem: OpenLoop, residual: Array) -> dict[str, Array]:
    """What ``residual`` (n,), of an untouched robot, holds beyond noise and beyond the spread of equally good models."""
    squares: dict[str, list[Array]] = {}
    for k, name in enumerate(problem.trials):
        shape = (problem.views.raw_blocks(k, residual) ** 2 - problem.weights.deviation[k] ** 2).mean(axis=0)
        grain = (problem.views.raw_grain(k, residual) ** 2 - problem.weights.grain_deviation[k] ** 2).mean(axis=0)
        squares.setdefault(name, []).append(np.stack([shape, grain]))
    return {name: np.sqrt(np.maximum(np.mean(found, axis=0), 0.0)) for name, found in squares.items()}
