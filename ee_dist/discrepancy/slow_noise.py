"""The noise of sensors that are read seldom, or at uneven times."""

from __future__ import annotations

import numpy as np

from ee_dist.trials.log import Array

MEDIAN_OF_SQUARES = 0.455
"""Of a standard normal variable."""
DIFFERENCES = (2, 3, 4, 5)
"""Orders of divided differences that noise is looked for in."""


MOTION = 0.5
"""Share of what second differences find below which those of higher orders say that the rest of it was motion: of noise alone
all find the same."""
RESTS, LEVELS, MULTIPLES = 0.1, 5, 0.9
"""A reading comes in steps where it rests in this share of the rows, on so many levels, this share of whose gaps are whole
multiples of one step."""


def reading_step(values: Array) -> float:
    """The step in which readings (R,) come; 0 where none is seen. Only readings that repeat the last one are looked at: others
    may lie between two levels where a log was brought to another grid."""
    rests = values[1:][np.diff(values) == 0]
    levels = np.unique(rests)
    if len(rests) < RESTS * len(values) or len(levels) < LEVELS:
        return 0.0
    gaps = np.diff(levels)
    gaps = gaps[gaps > 1e-6 * (levels[-1] - levels[0])]
    step = _step_of(gaps)
    multiples = gaps / step
    return step if np.mean(np.abs(multiples - np.round(multiples)) < 0.1) > MULTIPLES else 0.0


def _step_of(gaps: Array) -> float:
    """The step that gaps (G,) are multiples of, from the least one to ever larger ones: a log that was written with three digits
    is a hundredth of a step off, and ten steps of that are a tenth."""
    step = float(gaps.min())
    for most in (1.5, 4.5, 16.5, np.inf):
        near = gaps[gaps < most * step]
        count = np.round(near / step)
        step = float(near @ count / (count @ count))
    return step


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
