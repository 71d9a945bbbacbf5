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
ABOUT, MOSTLY, SAME = 0.5, 0.8, 0.15
"""Share of the usual time by which most times from one change of a column to the next, this share of those in motion, differ from
it, where a log has a row for whatever came and each sensor comes at its own pace; and that by which paces of two trials do."""


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
    return _at_rest_too(rows, len(readings), usual)


def read_in_turn(column: Array, times_s: Array, pace_s: float | None = None) -> NDArray[np.intp] | None:
    """Numbers of the rows in which a column (T,) was read, of a log that has a row whenever one of several sensors is read and
    holds the others; None where its changes, at ``times_s`` (T,), keep to no pace of their own, or come as often as rows.
    ``pace_s``: that which another trial of the same logger shows. What leaves cells empty between its readings holds none."""
    rows = np.flatnonzero(np.diff(column)) + 1
    if len(rows) < CLEAR or not np.isfinite(column).all():
        return None
    sizes, gaps_s = np.abs(np.diff(column))[rows - 1], np.diff(times_s[rows])
    usual_s, usual = float(np.median(gaps_s)), float(np.median(np.diff(rows)))
    moving = gaps_s[gaps_s < AT_REST * usual_s]
    known = pace_s is not None and abs(usual_s / pace_s - 1) < SAME
    # A motion that crosses the steps of an encoder keeps to no pace, but where it is even.
    if usual < SELDOM or (np.median(sizes) < STEPS * sizes.min() and not known):
        return None
    if np.mean(np.abs(moving / usual_s - 1) < ABOUT) < MOSTLY:
        return None
    return _at_rest_too(rows, len(column), usual)


def _at_rest_too(rows: NDArray[np.intp], count: int, usual: float) -> NDArray[np.intp]:
    """The rows in which something changed, and every so many where nothing does for long: a robot at rest is read as
    well."""
    edges, step = np.r_[0, rows, count], round(usual)
    found = [np.arange(a, b, step) if b - a > AT_REST * usual else np.array([a]) for a, b in pairwise(edges) if a < b]
    return np.concatenate(found)


def written_late(column: Array, rows: NDArray[np.intp], times_s: Array) -> int | None:
    """How many rows behind those in which sensors were read (``rows``) a column (T,) changes, for loggers write one quantity
    after the other; None where it changes at other ``times_s`` (T,), and is no reading of theirs."""
    changed = np.flatnonzero(np.diff(column)) + 1
    changed = changed[changed >= rows[0]]
    if len(changed) < FEWEST:
        return None
    own = rows[np.searchsorted(rows, changed, side="right") - 1]
    late, late_s = changed - own, times_s[changed] - times_s[own]
    usual = int(np.argmax(np.bincount(late)))
    # As many rows later at all times, where each row comes with a sensor of its own, is another reading.
    wander_s = float(np.ptp(np.quantile(late_s, [1 - TOGETHER, TOGETHER])))
    steady = wander_s <= (1 - MOSTLY) * float(np.median(np.diff(times_s[rows])))
    return usual if steady and (late == usual).mean() >= TOGETHER else None


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
