"""Rows in which nothing was read: several channels at one and the same number at once, far from before, and back again.

Buses of servos answer so when a packet is lost: every joint at the end of its counter, -3.1416 rad, for a row or a few. Left
in, three such rows of ten thousand decide in which unit the numbers are, and what the joints reach.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ee_dist.measurements.errors import MeasurementError
from ee_dist.measurements.table import Table
from ee_dist.trials.log import Array

CHANNELS = 3
"""So many channels at least go to the same number together."""
STEP, BACK = 10.0, 0.5
"""They go by so many times what most rows change by, at most this share of which is missing when they are back;"""
LONGEST, MOST = 5, 0.1
"""within so many rows, once at least; and no more than this share of all rows is left out."""
OUTSIDE = 0.05
"""The number is none of theirs: so much of its range beyond what nearly all other rows of a channel hold."""


def without_lost(table: Table) -> Table:
    """The table without such rows, and a note on them; the table itself where there are none."""
    names, values = _numbers(table)
    if len(table) < 20 or values.shape[1] < CHANNELS:
        return table
    lost, at = _lost_rows(values)
    if not lost.any() or lost.mean() > MOST:
        return table
    first = int(np.flatnonzero(lost)[0])
    shown = ", ".join(names[k] for k in at[:3]) + (f" and {len(at) - 3} more" if len(at) > 3 else "")
    note = (
        f"{int(lost.sum())} of {len(lost)} rows were not read and are left out: {shown} all go to {values[first, at[0]]:.6g} "
        f"at once and back, first in row {table.line(first)}"
    )
    return replace(table.part(~lost), notes=(*table.notes, note))


def _numbers(table: Table) -> tuple[list[str], Array]:
    """Names and values (T, C) of the columns that can be read as numbers, in most rows."""
    names, found = [], []
    for address in table.addresses():
        try:
            read = table.numbers(address, gaps=True)
        except MeasurementError:  # a text, or one name for several columns
            continue
        if np.isfinite(read).mean() > 0.5:  # of others no two rows need follow one another
            names.append(address)
            found.append(read)
    return names, np.stack(found, axis=1) if found else np.zeros((len(table), 0))


def _lost_rows(values: Array) -> tuple[np.ndarray, list[int]]:
    """(T,) which rows of values (T, C) are so, and the columns of which the first such row tells."""
    rows = len(values)
    steps = np.abs(np.diff(values, axis=0))
    usual = np.nanquantile(steps, 0.9, axis=0) if rows > 1 else np.zeros(values.shape[1])
    spread = np.nanquantile(values, 0.95, axis=0) - np.nanquantile(values, 0.05, axis=0)
    far = steps > np.maximum(STEP * usual, 0.1 * spread)
    lost = np.zeros(rows, dtype=bool)
    told: list[int] = []
    for k in np.flatnonzero(far.sum(axis=1) >= CHANNELS) + 1:
        if lost[k]:
            continue
        moved = np.flatnonzero(far[k - 1])
        same, counts = np.unique(values[k, moved], return_counts=True)
        which = moved[values[k, moved] == same[np.argmax(counts)]]
        if counts.max() < CHANNELS:
            continue
        ahead = values[k : k + LONGEST, which] == values[k, which]
        end = k + int(np.argmin(ahead.all(axis=1))) if not ahead.all() else rows
        back = end < rows and np.abs(values[end, which] - values[k - 1, which]) < BACK * steps[k - 1, which]
        if not np.all(back) or end == rows:
            continue
        # Also where they moved on meanwhile, or one of them was close to it.
        there = (values[:, which] == values[k, which]).sum(axis=1) >= CHANNELS
        if _is_outside(values[~there][:, which], values[k, which]).sum() >= CHANNELS:
            lost |= there
            told = told or which.tolist()
    return lost, told


def _is_outside(others: Array, number: Array) -> np.ndarray:
    """(C,) whether a number is none that a channel has in ``others`` of its rows (T, C): touch sensors that open together and
    motors that are all told nothing for a moment are at numbers of their own."""
    low, high = np.nanquantile(others, [0.005, 0.995], axis=0)
    room = OUTSIDE * (high - low)
    return np.asarray((number < low - room) | (number > high + room))
