"""Stamps that come in bunches, of rows that were read at an even pace: who stamps messages as they arrive (by USB, by a network)
stamps a late one and those behind it at once. By such stamps what moves stands still and jumps."""

from __future__ import annotations

import numpy as np

from ee_dist.trials.log import Array

SHORT, FEWEST, SHARE = 0.5, 10, 0.01
"""Rows bunch where steps are less than so much of the usual one, so many of them, and this share: lost rows make none such."""
STRETCH, AWAY = 100, 0.1
"""So many rows in a row take as long everywhere, but for this share: else rows are missing, or the pace was another."""
AROUND = 5
"""Rows to either side by which the speed at a row is told."""
OFF, MOVES, THROWN = 0.3, 5.0, 8.0
"""Judged at steps that are off by this share of the usual one, where a joint goes so many times its noise in the rows around, and
nowhere makes so many times the largest of most of its steps, as where an angle wraps."""
HELD = 0.25
"""Share of these that repeat the row before, from which a column is held there and was read at other times: of a log that has a
row for whatever came."""
BY_ROW = 0.35
"""Share of what stamps say beyond an even pace that positions may follow at most, with twice what is not known of it: 0 if
the rows are even, 1 if the stamps are right, as in logs of robots whose pace wanders."""


def pace_of(times_s: Array, readings: Array) -> float | None:
    """Seconds from row to row of rows that were read evenly, and whose stamps (T,) come in bunches; None where the stamps may be
    right, or nothing tells. ``readings`` (T, J): positions, in any unit."""
    rows = len(times_s)
    if rows < 4 * STRETCH or not np.isfinite(times_s).all():
        return None
    steps = np.diff(times_s)
    pace = float(np.polyfit(np.arange(rows), times_s - times_s[0], 1)[0])
    short = steps < SHORT * pace
    if (steps < 0).any() or not pace > 0 or short.sum() < max(FEWEST, SHARE * len(steps)):
        return None
    stretches = times_s[STRETCH:] - times_s[:-STRETCH]
    if np.abs(stretches / (STRETCH * pace) - 1).max() > AWAY:
        return None
    followed = _followed(steps / pace - 1, readings)
    return pace if followed is not None and followed < BY_ROW else None


def _followed(off: Array, readings: Array) -> float | None:
    """How much of what steps in time are ``off`` (T - 1,), in paces, positions (T, J) follow, at most; None: nothing tells."""
    asked, seen = [], []
    for column in readings.T:
        if not np.isfinite(column).all():
            continue
        went = np.diff(column)
        around = 2 * AROUND + 1
        speed = np.convolve(went, np.ones(around) / around, "same")
        noise = 1.5 * float(np.median(np.abs(np.diff(column, 2)))) / np.sqrt(6)
        thrown = np.abs(went) > THROWN * float(np.quantile(np.abs(went), 0.9))
        told = (np.abs(off) > OFF) & (around * np.abs(speed) > MOVES * noise)
        told &= np.convolve(thrown, np.ones(around), "same") < 0.5
        told[:AROUND] = told[len(told) - AROUND :] = False
        if told.any() and np.mean(went[told] == 0) < HELD:
            size = float(np.sqrt(np.mean(speed[told] ** 2)))
            asked.append(speed[told] * off[told] / size)
            seen.append((went[told] - speed[told]) / size)
    if not asked:
        return None
    x, y = np.concatenate(asked), np.concatenate(seen)
    if len(x) < FEWEST or not (total := float(x @ x)) > 0:
        return None
    share = float(x @ y) / total
    return share + 2 * float(np.sqrt(np.sum((x * (y - share * x)) ** 2))) / total
