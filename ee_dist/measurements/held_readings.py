"""Sensors that are read more seldom than rows are written, so that most rows repeat the reading before."""

from __future__ import annotations

from itertools import combinations, pairwise

import numpy as np
from numpy.typing import NDArray

from ee_dist.trials.log import Array

TOGETHER = 0.9
"""Share of the rows in which either of two columns changes in which both do, from which they were read together. Of encoders that
have few steps, each changes when its own joint has moved by one."""
SELDOM = 2.0
"""Rows from one change to the next, in the middle, from which the rows between are no readings."""
AT_REST = 3.0
"""Times that many rows without a change, from which a robot at rest was read all the same."""
FEWEST = 10
"""Changes from which that is told."""


def held_readings(readings: Array) -> NDArray[np.intp] | None:
    """Numbers of the rows of ``readings`` (T, S) in which something was read anew, at rest as often as in motion; None where each
    may be a reading."""
    changes = np.diff(readings, axis=0) != 0
    rows = np.flatnonzero(changes.any(axis=1)) + 1
    if len(rows) < FEWEST:
        return None
    every = float(np.median(np.diff(rows)))
    if every < SELDOM or not _together(changes):
        return None
    edges = np.r_[0, rows, len(readings)]
    step = round(every)
    found = [np.arange(a, b, step) if b - a > AT_REST * every else np.array([a]) for a, b in pairwise(edges) if a < b]
    return np.concatenate(found)


def _together(changes: NDArray[np.bool_]) -> bool:
    """Whether of the columns of ``changes`` (T, S) two of those that change most do so together."""
    often = np.argsort(changes.sum(axis=0))[::-1][:4]
    for a, b in combinations(often, 2):
        either, both = changes[:, a] | changes[:, b], changes[:, a] & changes[:, b]
        if either.sum() >= FEWEST and both.sum() >= TOGETHER * either.sum():
            return True
    return False
