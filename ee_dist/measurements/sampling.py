"""Time as it was recorded, and signals brought onto an even grid."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import scipy
from numpy.typing import NDArray

from ee_dist.basics.quoted import quoted
from ee_dist.measurements.errors import MeasurementError
from ee_dist.measurements.table import Table
from ee_dist.trials.log import GAP, Array

EVEN = 0.02
"""Steps that differ by less than this share of their median count as even."""
LONGEST = 1e7
"""Rows of one trial: a thousand a second for nearly three hours."""
MOST_AT_ONCE = 13
"""Samples of which one is kept in a single step."""
SLACK = 1e-3
"""Share of a step by which a time stamp may be late and still be the row's own."""
FILLED = 1.5
"""Rows for each reading from which most rows are no readings, and only those that are count."""
AGAIN = 0.2
"""Share of the rows that may bear the time of the row before: loggers that stamp to the millisecond, or when they write, have
some."""


@dataclass(frozen=True)
class Timing:
    """What a time column looks like: median step (s), shortest and longest, gaps as (row, length in s)."""

    median_s: float
    shortest_s: float
    longest_s: float
    gaps: tuple[tuple[int, float], ...]

    @property
    def even(self) -> bool:
        return max(self.longest_s - self.median_s, self.median_s - self.shortest_s) <= EVEN * self.median_s


def check_times(times_s: Array, table: Table, column: str) -> Timing:
    """Raises MeasurementError where time stands still or runs backwards, naming the row, and for a single row."""
    if len(times_s) < 2:
        raise MeasurementError(f"{table}: one row only; expected a series (zero length in time)")
    steps = np.diff(times_s)
    wrong = np.flatnonzero(steps <= 0)
    if len(wrong):
        row = int(wrong[0]) + 1
        how = "runs backwards" if steps[row - 1] < 0 else "stands still"
        first = float(np.median(np.abs(steps)))
        several = "; several trials in one file? add 'split: restarts'" if steps[row - 1] < -10 * first else ""
        more = f", and in {len(wrong) - 1} rows more" if len(wrong) > 1 and not several else ""
        if (steps >= 0).all() and len(wrong) > AGAIN * len(steps) and times_s[-1] > times_s[0]:
            rate = float(f"{len(steps) / (times_s[-1] - times_s[0]):.4g}")
            more += f"; if they were read at an even pace, write 'time: {{rate_hz: {rate:g}}}' into the mapping"
        raise MeasurementError(
            f"{table}: row {table.line(row)}, column {quoted(column)}: time {how} "
            f"({times_s[row - 1]:.9g} s, then {times_s[row]:.9g} s){more}{several}"
        )
    median = float(np.median(steps))
    long = np.flatnonzero(steps > GAP * median)
    gaps = tuple((table.line(int(i) + 1), float(steps[i])) for i in long)
    return Timing(median, float(steps.min()), float(steps.max()), gaps)


def once_a_moment(times: Array) -> Array | None:
    """(K,) the last row of each moment, where a few rows of ``times`` (T,) bear that of the row before; None where none do, or
    so many that it is the clock that is wrong, or where time runs backwards: that is for ``check_times`` to say."""
    if len(times) < 3 or not np.isfinite(times).all():
        return None
    steps = np.diff(times)
    again = int((steps == 0).sum())
    if not again or again > AGAIN * len(steps) or (steps < 0).any():
        return None
    return np.flatnonzero(np.r_[steps > 0, True])


def grid(times_s: Array, step_s: float) -> Array:
    """Even times (T,) from 0 in steps of ``step_s`` that cover the record and do not go beyond it."""
    span = float(times_s[-1] - times_s[0])
    if not 0 < step_s < np.inf or not span / step_s < LONGEST:
        raise MeasurementError(
            f"{span:g} s in steps of {step_s:g} s are more than {LONGEST:.0e} rows; check the unit of the time column"
        )
    count = int(np.floor(span / step_s + 1e-6)) + 1
    return np.arange(count) * step_s


def linear(at_s: Array, times_s: Array, values: Array) -> Array:
    """Straight lines between samples: for states, which cannot jump."""
    return np.interp(at_s, times_s - times_s[0], values)


def filled(at_s: Array, read_s: Array) -> Array | None:
    """(T,) bool: times of an even grid, from 0 on, at which nothing was read, so that only straight lines between the readings
    of ``read_s`` (K,) are there; None where there are about as many readings as rows, and no gap among them."""
    if len(at_s) < 2 or len(read_s) < 2:
        return None
    step, apart = float(at_s[1] - at_s[0]), np.diff(read_s)
    # The first row that may know of a reading: what is held (commands, torques) is there from then on.
    rows = np.ceil(read_s / step - SLACK).astype(int)
    if float(np.median(apart)) < FILLED * step:
        # Nor is anything known before the first reading and after the last.
        apart = np.diff(np.concatenate([[-step], read_s, [at_s[-1] + step]]))
        rows = np.concatenate([[-1], rows, [len(at_s)]])
        return _lost(rows, apart > GAP * max(float(np.median(apart)), step), len(at_s))
    out = np.ones(len(at_s), dtype=bool)
    out[rows[(rows >= 0) & (rows < len(at_s))]] = False
    return out


def _lost(rows: NDArray[np.int64], gap: NDArray[np.bool_], count: int) -> NDArray[np.bool_] | None:
    """(count,) bool: rows within gaps between readings, each of which is in one of ``rows`` (K,); None without any gap."""
    out = np.zeros(count, dtype=bool)
    for k in np.flatnonzero(gap):
        out[max(0, rows[k] + 1) : max(0, rows[k + 1])] = True
    return out if out.any() else None


def carried(values: Array) -> Array:
    """A series (T,) with its empty cells (NaN): the last number before, for what is sent and stays until the next; before the
    first number that."""
    good = np.flatnonzero(np.isfinite(values))
    return values[good[np.maximum(np.searchsorted(good, np.arange(len(values)), side="right") - 1, 0)]]


def held(at_s: Array, times_s: Array, values: Array, lead_s: float = 0.0) -> Array:
    """The last sample, for what is sent and stays until the next: commands, switches.

    ``lead_s`` is how long before its time stamp a value took effect, where the stamp was taken after the sending.
    """
    # Times since an epoch are known to a quarter of a microsecond only.
    slack_s = max(1e-9, 4 * float(np.spacing(abs(times_s[-1]))))
    index = np.searchsorted(times_s - times_s[0] - lead_s, at_s + slack_s, side="right") - 1
    return values[np.clip(index, 0, len(values) - 1)]


def smoothed(values: Array, step_s: float, window_s: float) -> Array:
    """Centred mean over ``window_s``, ends held: for a reading noisier than what it reads (a supply voltage)."""
    width = round(window_s / step_s) | 1
    padded = np.pad(values, width // 2, mode="edge")
    return np.convolve(padded, np.ones(width) / width, "valid")


@dataclass(frozen=True)
class LowPass:
    """Butterworth low-pass of ``order``, run forward and backward (no phase), with its cut-off in Hz."""

    cutoff_hz: float = 50.0
    order: int = 4

    def __str__(self) -> str:
        return f"Butterworth low-pass, order {self.order}, {self.cutoff_hz:g} Hz, forward and backward"

    def __call__(self, values: Array, step_s: float) -> Array:
        """Filtered series (T,). Raises MeasurementError for a cut-off beyond the Nyquist frequency or too short a series."""
        share = 2 * self.cutoff_hz * step_s
        if not 0 < share < 1:
            raise MeasurementError(
                f"low-pass: cut-off {self.cutoff_hz:g} Hz must lie below half the rate, {0.5 / step_s:g} Hz"
            )
        b, a = scipy.signal.butter(self.order, share)
        if len(values) <= 3 * max(len(a), len(b)):
            raise MeasurementError(f"low-pass: {len(values)} rows are too few for a filter of order {self.order}")
        return np.asarray(scipy.signal.filtfilt(b, a, values))

    def speed(self, positions: Array, step_s: float) -> Array:
        """Speed (T,) by central differences of the filtered positions."""
        return np.gradient(self(positions, step_s), step_s)


@lru_cache(maxsize=16)
def _anti_alias(keep_every: int) -> tuple[Array, Array]:
    b, a = scipy.signal.cheby1(8, 0.05, 0.8 / keep_every)
    return b, a


def decimated(values: Array, keep_every: int) -> Array:
    """Every n-th sample after an anti-alias filter (Chebyshev I, order 8, 0.05 dB, at 0.8 of the new Nyquist frequency,
    forward and backward), along the first axis; the last sample is kept when n divides the length.

    This is the convention of MATLAB's ``decimate``, with which the published results on EMPS were made. Beyond
    ``MOST_AT_ONCE`` such a filter is numerically none: it is then done in steps.
    """
    if keep_every <= 1:
        return values
    if keep_every > MOST_AT_ONCE:
        step = next((k for k in range(10, 1, -1) if keep_every % k == 0), MOST_AT_ONCE)
        return decimated(decimated(values, step), keep_every // step)
    b, a = _anti_alias(keep_every)
    smooth = scipy.signal.filtfilt(b, a, values, axis=0, padlen=min(len(values) - 1, 3 * 8))
    first = keep_every - (keep_every * int(np.ceil(len(values) / keep_every)) - len(values)) - 1
    return np.asarray(smooth[first::keep_every])
