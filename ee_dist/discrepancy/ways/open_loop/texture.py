"""How often channels repeat their last reading, which tells a sensor that drops out from one that is late; and of which kinds of
sensors nothing of it tells, for most of them are so."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from ee_dist.discrepancy.problem import Mask
from ee_dist.discrepancy.recorded import means_of
from ee_dist.discrepancy.ways.open_loop.prediction import Digest, block_sums, digest
from ee_dist.robots.model import Robot
from ee_dist.trials.log import Array

REPEATING = frozenset({"sensor_dropout", "sensor_quantisation"})
"""Effects that are told from others by how often a channel repeats a reading."""
ROUGH = "sensor_noise"
"""That which is told by how rough it is."""
FINEST, FASTER, ROUNDING = 0.05, 2.0, 1e-9
"""The share of the gaps between what a channel said below which its finest step lies, how many of these it must change by in a
row, or it may as well repeat a reading, and the share of its range below which a gap is what rounding made."""
ODD = 3.0
"""Standard deviations by which a channel repeats readings more often than the model's, to be odd."""
MOST, ENOUGH = 2 / 3, 3
"""Share of the channels of a kind that are odd, and channels that there must be, for it to be how these sensors are (coarse
steps, rows that were filled in) and not what is wrong with one."""


def moving(values: Array, window: int, least: Array | float = 0.0) -> Mask:
    """(R // window, S) whether readings (R, S) change by more than their finest step from one to the next, and within a window by
    more than is ``least`` to count: only there a reading that comes again tells of a sensor. Of an encoder at rest each one does,
    of one that creeps many do, and no simulation has its steps."""
    change, finest = _changes(values)
    rows = len(values) // window
    far = np.ptp(values[: rows * window].reshape(rows, window, values.shape[1]), axis=1) > least
    return np.asarray((block_sums(change, window) / window > FASTER * finest) & far)


def by_steps(values: Array, window: int) -> Array:
    """(R // window, S) share of the readings that come again because they are counted in steps: about as many as are one step
    higher, or one lower."""
    change, finest = _changes(values)
    one_step = (change > 0) & (change < 1.5 * finest)
    return np.asarray(block_sums(one_step.astype(float), window) / (2 * window))


def digest_held(values: Array, block: int, window: int) -> Digest:
    """The digest of a real log (R, S) without repeats that its sensors' steps explain."""
    found = digest(values, block, window)
    return replace(
        found, repeated=np.maximum(found.repeated - by_steps(values, window), 0.0).astype(found.repeated.dtype)
    )


def _changes(values: Array) -> tuple[Array, Array]:
    """From one reading to the next (R, S), and the finest step of each channel (S,)."""
    change = np.abs(np.diff(values, axis=0, prepend=values[:1]))
    return change, np.array([_finest(c) for c in values.T])


def _finest(values: Array) -> float:
    """The step in which a channel (R,) counts: that between neighbours among all that it ever said."""
    gaps = np.diff(np.unique(values[np.isfinite(values)]))
    gaps = gaps[gaps > ROUNDING * gaps.sum()]
    return float(np.quantile(gaps, FINEST)) if len(gaps) else 0.0


def frozen(measured: Digest, predicted: Digest, window: int) -> Array:
    """(windows, S): by how many standard deviations channels repeat readings more often than predicted."""
    p = 0.5 * (predicted.repeated + 1 / window)
    spread = np.sqrt(np.maximum(p * (1 - p), 1 / window) / window + 0.0004)
    return np.asarray((measured.repeated - predicted.repeated) / spread)


def repeating(robot: Robot, trials: Iterable[tuple[Digest, Digest, Mask, Mask]], window: int) -> frozenset[str]:
    """Kinds of sensors most of which repeat readings as the model's do not, from (measured, predicted, where that tells, which
    channels were recorded) of each trial."""
    found = [
        (np.maximum(frozen(m, p, window) * tells, 0.0) ** 2, recorded)
        for m, p, tells, recorded in trials
        if p.finite and len(p.repeated)
    ]
    return most_odd(robot, found)


def most_odd(robot: Robot, squares: Sequence[tuple[Array, Mask]]) -> frozenset[str]:
    """Kinds of sensors most of which are odd, from the squares (windows, S) of the standard deviations that each is off in a
    trial, and which channels were recorded there."""
    if not squares:
        return frozenset()
    means, own = np.stack([s.mean(axis=0) for s, _ in squares]), np.stack([recorded for _, recorded in squares])
    there = own.any(axis=0)
    odd = (means_of(means, own) > ODD**2)[there]
    kinds = np.array([s.kind for s in robot.sensors])[there]
    return frozenset(
        kind
        for kind in dict.fromkeys(kinds.tolist())
        if kind != "touch" and (kinds == kind).sum() >= ENOUGH and odd[kinds == kind].mean() >= MOST
    )
