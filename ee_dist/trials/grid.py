"""The steps that a sensor reads in, as its readings show them."""

from __future__ import annotations

import numpy as np

from ee_dist.trials.log import Array

RESTS, LEVELS, MULTIPLES = 0.1, 5, 0.9
"""A reading comes in steps where it rests in this share of the rows, on so many levels, this share of whose gaps are whole
multiples of one step."""


def reading_step(values: Array, levels: int = LEVELS) -> float:
    """The step in which readings (R,) come; 0 where none is seen, or on fewer than so many ``levels``. Only readings that repeat
    the last one are looked at: others may lie between two levels where a log was brought to another grid."""
    rests = values[1:][np.diff(values) == 0]
    seen = np.unique(rests)
    if len(rests) < RESTS * len(values) or len(seen) < levels:
        return 0.0
    gaps = np.diff(seen)
    gaps = gaps[gaps > 1e-6 * (seen[-1] - seen[0])]
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
