"""What of a quick force belongs to places: a joint that passes a place again meets cogging, a worn tooth or a magnet again, and
never the same noise.

Noise is told from second differences, which a force that changes quickly along the way has too. So waves over the joint's own
position (each with a part that turns with the direction of motion) are fitted to the second differences in one half of the time
and taken off in the other: what that makes smaller was no noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ee_dist.discrepancy.problem import Index, Mask
from ee_dist.measurements.sampling import LowPass, decimated
from ee_dist.trials.log import Array

PIECES = 12
"""Of a trial's time, which take turns in being fitted and in being judged."""
MOST_ROWS, MOST_WAVES, MOST_ADDED = 3000, 600, 12
"""Rows that are looked at, spread evenly; wavelengths tried; and waves added: a few, for they are meant to be seen."""
FINE, FINER = 4, 33
"""Wavenumbers tried within the least by which two waves along the whole way differ, and between neighbours of the best."""
PASSED = 0.8
"""Share of half the rate up to which decimated forces hold all there is."""
OUTLIER = 4.0
"""Deviations at which a second difference is cut for a fit: a reversal's jump would otherwise be all that is fitted."""
LUCK = 30.0 * 16 / 6
"""Energy, in variances, that the best of all waves takes off by chance: of some hundred tried, with four numbers each, in
differences whose neighbours are alike (by 16/6 at most)."""


SECOND = np.array([1.0, -2.0, 1.0])
"""A second difference."""


@dataclass(frozen=True, eq=False)
class Way:
    """One joint in one trial: ``position`` and ``speed`` (T,) as they were read, and the ``force`` (R,), every n-th row of it."""

    position: Array
    speed: Array
    force: Array


def share_of_no_place(ways: Sequence[Way], keep_every: int, step_s: float, low_pass: LowPass) -> float:
    """Share of the quick part of a force, by its squared second differences, that waves over the position do not foretell.
    ``step_s``: of the readings; ``low_pass``: that forces went through before some of their rows were kept. Of long records only
    some rows are looked at."""
    seen = _Seen(ways, keep_every, step_s, low_pass)
    left = seen.change.copy()
    if not len(seen.numbers):
        return 1.0
    for turn in range(2):
        held = seen.piece % 2 == turn
        left[held] -= seen.foretold(~held)[held]
    # Medians, as of noise: a few jumps are no part of it.
    of = np.unique(seen.trial)
    quick, rest = (sum(float(np.median(x[seen.trial == k] ** 2)) for k in of) for x in (seen.change, left))
    return min(rest / quick, 1.0) if quick else 1.0


class _Seen:
    """Rows of all trials, one after the other: ``trial``, ``piece``, second difference ``change``, all (n,), and the
    ``numbers`` (W,) of waves for each rad or m that may show in them."""

    def __init__(self, ways: Sequence[Way], keep_every: int, step_s: float, low_pass: LowPass) -> None:
        self.ways, self.every, self.step_s, self.low_pass = ways, keep_every, step_s, low_pass
        counts = [len(w.force) - 2 for w in ways]
        thinned = slice(None, None, max(1, -(-sum(counts) // MOST_ROWS)))
        self.trial: Index = np.repeat(np.arange(len(ways)), counts)[thinned]
        pieces = [np.arange(c) * PIECES // max(c, 1) + k for k, c in enumerate(counts)]
        self.piece: Index = np.concatenate(pieces)[thinned]
        first = np.concatenate([np.arange(c) + sum(counts[:k]) + 2 * k for k, c in enumerate(counts)])[thinned]
        self.rows = first[:, None] + np.arange(3)
        self.change = self._changed([w.force for w in ways])
        places = np.concatenate([decimated(w.position, keep_every) for w in ways])
        self.places = places[self.rows]
        self.speed = np.concatenate([decimated(w.speed, keep_every) for w in ways])[self.rows[:, 1]]
        self.fastest = PASSED * 0.5 / (step_s * keep_every)
        span = float(np.ptp(places))
        pace = float(np.median(np.abs(self.speed)))
        count = int(min(FINE * span * self.fastest / pace, MOST_WAVES)) if span and pace else 0
        self.numbers = (np.arange(count) + 1) / (FINE * span) if count else np.zeros(0)

    def _changed(self, series: Sequence[Array]) -> Array:
        """(n,) second differences of a series by trial, each (R,)."""
        return np.concatenate(series)[self.rows] @ SECOND

    def shapes(self, numbers: Array) -> Array:
        """(n, W, 4): second differences of cosine and sine over position, as they are and turned with the direction of motion;
        nothing where the joint is so quick that a filter takes the wave away."""
        slow: Mask = np.abs(self.speed)[:, None] * numbers < self.fastest
        angle = 2 * np.pi * self.places[:, :, None] * numbers
        return self._turned([np.where(slow, SECOND @ turned(angle), 0.0) for turned in (np.cos, np.sin)])

    def wave(self, number: float) -> Array:
        """(n, 4): the same of one wave, as the filter leaves it."""
        angles = [2 * np.pi * number * w.position for w in self.ways]
        return self._turned([self._changed([self._thinned(f(a)) for a in angles])[:, None] for f in (np.cos, np.sin)])[
            :, 0
        ]

    def _thinned(self, series: Array) -> Array:
        """(R,) of a series (T,): what the filters leave."""
        return decimated(self.low_pass(series, self.step_s), self.every)

    def _turned(self, both: Sequence[Array]) -> Array:
        sign = np.sign(self.speed)[:, None]
        return np.stack([*both, *(b * sign for b in both)], axis=2)

    def foretold(self, fitted: Mask) -> Array:
        """(n,) what the waves that take most off the rows ``fitted``, one after another, make of all rows."""
        cut = OUTLIER * float(np.median(np.abs(self.change))) / 0.6745
        target = np.clip(self.change, -cut, cut)[fitted]
        shapes = self.shapes(self.numbers)[fitted]
        out, left, waves = np.zeros(len(self.change)), target, np.zeros((len(self.change), 0))
        for _ in range(MOST_ADDED):
            gains = _gains(shapes, left)
            best = int(np.argmax(gains))
            if gains[best] <= LUCK * float(np.mean(left**2)):
                break
            near = self.numbers[best] + np.linspace(-1, 1, FINER) * self.numbers[0]
            number = near[int(np.argmax(_gains(self.shapes(near)[fitted], left)))]
            waves = np.concatenate([waves, self.wave(float(number))], axis=1)
            values = np.linalg.lstsq(waves[fitted], target, rcond=1e-6)[0]
            out = waves @ values
            left = target - out[fitted]
        return out


def _gains(shapes: Array, left: Array) -> Array:
    """(W,) energy that each wave takes off."""
    inverse = np.linalg.pinv(np.einsum("nwi,nwj->wij", shapes, shapes), rcond=1e-6, hermitian=True)
    along = np.einsum("nwi,n->wi", shapes, left)
    return np.asarray(np.einsum("wi,wij,wj->w", along, inverse, along))
