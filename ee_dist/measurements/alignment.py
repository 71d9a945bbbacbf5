"""Tables with clocks of their own on one clock: as stated, or by where their signals fit best."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from ee_dist.trials.log import Array

EPOCH_S = 1e8
"""Times beyond this (1973) count from an epoch, not from the start of a record."""
LEAST_OVERLAP = 0.4
"""Share of the shorter record that must overlap at a lag that is considered."""
CLEAR = 0.85
"""Correlation that a match needs."""
APART, LEAST = 4.0, 0.02
"""Another lag must leave this many times what the best leaves, and this share more: it may not be the same motion again."""
MOST_POINTS = 400_000
SHARED = 0.9
"""Share of the stamps of the shorter record that the other has, too, if one clock made both."""
ROWS_APART = 0.02
"""Share of its rows that one of two records may have more than the other where both are of one logger."""
UNEVEN = 1e-6
"""Steps that differ by this share of one were measured, not counted: two records do not have the same by chance."""


@dataclass(frozen=True)
class Match:
    """``offset_s`` is what to add to the second clock; ``correlation`` at it; ``rival`` the best of clearly other lags."""

    offset_s: float
    correlation: float
    rival: float

    @property
    def clear(self) -> bool:
        return self.correlation > CLEAR and 1 - self.rival > APART * (1 - self.correlation) + LEAST


def one_epoch(a_s: Array, b_s: Array) -> bool:
    """Whether two clocks count from one epoch: both far from 0, and the records overlap by half of the shorter."""
    overlap = min(a_s[-1], b_s[-1]) - max(a_s[0], b_s[0])
    shorter = min(a_s[-1] - a_s[0], b_s[-1] - b_s[0])
    return bool(min(a_s[0], b_s[0]) > EPOCH_S and overlap > 0.5 * shorter)


def one_clock(a_s: Array, b_s: Array) -> bool:
    """Whether two tables were stamped by one clock: they count from one epoch, have the same uneven stamps, or begin and end
    together in the middle of its time."""
    if one_epoch(a_s, b_s) or _side_by_side(a_s, b_s):
        return True
    few, many = sorted((np.unique(a_s), np.unique(b_s)), key=len)
    steps = np.diff(few)
    if len(few) < 10 or np.ptp(steps) < UNEVEN * np.median(steps):
        return False
    return float(np.isin(few, many).mean()) > SHARED


def _side_by_side(a_s: Array, b_s: Array) -> bool:
    """Whether two records of as many rows begin and end at the same time, to a row, and not when their clocks do: a logger that
    counts from its own start begins at 0."""
    if min(len(a_s), len(b_s)) < 10 or abs(len(a_s) - len(b_s)) > ROWS_APART * len(a_s):
        return False
    step = max(_median(a_s), _median(b_s))
    begun = min(abs(float(a_s[0])), abs(float(b_s[0]))) > 2.0 * step
    return begun and all(abs(float(a - b)) < step for a, b in ((a_s[0], b_s[0]), (a_s[-1], b_s[-1])))


def match(a_s: Array, a: Array, b_s: Array, b: Array, held: bool) -> Match:
    """How to shift the clock of ``b`` (N, J) so that it fits ``a`` (T, J), by normalised cross-correlation over all lags,
    summed over channels; ``b`` is ``held`` between samples, or joined by lines. The peak is refined by a parabola."""
    step = max(min(_median(a_s), _median(b_s)), (a_s[-1] - a_s[0] + b_s[-1] - b_s[0]) / MOST_POINTS)
    ta = np.arange(a_s[0], a_s[-1] + 1e-9, step)
    tb = np.arange(b_s[0], b_s[-1] + 1e-9, step)
    x = np.stack([np.interp(ta, a_s, c) for c in a.T], axis=1)
    if held:
        y = b[np.clip(np.searchsorted(b_s, tb + 1e-12, side="right") - 1, 0, len(b) - 1)]
    else:
        y = np.stack([np.interp(tb, b_s, c) for c in b.T], axis=1)
    spread = x.std(axis=0), y.std(axis=0)
    moving = (spread[0] > 0) & (spread[1] > 0)
    if not moving.any():
        return Match(0.0, 0.0, 1.0)
    x = (x[:, moving] - x[:, moving].mean(axis=0)) / spread[0][moving]
    y = (y[:, moving] - y[:, moving].mean(axis=0)) / spread[1][moving]
    lags = scipy.signal.correlation_lags(len(x), len(y))
    top = sum(scipy.signal.correlate(x[:, k], y[:, k], method="fft") for k in range(x.shape[1]))
    # Energy of each record in what overlaps at every lag.
    ex, ey = np.r_[0, np.cumsum((x**2).sum(axis=1))], np.r_[0, np.cumsum((y**2).sum(axis=1))]
    first = np.maximum(lags, 0)
    last = np.minimum(len(x), len(y) + lags)
    energy = np.sqrt((ex[last] - ex[first]) * (ey[last - lags] - ey[first - lags]))
    enough = last - first >= LEAST_OVERLAP * min(len(x), len(y))
    score = np.where(enough & (energy > 0), top / np.maximum(energy, 1e-30), -1.0)
    best = int(np.argmax(score))
    shift = float(lags[best])
    if 0 < best < len(score) - 1 and enough[best - 1] and enough[best + 1]:
        left, here, right = score[best - 1 : best + 2]
        bend = left - 2 * here + right
        if bend < 0:
            shift += float(0.5 * (left - right) / bend)
    return Match(float(a_s[0] - b_s[0] + shift * step), float(score[best]), _rival(score, best))


def _rival(score: Array, best: int) -> float:
    """The highest score beyond the valley on either side of the peak."""
    low = 0.5 * score[best]
    left = np.flatnonzero(score[:best] < low)
    right = np.flatnonzero(score[best:] < low)
    outside = np.r_[score[: left[-1]] if len(left) else [], score[best + right[0] :] if len(right) else []]
    return float(outside.max()) if len(outside) else -1.0


def _median(times_s: Array) -> float:
    return float(np.median(np.diff(times_s)))
