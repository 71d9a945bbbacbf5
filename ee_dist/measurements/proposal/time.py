"""Which column is the time, and in which unit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ee_dist.measurements.clocks import FASTEST_S, QUICKEST_S, SLOW_S, SLOWEST_S
from ee_dist.measurements.errors import EmptyColumnError, MeasurementError
from ee_dist.measurements.proposal.blocks import series_of
from ee_dist.measurements.proposal.model import LIKELY, SURE, UNKNOWN, Hints
from ee_dist.measurements.proposal.words import TIME, Reading, read_name, unit_word
from ee_dist.measurements.sampling import check_times, once_a_moment
from ee_dist.measurements.table import Table
from ee_dist.measurements.units import UNITS
from ee_dist.trials.log import Array

TIMES = tuple(u for u, (kind, _) in UNITS.items() if kind == "time" and u in ("s", "ms", "us", "ns"))

WHOSE: dict[bool | None, int] = {False: 0, None: 1, True: 2}
"""The order in which times are taken: called measured, called neither, called desired."""
SHORT_S, LONG_S = 1.0, 1200.0
"""What a record lasts: where the size of its steps tells two units, the one in which it does."""
MOSTLY, SELDOM = 0.8, 0.1
"""Share of its steps in which a time must rise to be one that has a flaw; and, where it never falls, to be a coarse one."""


@dataclass(frozen=True)
class TimeChoice:
    """The time of a table: a column with its unit, or (None) the clock or the rate that the format states."""

    column: str | None
    unit: str
    seconds: Array
    sure: str
    why: str


def time_of(table: Table, hints: Hints) -> TimeChoice | None:
    """None where nothing in the table can be the time."""
    if table.clock is not None:
        return TimeChoice(None, "s", table.numbers(table.clock), SURE, "the format states it")
    rows = np.arange(len(table))
    if hints.rate_hz:
        return TimeChoice(None, "s", rows / hints.rate_hz, SURE, f"{hints.rate_hz:g} rows a second, as you said")
    rising = {a: v for a, v in series_of(table).items() if len(v) > 2 and (np.diff(v) > 0).all()}
    # The time of a plan is not that of the readings.
    named = sorted((a for a in rising if _reading(a).kind == TIME), key=lambda a: WHOSE[_reading(a).command])
    counters = [a for a in rising if np.array_equal(np.diff(rising[a]), np.ones(len(table) - 1)) and a not in named]
    open_ = [a for a in rising if a not in counters]
    # A time with a flaw is to be mended, not to be replaced by whatever else rises.
    candidates = named or ([] if time_flaw(table) else [a for a in open_ if _reading(a).kind is None])
    if not candidates:
        if table.rate_hz:
            return TimeChoice(None, "s", rows / table.rate_hz, LIKELY, "the file's own rate")
        return None
    return _chosen(table, candidates, rising, bool(named))


def once_each_moment(table: Table) -> Table:
    """The table without rows that bear the time of the row after them, where that is all that its time lacks."""
    found = None
    for address in table.addresses():
        if _reading(address).kind != TIME:
            continue
        try:
            times = table.numbers(address)
        except MeasurementError:
            continue
        if len(times) > 2 and (np.diff(times) > 0).all():
            return table
        found = once_a_moment(times) if found is None else found
    return table if found is None else table.part(found)


def time_flaw(table: Table) -> MeasurementError | None:
    """What is wrong with the column that is called a time, where it is one but for some rows."""
    for address in table.addresses():
        if _reading(address).kind != TIME:
            continue
        try:
            values = table.numbers(address)
            if len(values) < 3:
                continue
            steps = np.diff(values)
            rises = float((steps > 0).mean())
            if rises > MOSTLY or ((steps >= 0).all() and rises > SELDOM):
                check_times(values, table, address)
        except EmptyColumnError:
            continue
        except MeasurementError as error:
            return error
    return None


def _chosen(table: Table, candidates: list[str], rising: dict[str, Array], named: bool) -> TimeChoice:
    # Of clocks that tick alike the one that says its unit.
    alike = [a for a in candidates if _same(rising[a], rising[candidates[0]])]
    column = next((a for a in alike if _stated(table, a)), candidates[0])
    seconds, stated = rising[column], _stated(table, column)
    step, length = float(np.median(np.diff(seconds))), float(seconds[-1] - seconds[0])
    fits = [u for u in TIMES if FASTEST_S <= step * UNITS[u][1] <= SLOWEST_S]
    what = "is called a time and rises" if named else "is the only one that always rises"
    # What a name says is doubted where no import would take such rows, not where they are only unusual.
    if stated and not QUICKEST_S <= step * UNITS[stated][1] < SLOW_S:
        better = f", in {fits[0]} {step * UNITS[fits[0]][1]:.4g} s" if fits else ""
        return TimeChoice(column, stated, seconds * UNITS[stated][1], UNKNOWN,
                          f"it says {stated}, but rows would be {step * UNITS[stated][1]:.4g} s apart{better}")  # fmt: skip
    if not (fits or stated):
        return TimeChoice(
            column, "s", seconds, UNKNOWN, f"{column!r} rises by {step:.4g} a row, which fits no unit of time"
        )
    others = [a for a in candidates if not _same(rising[a], seconds)]
    unit, either = stated or fits[0], ""
    if not stated and len(fits) > 1:
        lasting = [u for u in fits if SHORT_S <= length * UNITS[u][1] <= LONG_S]
        rates = " or ".join(
            f"{1 / (step * UNITS[u][1]):.4g} Hz ({length * UNITS[u][1]:.3g} s in all) in {u}" for u in fits
        )
        either = f"{what}; its steps are {rates}"
        if len(lasting) != 1:
            return TimeChoice(column, unit, seconds * UNITS[unit][1], UNKNOWN, either)
        unit = lasting[0]
    if others and not named:
        return TimeChoice(column, unit, seconds * UNITS[unit][1], UNKNOWN,
                          f"several columns always rise: {', '.join(candidates[:4])}")  # fmt: skip
    says = "dates" if table.dated(column) else f"it says {unit}" if stated else f"steps are those of {unit}"
    why = f"{either}: taken as {unit}" if either else f"{what}; {says}: {1 / (step * UNITS[unit][1]):.4g} Hz"
    if others:
        why += f"; {others[0]!r} is another clock, not used"
    return TimeChoice(
        column, unit, seconds * UNITS[unit][1], SURE if stated or (named and not others and not either) else LIKELY, why
    )


def _stated(table: Table, column: str) -> str | None:
    """The unit that a column of time says it is in; dates are read as seconds."""
    if table.dated(column):
        return "s"
    stated = (unit_word(table.units[column]) if column in table.units else None) or _reading(column).unit
    return stated if stated in TIMES else None


def _reading(address: str) -> Reading:
    return read_name(address)


def _same(a: Array, b: Array) -> bool:
    """Whether two clocks tick alike, whatever their unit and start."""
    x, y = a - a[0], b - b[0]
    return bool(np.allclose(x / x[-1], y / y[-1], atol=1e-3))
