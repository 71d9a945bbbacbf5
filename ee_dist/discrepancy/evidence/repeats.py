"""Whether two records are of one motion: the same course, begun at the same time or later in it."""

from __future__ import annotations

import numpy as np
import scipy

from ee_dist.trials.log import Array

SAME_LENGTH = 0.9
"""Share of the longer of two that the other must be to be held against it row by row."""
OVERLAP, INSIDE = 0.5, 0.7
"""Share of the shorter of two that must lie within the other, wherever it begins, and how much of its variation there: that two
robots rest alike says nothing."""

CROSSINGS = 4
"""How often what most of them does must pass its middle: of two ramps some part is always alike."""


def near(one: Array, other: Array, share: float) -> bool:
    """Whether two courses (T, M) differ by less than a share of how much they vary, row by row."""
    motions = [np.asarray(one), np.asarray(other)]
    rows = min(map(len, motions))
    if rows < SAME_LENGTH * max(map(len, motions)):
        return False
    # Where the drives were released there is no command: nearly at the same time in repeats, and not to the row.
    first, second = motions[0][:rows], motions[1][:rows]
    both, either = (f(np.isfinite(first), np.isfinite(second)) for f in (np.logical_and, np.logical_or))
    if not both.any() or both.sum() < SAME_LENGTH * either.sum():
        return False
    gap = np.sqrt(np.mean((first - second) ** 2, where=both))
    varies = [np.nanvar(column) for column in first.T if np.isfinite(column).any()]
    return bool(gap <= share * np.sqrt(np.mean(varies)))


def near_later(one: Array, other: Array, share: float) -> bool:
    """Whether they do so where one begins later than the other: a gait that was recorded again at another moment of it."""
    short, long = sorted((np.asarray(one), np.asarray(other)), key=len)
    if not (len(short) > 2 and np.isfinite(short).all() and np.isfinite(long).all()):
        return False
    middle = long.mean(axis=0)
    short, long = short - middle, long - middle
    rows, least = len(short), max(2, int(OVERLAP * len(short)))
    # Of a shift s, row k of the short one lies beside row k + s of the long one.
    shifts = np.arange(least - rows, len(long) - least + 1)
    first, last = np.maximum(0, -shifts), np.minimum(rows, len(long) - shifts)
    across = np.sum([scipy.signal.fftconvolve(b, a[::-1]) for a, b in zip(short.T, long.T, strict=True)], axis=0)
    mine, its = (np.concatenate([[0.0], np.cumsum((x**2).sum(axis=1))]) for x in (short, long))
    squares = mine[last] - mine[first] + its[last + shifts] - its[first + shifts] - 2.0 * across[shifts + rows - 1]
    gap = np.maximum(squares, 0.0) / (last - first)
    for k in np.argsort(gap, kind="stable")[:3]:
        inside = short[first[k] : last[k]].var(axis=0).sum()
        whole = min(short.var(axis=0).sum(), long.var(axis=0).sum())
        if inside >= INSIDE * whole > 0 and gap[k] <= share**2 * inside:
            return _crossings(short[first[k] : last[k]]) >= CROSSINGS
    return False


def between_rows(course: Array) -> float:
    """By which share of how much a course (T, M) varies another record of it may differ only because its rows lie elsewhere,
    up to half a row beside these: a step from row to row, evenly spread."""
    steps, varies = np.diff(course, axis=0), course.var(axis=0).sum()
    return float(np.sqrt((steps**2).sum(axis=1).mean() / 12.0 / varies)) if varies > 0 and len(steps) else 0.0


def _crossings(course: Array) -> int:
    """How often the liveliest of a course (T, M) passes its middle, but for what trembles about it."""
    most = course[:, np.argmax(course.var(axis=0))]
    away = np.sign(most - most.mean())[np.abs(most - most.mean()) > 0.3 * most.std()]
    return int(np.count_nonzero(np.diff(away)))
