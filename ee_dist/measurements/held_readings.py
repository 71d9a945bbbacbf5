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
REGULAR, CLEAR = 0.95, 30
"""Share of the steps from one change of a column to the next that are whole multiples of the usual one, and of how many, from
which it was read at that pace: a joint that moves does not keep to one,"""
STEPS = 3.0
"""unless it crosses a step of its encoder each time: changes are in the middle so many times the smallest one."""
SLOWER = 0.9
"""Share of changes that come no sooner than what was told of another trial has it."""


def held_readings(readings: Array, every: float | None = None) -> NDArray[np.intp] | None:
    """Numbers of the rows of ``readings`` (T, S) in which something was read anew, at rest as often as in motion; None where each
    may be a reading. ``every``: how many rows lie between two readings in another trial of the same logger, which goes for one in
    which too little moves to tell."""
    changes = np.diff(readings, axis=0) != 0
    rows = np.flatnonzero(changes.any(axis=1)) + 1
    if len(rows) < FEWEST:
        return None
    usual = float(np.median(np.diff(rows)))
    regular = _regular(readings, changes)
    if regular is not None and (np.diff(rows) >= SLOWER * regular).mean() >= SLOWER:
        usual = regular
    elif usual < SELDOM or not _together(changes):
        if every is None or every < SELDOM or (np.diff(rows) >= SLOWER * every).mean() < SLOWER:
            return None
        usual = every
    edges = np.r_[0, rows, len(readings)]
    step = round(usual)
    found = [np.arange(a, b, step) if b - a > AT_REST * usual else np.array([a]) for a, b in pairwise(edges) if a < b]
    return np.concatenate(found)


def written_late(column: Array, rows: NDArray[np.intp]) -> int | None:
    """How many rows behind those in which sensors were read (``rows``) a column (T,) changes, for loggers write one quantity
    after the other; None where it changes at other times, and is no reading of theirs."""
    changed = np.flatnonzero(np.diff(column)) + 1
    changed = changed[changed >= rows[0]]
    if len(changed) < FEWEST:
        return None
    late = changed - rows[np.searchsorted(rows, changed, side="right") - 1]
    usual = int(np.argmax(np.bincount(late)))
    return usual if (late == usual).mean() >= TOGETHER else None


def _regular(readings: Array, changes: NDArray[np.bool_]) -> float | None:
    """The number of rows of which all steps between changes of one of the columns that change most are multiples."""
    for k in np.argsort(changes.sum(axis=0))[::-1][:4]:
        rows = np.flatnonzero(changes[:, k])
        gaps, sizes = np.diff(rows), np.abs(np.diff(readings[:, k]))[rows]
        if len(gaps) < CLEAR or np.median(sizes) < STEPS * sizes.min():
            continue
        every = int(np.argmax(np.bincount(gaps)))
        # A clock that is off by little slips by a row now and then.
        slip = 1 if every > 5 else 0
        off = np.abs(gaps - every * np.maximum(np.round(gaps / every), 1))
        if every >= SELDOM and (off <= slip).mean() >= REGULAR:
            return float(every)
    return None


def _together(changes: NDArray[np.bool_]) -> bool:
    """Whether of the columns of ``changes`` (T, S) two of those that change most do so together."""
    often = np.argsort(changes.sum(axis=0))[::-1][:4]
    for a, b in combinations(often, 2):
        either, both = changes[:, a] | changes[:, b], changes[:, a] & changes[:, b]
        if either.sum() >= FEWEST and both.sum() >= TOGETHER * either.sum():
            return True
    return False
