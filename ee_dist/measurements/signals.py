"""What two signals have to do with one another: one is the change of the other, or runs ahead of it, or is a multiple."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import fftconvolve

from ee_dist.trials.log import Array

LONGEST_LAG_S, LONGER_LAG_S = 0.5, 2.0
AT_THE_END = 0.9
"""Share of the longest lag from which the best is looked for farther on: at the end of what was tried it is none. Whoever leads
an arm by another one, or over a network, waits for a second."""
BETTER = 0.5
"""Share of what the correlation lacks that it may lack there: a slow motion goes with itself nearly as well a little later."""
MOST_ROWS = 20_000
AS_GOOD = 0.02
"""Correlations this close to the best fit as well as it does."""
AGAINST = -0.5
"""Correlation below which a joint runs against its command."""
HARDLY = 0.02
"""A joint that moves by less than this share of what is usual among its like hardly moves: it is stuck, or creeps."""


@dataclass(frozen=True)
class Relation:
    """Correlation, and by how much the second is to be multiplied to be the first (median over what moves)."""

    correlation: float
    slope: float


@dataclass(frozen=True)
class Lead:
    """By how long (s) the first runs ahead of the second where they fit best, the correlation there (its size the mean of the
    joints' sizes, its sign that of most), the slope of the first over the second, and whether another shift fits as well:
    a motion that repeats itself tells neither the lead nor the sign for certain."""

    lead_s: float
    correlation: float
    slope: float
    repeats: bool = False


TOGETHER = 0.99
"""Correlation from which a lag that is shorter than a step can be told."""
TOLD, ROUNDING = 4.0, 1e-9
"""Times as much as the best correlation that another must lack to be told from it: what is left there is twice as large. And what
rounding leaves of the first."""
SMOOTHER = 0.05
"""What was planned has less than this share of the noise of what was measured, in fourth differences of which a fifth may be
larger: a plan has corners."""
LEAST_GOING, MOST_HELD = 20, 0.3
"""Rows in motion that are needed to tell, and the share of them in which what has noise may stand still."""


def apart(asked: Array, seen: Array) -> Array:
    """(J,) how far a series (T,) is from each of others (T, J): root mean squares."""
    return np.asarray(np.sqrt(np.mean((asked - seen[:, None]) ** 2, axis=0)))


def moves(values: Array) -> bool:
    """Whether a series does anything."""
    return bool(np.isfinite(values).all() and np.ptp(values) > 1e-12 * max(1.0, float(np.abs(values).max())))


def lively(*blocks: Array) -> list[int]:
    """The joints that move in each of some blocks (T, J), without those that hardly do beside the others: what such a joint
    does is friction and noise, and says nothing of what blocks have to do with one another."""
    found = set(range(blocks[0].shape[1]))
    for values in blocks:
        spans = np.array([float(np.ptp(c)) if moves(c) else 0.0 for c in values.T])
        least = HARDLY * usual(spans)
        found &= {k for k, span in enumerate(spans) if span > 0 and span >= least}
    return sorted(found)


def usual(spans: Array) -> float:
    """How far joints move: the median of those that do; of seven of which two are driven, beside which the median hardly moves,
    how far those go from which half of all motion comes."""
    if not (spans > 0).any():
        return 0.0
    median, order = float(np.median(spans[spans > 0])), np.sort(spans)[::-1]
    driven = float(order[np.searchsorted(np.cumsum(order), 0.5 * float(order.sum()))])
    return driven if median < HARDLY * driven else median


def smooth(values: Array, width: int) -> Array:
    """Centred mean over an odd number of rows, along the first axis."""
    width |= 1
    if width <= 1 or len(values) <= width:
        return values
    total = np.cumsum(np.concatenate([np.zeros((1, *values.shape[1:])), values]), axis=0)
    middle = (total[width:] - total[:-width]) / width
    half = width // 2
    return np.concatenate([np.repeat(middle[:1], half, axis=0), middle, np.repeat(middle[-1:], half, axis=0)])


def change(values: Array, step_s: float, window_s: float = 0.04) -> Array:
    """The derivative (T, J) of a series behind a mean over ``window_s``, twice, so that noise does not drown it."""
    width = max(3, round(window_s / step_s))
    return np.gradient(smooth(smooth(values, width), width), step_s, axis=0)


def relation(a: Array, b: Array) -> Relation:
    """How far ``b`` (T, J) times a number is ``a`` (T, J): the joint that fits worst decides the correlation, of those that do
    more than hardly move."""
    found = []
    for k in lively(a, b):
        x, y = a[:, k] - a[:, k].mean(), b[:, k] - b[:, k].mean()
        found.append((float(x @ y / np.sqrt((x @ x) * (y @ y))), float(x @ y / (y @ y))))
    if not found:
        return Relation(0.0, 0.0)
    worst = min(found, key=lambda f: abs(f[0]))
    return Relation(worst[0], float(np.median([f[1] for f in found])))


def each(a: Array, b: Array) -> list[Relation]:
    """The relation joint by joint."""
    return [relation(a[:, [k]], b[:, [k]]) for k in range(a.shape[1])]


def derivative(position: Array, speed: Array, step_s: float) -> Relation:
    """How far ``speed`` is the change of ``position``; slope in units of speed per unit of change."""
    return relation(*speed_and_change(position, speed, step_s))


def speed_and_change(position: Array, speed: Array, step_s: float) -> tuple[Array, Array]:
    """Both (T, J), smoothed alike, without their ends: there the mean of a position stands still, and its change is none."""
    width = max(3, round(0.04 / step_s)) | 1
    pair = smooth(smooth(speed, width), width), change(position, step_s)
    return pair if len(speed) < 4 * width else (pair[0][width:-width], pair[1][width:-width])


def lead(a: Array, b: Array, step_s: float, asked: bool = False) -> Lead:
    """By how much ``a`` (T, J) runs ahead of ``b`` (T, J), over shifts of half a second either way, or two where the best is at
    the end of these and another is better. Of shifts that fit alike the one that turns the fewest signs is taken, then the
    shortest. Joints that hardly move do not count. ``asked``: the first is called what was asked for, which leads where that fits
    as well: goals that come evenly along a slope go with a joint an interval earlier as with one that is late."""
    columns = lively(a, b)
    near, far = (min(round(longest / step_s), len(a) // 3) for longest in (LONGEST_LAG_S, LONGER_LAG_S))
    if not columns or near < 1:
        return Lead(0.0, 0.0, 0.0)
    found = _lead(a[:, columns], b[:, columns], step_s, near, asked)
    if abs(found.lead_s) < AT_THE_END * near * step_s or far == near:
        return found
    other = _lead(a[:, columns], b[:, columns], step_s, far, asked)
    at_end = abs(other.lead_s) >= AT_THE_END * far * step_s
    better = 1.0 - abs(other.correlation) <= BETTER * (1.0 - abs(found.correlation))
    return other if better and not at_end else found


def lags(asked: Array, seen: Array, step_s: float) -> dict[int, float]:
    """Seconds by which what was ``seen`` (T, J) is later than what was ``asked`` (T, J), finer than a step, by joint: where the
    two go together best, over shifts of half a second either way. It is the same of goals that stay for many rows as of smooth
    ones. Joints of which no shift is the best, or that hardly move, are left out."""
    most = min(round(LONGEST_LAG_S / step_s), len(asked) // 4)
    columns = lively(asked, seen)
    if most < 1 or not columns:
        return {}
    fits = _correlations(asked[:, columns], seen[:, columns], most)
    found = zip(columns, (_peak(f) for f in fits.T), strict=True)
    return {k: (p - most) * step_s for k, p in found if p is not None}


def _correlations(x: Array, y: Array, most: int) -> Array:
    """(2 * most + 1, J): correlation of the columns of ``x`` (T, J), read that much later from -most to most rows on, with the
    middle rows of ``y`` (T, J), which are the same for all shifts: another piece of a motion has another correlation."""
    x, y = x - x.mean(axis=0), y[most : len(y) - most]
    y = y - y.mean(axis=0)
    rows = len(y)
    both = fftconvolve(x, y[::-1], mode="valid", axes=0)
    sums, squares = (np.cumsum(np.concatenate([np.zeros((1, x.shape[1])), v]), axis=0) for v in (x, x * x))
    spread = squares[rows:] - squares[:-rows] - (sums[rows:] - sums[:-rows]) ** 2 / rows
    least = 1e-12 * (x * x).sum(axis=0)  # what rounding leaves of a piece that stands
    size = np.sqrt(np.maximum(spread, least) * (y * y).sum(axis=0))
    return np.asarray((both / np.where(size > 0, size, np.inf))[::-1])


def _peak(fits: Array) -> float | None:
    """Where a series of correlations is highest, finer than its places by a parabola. Of those that fit alike, as with goals that
    come evenly, the first from the middle on: nothing is ahead of what it is told. None where it fits badly, or other shifts on
    both sides of it do not fit worse: a ramp goes with itself whenever it is read."""
    if fits.max() < TOGETHER:
        return None
    middle = len(fits) // 2
    best = min(_tops(fits), key=lambda p: (p < middle - 1, abs(p - middle)), default=0)
    if not 0 < best < len(fits) - 1 or any(_alike(side.min(), fits[best]) for side in (fits[:best], fits[best + 1 :])):
        return None
    before, here, after = fits[best - 1 : best + 2]
    bend = 2.0 * here - before - after
    return best + (0.5 * float((after - before) / bend) if bend > 0 else 0.0)


def _tops(fits: Array) -> list[int]:
    """Places that are no lower than their neighbours and fit as the highest does; an end is none."""
    inner = fits[1:-1]
    top = (inner >= fits[:-2]) & (inner >= fits[2:])
    return [int(p) for p in np.flatnonzero(top) + 1 if _alike(fits[p], fits.max())]


def _alike(fit: float, best: float) -> bool:
    """Whether what a correlation lacks is not much more than what the best one lacks."""
    return bool(1.0 - fit < TOLD * (1.0 - best) + ROUNDING)


def _lead(x: Array, y: Array, step_s: float, most: int, asked: bool) -> Lead:
    """The same of joints that move (T, J), over so many rows either way."""
    stride = max(1, most // 100)
    shifts = sorted({*range(-most, most + 1, stride), 0})
    fits = np.stack([_shifted(x, y, k) for k in shifts])
    scores = np.abs(fits).mean(axis=1)
    peaks = _peaks(scores)
    best = min(peaks, key=lambda i: (int((fits[i] < AGAINST).sum()), abs(shifts[i])))
    if asked and shifts[best] < 0:
        ahead = [p for p in _tops(scores) if shifts[p] >= 0 and scores[p] >= scores.max() - AS_GOOD]
        best = max(ahead, key=lambda p: scores[p], default=best)
    k = shifts[best]
    p, q = (x[: len(x) - k], y[k:]) if k >= 0 else (x[-k:], y[:k])
    # A joint mounted the other way round must not take away from what the others say.
    size, against = float(np.abs(fits[best]).mean()), int((fits[best] < 0).sum())
    sign = -1.0 if 2 * against > x.shape[1] else 1.0
    return Lead(k * step_s, sign * size, relation(p, q).slope, len(peaks) > 1)


def _peaks(scores: Array) -> list[int]:
    """Places of the highest score and of others nearly as high, with a valley between each two."""
    high = np.flatnonzero(scores >= scores.max() - AS_GOOD)
    runs = np.split(high, np.flatnonzero(np.diff(high) > 1) + 1)
    return [int(run[np.argmax(scores[run])]) for run in runs]


def _shifted(x: Array, y: Array, k: int) -> Array:
    """Correlation of each column (J,) with ``y`` read ``k`` rows later."""
    p, q = (x[: len(x) - k], y[k:]) if k >= 0 else (x[-k:], y[:k])
    p, q = p - p.mean(axis=0), q - q.mean(axis=0)
    size = np.sqrt((p * p).sum(axis=0) * (q * q).sum(axis=0))
    return np.asarray((p * q).sum(axis=0) / np.where(size > 0, size, np.inf))


def beside(a: Array, b: Array, rest: Array) -> Relation:
    """The relation of ``a`` (T,) to ``b`` (T,) once what ``rest`` (T, K) explains is taken out of both."""
    basis = np.concatenate([rest, np.ones((len(a), 1))], axis=1)
    both = np.stack([a, b], axis=1)
    left = both - basis @ np.linalg.lstsq(basis, both, rcond=None)[0]
    return relation(left[:, [0]], left[:, [1]])


def roughness(values: Array) -> float:
    """How much of a series (T, J) changes from row to row, beside how much it changes at all; median over what moves."""
    found = [float(np.std(np.diff(c, 2)) / np.std(c)) for c in values.T if moves(c)]
    return float(np.median(found)) if found else 0.0


def planned_beside(a: Array, b: Array) -> bool:
    """Whether ``a`` (T, J) is smooth but for its rounding at every joint where ``b`` carries noise: nobody measured it."""
    found = lively(a, b)
    return bool(found) and all(_smoother(a[:, k], b[:, k]) for k in found)


def _smoother(a: Array, b: Array) -> bool:
    # Only while it moves: at rest both may stand still. A value that is held from row to row is no noise.
    step = np.abs(np.diff(a))
    going = step > 0.2 * step.max()
    if going[:-3].sum() < LEAST_GOING or np.mean(np.diff(b)[going] == 0) > MOST_HELD:
        return False
    rough = [float(np.quantile(np.abs(np.diff(x, 4))[going[:-3]], 0.8)) / float(np.ptp(x)) for x in (a, b)]
    return rough[0] < SMOOTHER * rough[1]
