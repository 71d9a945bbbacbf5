"""The steps that a sensor reads in, as its readings show them."""

from __future__ import annotations

import numpy as np

from ee_dist.trials.log import Array

FEWEST = 4
"""Different readings that there must be."""
SAME, OFF = 1e-6, 0.02
"""Share of the range within which two readings are one; and by how much of a step they may lie off the grid."""


def grid_of(readings: Array) -> float:
    """The largest step of which all differences between readings (T,) are multiples, 0 where there is none."""
    known = np.sort(readings[np.isfinite(readings)])
    span = float(known[-1] - known[0]) if len(known) else 0.0
    if span <= 0:
        return 0.0
    levels = known[np.concatenate([[True], np.diff(known) > SAME * span])]
    if len(levels) < FEWEST:
        return 0.0
    step = float(np.diff(levels).min())
    # From the least gap, which is known least, to the whole range, which is known best.
    for reach in (4.0, 32.0, 256.0, np.inf):
        from_first = levels - levels[0]
        near = from_first[from_first <= reach * step * 1.5]
        counts = np.round(near / step)
        if not counts.any():
            continue
        step = float(near @ counts / (counts @ counts))
    counts = np.diff(levels) / step
    return step if bool(np.all(np.abs(counts - np.round(counts)) <= OFF)) else 0.0
