"""The noise of sensors that are read seldom, or at uneven times."""

from __future__ import annotations

import numpy as np

from ee_dist.trials.grid import reading_step
from ee_dist.trials.log import Array

MEDIAN_OF_SQUARES = 0.455
"""Of a standard normal variable."""
DIFFERENCES = (2, 3, 4, 5)
"""Orders of divided differences that noise is looked for in."""
MOTION = 0.5
"""Share of what second differences find below which those of higher orders say that the rest of it was motion: of noise alone
all find the same."""


def slow_noise(times_s: Array, values: Array) -> Array:
    """(C,) standard deviation of the noise of readings (R, C) taken seldom, or at uneven ``times_s`` (R,), of something smooth.

    Divided differences of order p are free of polynomials of a lower order. The longer the steps, the more of the motion is
    in the second ones; of several orders the one that finds least has least of it. Of readings in coarse steps that would be
    nothing, for they mostly repeat the last: what the steps leave open is the least there is.
    """
    found = []
    for order in DIFFERENCES:
        rows = np.arange(len(times_s) - order)[:, None] + np.arange(order + 1)
        if len(rows) == 0:
            break
        apart = times_s[rows][:, :, None] - times_s[rows][:, None, :]
        weights = 1.0 / np.prod(np.where(np.eye(order + 1, dtype=bool), 1.0, apart), axis=2)
        weights /= np.linalg.norm(weights, axis=1, keepdims=True)
        left = np.einsum("rk,rkc->rc", weights, values[rows])
        found.append(np.median(left**2, axis=0) / MEDIAN_OF_SQUARES)
    steps = np.array([reading_step(column) for column in values.T])
    return np.maximum(np.sqrt(np.min(found, axis=0)) if found else 0.0, steps / np.sqrt(12))


def without_motion(noise: Array, times_s: Array, values: Array) -> Array:
    """(C,) standard deviations that second differences of readings (R, C) found, where it was not quick motion that they found:
    of a joint that turns by a tenth of a radian from row to row they find hundreds of times what its encoder leaves open."""
    least = slow_noise(times_s, values)
    return np.where(least < MOTION * noise, least, noise)
