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

APART = 0.5
"""Share of a row by which the times of the same row may differ from file to file."""
_NUMBERED = re.compile(r"#?\d+")
_TIME = re.compile(r"(^|[^a-z])(t|time|times|timestamps?|stamp|seconds?|secs?|elapsed|clock)([^a-z]|$)", re.IGNORECASE)


def side_by_side(tables: Mapping[str, Table]) -> Table:
    """The tables of one trial as one, in which ``positions.csv`` with a column ``elbow`` is ``positions.elbow``, and a file
    without names of columns ``positions[0]``, ``positions[1]``. A time that several files state alike is there once.

    Raises MeasurementError for files of different length, and for times that are not those of the same rows.
    """
    counts = {name: len(t) for name, t in tables.items()}
    if len(set(counts.values())) > 1:
        raise MeasurementError(
            f"{next(iter(tables.values())).path.parent}: "
            f"{listed([f'{t.path.name} ({len(t)} rows)' for t in tables.values()])} cannot stand side by side: row by row they "
            "would be of different moments; cut them to the same rows, or name each as a table with a time of its own"
        )
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
