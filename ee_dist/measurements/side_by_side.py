"""Files of one quantity, or of one joint, each: their columns, row by row side by side, are one trial."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from ee_dist.basics.names import listed
from ee_dist.measurements.errors import MeasurementError
from ee_dist.measurements.table import Table
from ee_dist.trials.log import Array

SHARED = 0.5
"""Share of the rows of the shortest file in which all others must say something, too."""
ALIKE = 1e-3
"""Share of a row by which the times of the same moment differ at most;"""
APART = 0.5
"""and those of the same row, from file to file;"""
ONE_STAMP = 0.02
"""and those of a row that one logger wrote into the file of each joint."""
_NUMBERED = re.compile(r"#?\d+")
_TIME = re.compile(r"(^|[^a-z])(t|time|times|timestamps?|stamp|seconds?|secs?|elapsed|clock)([^a-z]|$)", re.IGNORECASE)


def side_by_side(tables: Mapping[str, Table]) -> Table:
    """The tables of one trial as one, in which ``positions.csv`` with a column ``elbow`` is ``positions.elbow``, and a file
    without names of columns ``positions[0]``, ``positions[1]``. A time that several files state alike is there once, by its own
    name. Files of different length, or whose rows were at other times, go by the times that each has: beside each row of the
    longest stands the last one before it of the others.

    Raises MeasurementError for files of different length without times, and for times that have hardly a moment in common.
    """
    if len({len(t) for t in tables.values()}) > 1 or _at_other_times(tables):
        tables = _by_their_times(tables)
    columns: dict[str, Any] = {}
    units: dict[str, str] = {}
    parts: dict[str, tuple[str, ...]] = {}
    twice: set[str] = set()
    times: dict[str, tuple[Table, Array]] = {}
    for name, table in tables.items():
        for column, cells in _columns(table).items():
            address = f"{name}.{column}" if column else name
            time = _time(table, column, cells)
            if time is not None:
                if any(np.array_equal(time, known) for _, known in times.values()):
                    continue
                # It is the time of all, not a quantity of the file that states it.
                address = address if column in columns or not column else column
                times[address] = (table, time)
            columns[address] = cells
            if column in table.units:
                units[address] = table.units[column]
            if column in table.parts:
                parts[address] = table.parts[column]
            if column in table.twice:
                twice.add(address)
    _check_times(list(times.values()))
    first = next(iter(tables.values()))
    notes = [n for t in tables.values() for n in t.notes]
    rates = {t.rate_hz for t in tables.values() if t.rate_hz}
    header: dict[str, Any] = {}
    for table in tables.values():
        header |= {k: v for k, v in table.header.items() if k not in header}
    return replace(
        first, columns=columns, header=header, name="", clock=None, parts=parts, units=units, twice=frozenset(twice),
        notes=tuple(dict.fromkeys(notes)), rate_hz=rates.pop() if len(rates) == 1 else None, planned=False,
    )  # fmt: skip


def one_recording(tables: Mapping[str, Table]) -> bool | None:
    """Whether the rows of files of one joint each were stamped together; None where they have as many rows and nothing says."""
    if len({len(t) for t in tables.values()}) > 1 or _at_other_times(tables, ONE_STAMP):
        return False
    return True if all(_own_time(t) is not None for t in tables.values()) else None


def _at_other_times(tables: Mapping[str, Table], share: float = APART) -> bool:
    """Whether all tables, of one length, say when their rows were, and these were not the same, to a share of a row."""
    times = [found[1] for t in tables.values() if (found := _own_time(t)) is not None]
    if len(times) < len(tables) or len(times) < 2:
        return False
    step = float(np.median(np.diff(times[0])))
    return any(float(np.abs(t - times[0]).max()) > share * step for t in times[1:])


def _by_their_times(tables: Mapping[str, Table]) -> dict[str, Table]:
    """The tables with as many rows, those in which all of them say something. Values are held, not joined by lines: what was read
    more seldom must stay seen to be."""
    times = {name: _own_time(t) for name, t in tables.items()}
    said = [f"{t.path.name} ({len(t)} rows)" for t in tables.values()]
    refused = f"{next(iter(tables.values())).path.parent}: {listed(said)} cannot stand side by side: "
    known = {name: found for name, found in times.items() if found is not None}
    if len(known) < len(tables):
        raise MeasurementError(
            f"{refused}row by row they would be of different moments; cut them to the same rows, or name each as a table with a "
            "time of its own"
        )
    first = max(tables, key=lambda name: len(tables[name]))
    # What was stamped alike is of one moment, whatever rounding made of it.
    at = known[first][1] + ALIKE * float(np.median(np.diff(known[first][1])))
    steps = {name: float(np.median(np.diff(t))) for name, (_, t) in known.items()}
    begin = max(t[0] for _, t in known.values())
    end = min(t[-1] + steps[name] for name, (_, t) in known.items())
    rows = np.flatnonzero((at >= begin) & (at < end))
    if len(rows) < SHARED * min(len(t) for t in tables.values()):
        raise MeasurementError(f"{refused}their times have hardly a moment in common")
    out = {}
    for name, table in tables.items():
        own = rows if name == first else np.searchsorted(known[name][1], at[rows], side="right") - 1
        part = table.part(own)
        if name != first:
            note = f"{table.path.name}: its {len(table)} rows beside those of {tables[first].path.name} by their times"
            kept = {k: v for k, v in part.columns.items() if k != known[name][0]}
            part = replace(part, columns=kept, notes=(*part.notes, note))
        out[name] = part
    return out


def _own_time(table: Table) -> tuple[str, Array] | None:
    """The one column that is called a time and rises, by its name in the file."""
    found = [(c, t) for c, cells in table.columns.items() if (t := _time(table, c, cells)) is not None]
    return found[0] if len(found) == 1 else None


def _columns(table: Table) -> dict[str, Any]:
    """Columns by what they are called beside the file's own name; "" is what has no other name."""
    names = list(table.columns)
    if len(names) == 1 and (names[0] == table.path.stem or _NUMBERED.fullmatch(names[0])):
        return {"": table.columns[names[0]]}
    if names == [str(k + 1) for k in range(len(names))] and all(
        isinstance(c, np.ndarray) for c in table.columns.values()
    ):
        return {"": np.stack(list(table.columns.values()), axis=1)}
    return dict(table.columns)


def _time(table: Table, column: str, cells: Any) -> Array | None:
    """The numbers (T,) of a column that is called a time and rises."""
    if not _TIME.search(column or table.path.stem) or not isinstance(cells, np.ndarray) or cells.ndim != 1:
        return None
    if cells.dtype.kind not in "fiu" or len(cells) < 2 or not (np.diff(cells) > 0).all():
        return None
    return cells.astype(np.float64)


def _check_times(times: list[tuple[Table, Array]]) -> None:
    """Raises MeasurementError for times of the same rows that lie further apart than rows may."""
    for table, time in times[1:]:
        first, known = times[0]
        step = float(np.median(np.diff(known)))
        off = np.abs(time - known)
        worst = int(np.argmax(off))
        if off[worst] > APART * step:
            raise MeasurementError(
                f"{table.path}: row {table.line(worst)} was at {time[worst]:g}, that of {first.path.name} at "
                f"{known[worst]:g}, rows are {step:.4g} apart: the files cannot stand side by side; name each as a table with a "
                "time of its own"
            )
