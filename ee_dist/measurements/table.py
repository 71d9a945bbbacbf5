"""What every format is read into: a recording has trials, a trial has tables, a table has named columns of equal length.

Numbers are checked here, so that an error names the row and the column as the file's user sees them.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from ee_dist.basics.quoted import quoted
from ee_dist.measurements.errors import EmptyColumnError, MeasurementError, SeveralColumnsError, nearest
from ee_dist.trials.log import Array

_PLACE = re.compile(r"^(?P<name>.+)\[(?P<part>[^\[\]]+)\]$")
_COMMA = re.compile(r"^\s*[-+]?\d+,\d+\s*$")
_DATE = re.compile(r"\s*\d{4}-?\d\d-?\d\d[T ]\d\d")
_SWITCH = {"true": 1.0, "false": 0.0, "": np.nan}
_BETWEEN = re.compile(r"[,;\s]+")
WIDEST = 256
"""Cells that hold more numbers than this are pictures or the like, not channels."""
DROP = "drop the row"
"""What may always be done about a row that cannot be read."""
LARGEST = 1e30
"""What is measured is smaller, in whatever unit; times in ns since 1970 are."""


@dataclass
class Table:
    """Columns of one clock. A column is an array (T,) or (T, n) of numbers, or a list of T cells as they were read.

    ``lines`` are the numbers that the file's user sees for the rows; ``clock`` is the column that holds the seconds of a
    clock that all tables of the recording share; ``parts`` names the numbers of list cells; ``spread`` are the columns that the
    numbers of an array became, whose places are known as well; ``units`` are those that the
    file states; ``twice`` are names that head more than one column; ``notes`` say what was done on the way.
    """

    path: Path
    columns: dict[str, Any]
    header: dict[str, Any] = field(default_factory=dict)
    name: str = ""
    lines: Sequence[int] | None = None
    clock: str | None = None
    parts: dict[str, tuple[str, ...]] = field(default_factory=dict)
    spread: dict[str, tuple[str, ...]] = field(default_factory=dict)
    units: dict[str, str] = field(default_factory=dict)
    twice: frozenset[str] = frozenset()
    notes: tuple[str, ...] = ()
    rate_hz: float | None = None
    """Rows per second where the format states it."""
    planned: bool = False
    """Whether rows are points that were to be passed through, on straight lines between them."""

    def __len__(self) -> int:
        return len(next(iter(self.columns.values()), []))

    def __str__(self) -> str:
        return f"{self.path}: {self.name}" if self.name else str(self.path)

    def line(self, row: int) -> int:
        """The number that the file's user sees for a row."""
        return int(self.lines[row]) if self.lines is not None else row + 1

    def part(self, rows: Any) -> Table:
        """The same columns at some rows (a slice or indices)."""
        chosen = np.arange(len(self))[rows]
        return replace(
            self,
            columns={
                k: v[chosen] if isinstance(v, np.ndarray) else [v[i] for i in chosen] for k, v in self.columns.items()
            },
            lines=[self.line(int(i)) for i in chosen],
        )

    def addresses(self) -> Iterator[str]:
        """Every column of one number a row, by the name that ``numbers`` takes: ``q`` or ``q[2]``."""
        for name, cells in self.columns.items():
            width = self._width(name, cells)
            if width is None:
                yield name
            elif width <= WIDEST:
                named = self.parts.get(name, ())
                for i in range(width):
                    yield f"{name}[{named[i] if i < len(named) else i}]"

    def __contains__(self, column: object) -> bool:
        try:
            self._cells(str(column))
        except MeasurementError:
            return False
        return True

    def numbers(self, column: str, gaps: bool = False) -> Array:
        """The column as (T,) numbers; ``gaps`` lets empty cells through as NaN. ``q[2]`` is the third number of each list
        in ``q`` (or, where its numbers have names, the one of that name), ``#3`` the third column.

        Raises MeasurementError for a column that is not there, a text, or no number.
        """
        if column in self.twice:
            places = [f"'#{i + 1}'" for i, c in enumerate(self.columns) if c == column or c.startswith(f"{column} #")]
            raise SeveralColumnsError(
                f"{self}: {len(places)} columns are named {quoted(column)}; say which: {' or '.join(places)}"
            )
        cells = self._cells(column)
        out = self._floats(cells, column)
        bad = np.flatnonzero(~np.isfinite(out))
        if len(bad) and not gaps and np.isnan(out).all():
            raise EmptyColumnError(
                f"{self}: column {quoted(column)} is empty from end to end; take it out of the mapping, or leave this file out"
            )
        if len(bad) and not gaps:
            raw = cells[int(bad[0])]
            known = "empty" if raw is None or raw == "" else f"{raw}"
            raise MeasurementError(
                f"{self}: row {self.line(int(bad[0]))}, column {quoted(column)} is {known}; "
                f"fill the gap, {DROP}, or set 'gaps: interpolate' for the column"
            )
        beyond = np.flatnonzero(np.abs(out) > LARGEST)
        if len(beyond):
            row = int(beyond[0])
            said = "infinite" if np.isinf(out[row]) else f"{out[row]:g}, which nothing measures"
            raise MeasurementError(f"{self}: row {self.line(row)}, column {quoted(column)} is {said}; {DROP}")
        return out

    def dated(self, column: str) -> bool:
        """Whether a column of numbers holds them as dates, which are read as seconds, by its first cell. Raises MeasurementError
        for a column that is not there."""
        cells = self._cells(column)
        return _begins_as_date(cells)

    def texts(self, column: str) -> list[str]:
        """The column's cells as they stand. Raises MeasurementError for a column that is not there."""
        return [str(c) for c in self._cells(column)]

    # -- inside ------------------------------------------------------------------------------------------------------

    def _cells(self, column: str) -> Any:
        if column in self.columns:
            cells = self.columns[column]
            width = self._width(column, cells)
            if width is not None:
                raise MeasurementError(
                    f"{self}: column {quoted(column)} holds {width} numbers in each row; say which, such as "
                    f"'{column}[{(self.parts.get(column) or ('0',))[0]}]'"
                )
            return cells
        if re.fullmatch(r"#\d+", column) and 1 <= int(column[1:]) <= len(self.columns):
            return self.columns[list(self.columns)[int(column[1:]) - 1]]
        found = _PLACE.match(column)
        if found and found["name"] in self.columns:
            return self._inside(found["name"], found["part"])
        spread = self.spread.get(found["name"], ()) if found else ()
        own = dict(zip(map(str, range(len(spread))), spread, strict=True)).get(found["part"]) if found else None
        if own in self.columns:
            return self.columns[own]
        raise MeasurementError(f"{self}: no column {quoted(column)}; {nearest(column, self.addresses())}")

    def _inside(self, name: str, part: str) -> Any:
        cells, named = self.columns[name], self.parts.get(name, ())
        width = self._width(name, cells)
        if width is None:
            raise MeasurementError(
                f"{self}: column {quoted(name)} holds one number in each row, not a list: leave out [{part}]"
            )
        if part in named:
            place = named.index(part)
        elif part.isdigit() and int(part) < width:
            place = int(part)
        else:
            there = ", ".join(named) if named else f"[0] to [{width - 1}]"
            raise MeasurementError(f"{self}: column {quoted(name)} has no [{part}]; there are: {there}")
        if isinstance(cells, np.ndarray):
            return cells[:, place]
        out: list[Any] = []
        for row, cell in enumerate(cells):
            inner = _listed(cell)
            if inner is None or place >= len(inner):
                has = "is no list" if inner is None else f"holds {len(inner)} numbers, so there is no [{part}]"
                raise MeasurementError(f"{self}: row {self.line(row)}, column {quoted(name)} {has}")
            out.append(inner[place])
        return out

    def _width(self, name: str, cells: Any) -> int | None:
        """How many numbers a cell holds; None where it is one number (or a text)."""
        if isinstance(cells, np.ndarray):
            return int(np.prod(cells.shape[1:])) if cells.ndim == 2 else None if cells.ndim == 1 else WIDEST + 1
        first = next((c for c in cells if c is not None and c != ""), None)
        inner = _listed(first)
        return None if inner is None else len(inner)

    def _floats(self, cells: Any, column: str) -> Array:
        if isinstance(cells, np.ndarray) and cells.ndim == 1 and cells.dtype.kind in "fiub":
            return cells.astype(np.float64)
        if isinstance(cells, np.ndarray) and cells.ndim > 1:
            raise MeasurementError(
                f"{self}: column {quoted(column)} has the shape {cells.shape}; expected (T,) or (T, n)"
            )
        try:
            return np.array(cells, dtype=np.float64)
        except (TypeError, ValueError, OverflowError):
            pass
        if all(c is None or str(c).lower() in _SWITCH for c in cells):
            return np.array([np.nan if c is None else _SWITCH[str(c).lower()] for c in cells])
        dates = _dates(cells)
        if dates is not None:
            return dates
        out = np.empty(len(cells))
        for i, value in enumerate(cells):
            try:
                out[i] = float(value) if value is not None and value != "" else np.nan
            except (TypeError, ValueError, OverflowError):
                comma = "; a decimal comma? add 'decimal: \",\"'" if _COMMA.match(str(value)) else ""
                raise MeasurementError(
                    f"{self}: row {self.line(i)}, column {quoted(column)}: {quoted(str(value))} is not a number{comma}"
                ) from None
        return out


def _begins_as_date(cells: Any) -> bool:
    return len(cells) > 0 and bool(_DATE.match(str(cells[0])))


def _dates(cells: Any) -> Array | None:
    """Dates with a time of day, as ISO 8601 writes them, as seconds since 1970; without a zone they are taken as UTC. None where
    a cell is none."""
    if not _begins_as_date(cells):
        return None
    try:
        found = [datetime.fromisoformat(str(c).strip()) for c in cells]
    except ValueError:
        return None
    return np.array([(d if d.tzinfo else d.replace(tzinfo=UTC)).timestamp() for d in found])


def _listed(cell: Any) -> Any:
    """The numbers of a list cell: a sequence, or a text in brackets as loggers write it."""
    if isinstance(cell, (list, tuple, np.ndarray)):
        return cell
    if isinstance(cell, str) and len(cell) > 1 and cell.strip()[:1] in "[({" and cell.strip()[-1:] in "])}":
        inner = cell.strip()[1:-1].strip()
        return [c for c in _BETWEEN.split(inner) if c] if inner else []
    return None


@dataclass(frozen=True)
class Recorded:
    """One trial of a file: its tables, the first of which is the main one unless a mapping says otherwise."""

    name: str
    tables: tuple[Table, ...]

    def table(self, name: str, where: str) -> Table:
        """Raises MeasurementError for a name that is not there; "" is the only table or the first."""
        if not name:
            return self.tables[0]
        for t in self.tables:
            if t.name == name:
                return t
        raise MeasurementError(
            f"{where}: no table {quoted(name)} in {self.tables[0].path}; {nearest(name, [t.name for t in self.tables])}"
        )
