"""When sensors were read: in which rows of a file, and between which rows of the grid that it is brought to."""

from __future__ import annotations

from collections.abc import Mapping as AnyMapping
from collections.abc import Sequence
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from ee_dist.measurements.clocks import Clocked
from ee_dist.measurements.held_readings import held_readings, read_in_turn
from ee_dist.measurements.mapping import Column, Mapping
from ee_dist.measurements.sampling import filled
from ee_dist.trials.log import GAP, Array

Rows = NDArray[np.intp]
SHOWN = 3
"""Runs of empty cells that are told by themselves."""


def rows_read(
    mapping: Mapping, clocks: AnyMapping[str, Clocked], paces: AnyMapping[str, float] | None = None
) -> dict[str, Rows]:
    """The rows of each table that sensors are read from in which they were. ``paces``: the seconds between readings by table, in
    other trials of the same logger. Raises MeasurementError for cells that hold no number."""
    by_table: dict[str, list[Column]] = {}
    for column in mapping.sensors.values():
        if isinstance(column, Column):
            by_table.setdefault(column.table, []).append(column)
    out = {}
    for name in sorted(by_table):
        own = clocks[name]
        count = len(own.times_s)
        read = [own.table.numbers(c.column, gaps=c.gaps == "interpolate") for c in by_table[name]]
        pace = (paces or {}).get(name)
        every = None if pace is None or not own.timing.median_s else pace / own.timing.median_s
        rows = held_readings(np.stack(read, axis=1), every)
        if rows is None and (each := [r for c in read if (r := read_in_turn(c, own.times_s, pace)) is not None]):
            rows = max(each, key=len)
        out[name] = np.arange(count) if rows is None else rows
    return out


def holes(mapping: Mapping, clocks: AnyMapping[str, Clocked]) -> dict[str, list[tuple[str, Rows]]]:
    """The long runs of empty cells in the columns of sensors, by table: (channel, rows). A line across one is no measurement; the
    few cells that a reading is missing in now and then, or that other columns are written in between, are as good as joined."""
    found: dict[str, list[tuple[str, Rows]]] = {}
    for channel, c in mapping.sensors.items():
        if not isinstance(c, Column) or c.gaps != "interpolate":
            continue
        own = clocks[c.table].table
        count, good = len(clocks[c.table].times_s), np.flatnonzero(np.isfinite(own.numbers(c.column, gaps=True)))
        if len(good) < 2:
            continue
        ends = np.concatenate([[-1], good, [count]])
        for k in np.flatnonzero(np.diff(ends) > GAP * float(np.median(np.diff(good)))):
            found.setdefault(c.table, []).append((channel, np.arange(ends[k] + 1, ends[k + 1])))
    return found


def holes_told(empty: AnyMapping[str, Sequence[tuple[str, Rows]]], clocks: AnyMapping[str, Clocked]) -> list[str]:
    """A line for each of the first ``holes``."""
    lines = []
    for name, found in empty.items():
        for channel, rows in found[:SHOWN]:
            times_s, row = clocks[name].times_s, clocks[name].table.line(int(rows[0]))
            lasting = (len(rows) + 1) * float(np.median(np.diff(times_s)))
            run = f"{len(rows)} empty cells one after another from row {row} on, {lasting:.3g} s"
            lines.append(f"{channel}: {run}: nothing there is compared")
        if len(found) > SHOWN:
            lines.append(f"and {len(found) - SHOWN} more such runs of empty cells")
    return lines


def paces_of(clocks: AnyMapping[str, Clocked], read_at: AnyMapping[str, Rows]) -> dict[str, float]:
    """Seconds between readings by table, of those in which not all rows are readings."""
    return {
        name: float(np.median(np.diff(clocks[name].times_s[rows])))
        for name, rows in read_at.items()
        if 1 < len(rows) < len(clocks[name].times_s)
    }


def told_of(clocks: AnyMapping[str, Clocked], read_at: AnyMapping[str, Rows]) -> list[str]:
    """A line for each table of which not all rows are readings."""
    paces = paces_of(clocks, read_at)
    counts = {name: (len(clocks[name].times_s), len(read_at[name])) for name in paces}
    return [
        f"the sensors were read every {1e3 * paces[name]:.4g} ms: {count - read} of {count} rows repeat readings of rows "
        "before, and count as none"
        for name, (count, read) in counts.items()
    ]


def between_readings(
    at_s: Array,
    rows_s: Array | None,
    main: Clocked,
    clocks: AnyMapping[str, Clocked],
    read_at: AnyMapping[str, Rows],
    done: list[str],
    none: AnyMapping[str, Sequence[Rows]] = MappingProxyType({}),
) -> Array | None:
    """(T,) whether nothing was read at the times ``at_s`` (T,) of the grid, by the table that is read the most seldom; None where
    all may be readings. ``rows_s`` (T,): when rows that are taken sample by sample were; ``none``: rows that are not."""
    read_at = {t: np.setdiff1d(rows, np.concatenate(none.get(t) or [rows[:0]])) for t, rows in read_at.items()}
    read = [clocks[t].times_s[rows] for t, rows in read_at.items() if len(rows) > 1] or [main.times_s]
    # The grid begins where the main table does.
    read_s = max(read, key=lambda times_s: float(np.median(np.diff(times_s)))) - main.times_s[0]
    if rows_s is not None:
        read_s = np.interp(read_s[(read_s >= 0) & (read_s <= rows_s[-1])], rows_s, at_s)
    found = filled(at_s, read_s)
    if found is not None:
        some, rows = int((~found).sum()), len(found)
        done.append(
            f"{some} of {rows} rows are readings of the sensors: only these are compared"
            if some <= len(read_s)
            else f"{rows - some} of {rows} rows lie in gaps between readings: they are not compared"
        )
    return found
