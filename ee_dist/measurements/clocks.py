"""The clocks of a trial's tables: when each row was, on one clock, and the even grid that the log is brought to."""

from __future__ import annotations

import contextlib
import re
from dataclasses import dataclass

import numpy as np

from ee_dist.basics.quoted import quoted
from ee_dist.measurements.bunched import pace_of
from ee_dist.measurements.errors import MeasurementError
from ee_dist.measurements.mapping import Column, Even
from ee_dist.measurements.sampling import Timing, check_times, once_a_moment
from ee_dist.measurements.table import Table
from ee_dist.measurements.units import UNITS, factor
from ee_dist.trials.log import Array

MOST_ROWS = 5_000_000
"""On the grid: an hour at 1 kHz."""
SLOW_S = 1.0
FASTEST_S, SLOWEST_S = 2e-4, 0.45
"""Steps of a robot's log. Nearly a factor of 1000 lies between them, so the size of most steps tells the unit."""
QUICKEST_S = 9e-5
"""The least of one that says its unit: servo drives log at 10 kHz."""
KEPT = 0.05
MOSTLY = 0.5
"""Share of its steps in which a column must rise to be a clock of these rows."""
_A_TIME = re.compile(r"time|clock|stamp", re.IGNORECASE)
TORN = 0.5
"""A single gap of more than this share of the record, or a record stretched by it, is a wrong time stamp."""


@dataclass
class Clocked:
    """A table with the seconds of its rows on the trial's clock, (T,)."""

    table: Table
    times_s: Array
    timing: Timing
    name: str = "row"
    """What says when its rows were: a column, or "row" where nothing does."""
    stamped: Array | None = None
    """Seconds (T,) that it says they were, where rows are taken at an even pace all the same."""

    @property
    def stamps_s(self) -> Array:
        return self.times_s if self.stamped is None else self.stamped


def times_of(table: Table, time: Column | Even | None, where: str) -> tuple[Array, str]:
    """Seconds (T,) of the rows of a table, and the name of what says so. Raises MeasurementError."""
    if isinstance(time, Even):
        return np.arange(len(table)) / time.rate_hz, "row"
    if time is None:
        if table.clock is not None:
            return table.numbers(table.clock), table.clock
        if table.rate_hz:
            return np.arange(len(table)) / table.rate_hz, "row"
        raise MeasurementError(
            f"{where}: missing key 'time': {table} does not say itself when its rows were; name the column, "
            "or 'time: {rate_hz: 100}'"
        )
    raw = table.numbers(time.column)
    return raw * factor(time.unit, "s", f"{where}: time") * time.scale, time.column


def clocked(table: Table, time: Column | Even | None, where: str, readings: Array | None = None) -> Clocked:
    """The main table's clock; of a few rows that bear the time of the row before the last counts. Where ``readings`` (T, J) of
    positions show that stamps come in bunches, and rows do not, rows are an even pace apart. Raises MeasurementError for times
    that stand still more often, run backwards, or jump beyond reason."""
    times_s, name = times_of(table, time, where)
    trusted = isinstance(time, Column) and time.sure
    if readings is not None and not trusted and (pace := pace_of(times_s, readings)) is not None:
        even = np.arange(len(times_s)) * pace
        even += float(np.mean(times_s - even))
        return Clocked(table, even, check_times(even, table, name), name, times_s)
    if (last := once_a_moment(times_s)) is not None:
        table, times_s = table.part(last), times_s[last]
    timing = check_times(times_s, table, name)
    length, steps = float(times_s[-1] - times_s[0]), np.diff(times_s)
    worst = int(np.argmax(steps))
    if len(steps) > 10 and steps[worst] > TORN * length and steps[worst] > max(60.0, 1000 * timing.median_s):
        raise MeasurementError(
            f"{table}: row {table.line(worst + 1)}, column {quoted(name)}: time jumps by {steps[worst]:.4g} s, the other rows "
            f"are {timing.median_s:.4g} s apart; a wrong time stamp? drop the rows on one side of it"
        )
    return Clocked(table, times_s, timing, name)


def other_clocks(main: Clocked) -> dict[str, float]:
    """How far the other columns of a table go that are called a time and rise from row to row, but for a few; whole seconds are
    off by up to one."""
    found: dict[str, float] = {}
    for address in main.table.addresses():
        if address == main.name or not _A_TIME.search(address):
            continue
        with contextlib.suppress(MeasurementError):
            values = main.table.numbers(address)
            if (np.diff(values) >= 0).all() and (np.diff(values) > 0).mean() > MOSTLY:
                found[address] = float(values[-1] - values[0])
    return found


def loosely_clocked(table: Table, time: Column | Even | None, where: str) -> Clocked:
    """The clock of a table beside the main one, which may have few rows; of rows with one stamp the last counts.

    Raises MeasurementError for times that run backwards.
    """
    times_s, name = times_of(table, time, where)
    last = np.r_[np.diff(times_s) != 0, True]
    if not last.all():
        table, times_s = table.part(np.flatnonzero(last)), times_s[last]
    if len(times_s) == 1:
        return Clocked(table, times_s, Timing(0.0, 0.0, 0.0, ()), name)
    return Clocked(table, times_s, check_times(times_s, table, name), name)


def check_grid(found: Clocked, step_s: float, rate_stated: bool, unit: str) -> None:
    """Raises MeasurementError where a step of ``step_s`` would lose nearly all rows, or make more than memory holds: most
    often the unit of the time is another one."""
    table, length = found.table, float(found.times_s[-1] - found.times_s[0])
    rows, median = length / step_s, found.timing.median_s
    if length < step_s or (rows < KEPT * len(table) and median < QUICKEST_S and not rate_stated):
        raise MeasurementError(
            f"{table}: the times of {len(table)} rows cover {length:.4g} s, {1e6 * median:.4g} us a row, so that steps of "
            f"{step_s:g} s would keep {int(rows) + 1}; if the times are not in {quoted(unit)}{_cure(median, unit)}; "
            "if they are, write 'rate_hz: ROWS_A_SECOND' into the mapping, the rate at which rows are wanted"
        )
    if median >= SLOW_S:
        raise MeasurementError(
            f"{table}: a row every {median:.4g} s; if the times are not in {quoted(unit)}{_cure(median, unit)}; "
            "slower than one row a second tells nothing about a robot's motion"
        )
    if rows > MOST_ROWS:
        raise MeasurementError(
            f"{table}: {length:.4g} s in steps of {step_s:g} s are {rows:.3g} rows; at most {MOST_ROWS}: "
            "a wrong unit of the time, or a lower rate_hz"
        )


def _cure(median_s: float, unit: str) -> str:
    """The unit in which such steps would be those of a robot's log, as advice."""
    raw = median_s / UNITS[unit][1]
    fits = [u for u in ("s", "ms", "us", "ns") if FASTEST_S <= raw * UNITS[u][1] <= SLOWEST_S and u != unit]
    return f", say unit: {quoted(fits[0])}" if fits else ""
