"""Files as columns of numbers: CSV, Parquet, and JSON with a header and a list of entries.

Numbers are checked here, so that an error names the row and the column as the user sees them.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from pyarrow import ArrowException
from pyarrow.parquet import ParquetFile

from ee_dist.measurements.errors import MeasurementError, nearest
from ee_dist.robots.untrusted import UntrustedError, check_file
from ee_dist.trials.log import Array

LARGEST = 2**30
MOST_CELLS = 100_000_000
"""Bytes and values that one file of measurements may have."""
FORMATS = {".csv": "csv", ".txt": "csv", ".tsv": "csv", ".parquet": "parquet", ".pq": "parquet", ".json": "json"}


@dataclass
class Table:
    """Raw columns of one file. ``first_row`` is the number that the file's user sees for row 0 (a CSV has a header)."""

    path: Path
    columns: dict[str, list[Any]]
    header: dict[str, Any] = field(default_factory=dict)
    first_row: int = 1

    def __len__(self) -> int:
        return len(next(iter(self.columns.values()), []))

    def numbers(self, column: str, gaps: bool = False) -> Array:
        """The column as (T,) numbers; ``gaps`` lets empty cells through as NaN.

        Raises MeasurementError for a column that is not there, a text, or no number.
        """
        if column not in self.columns:
            raise MeasurementError(f"{self.path}: no column {column!r}; {nearest(column, self.columns)}")
        raw = self.columns[column]
        out = np.empty(len(raw))
        for i, value in enumerate(raw):
            try:
                out[i] = float(value) if value is not None and value != "" else np.nan
            except (TypeError, ValueError, OverflowError):
                raise MeasurementError(
                    f"{self.path}: row {i + self.first_row}, column {column!r}: {str(value)[:40]!r} is not a number"
                ) from None
            if not np.isfinite(out[i]) and not gaps:
                shown = "empty" if value is None or value == "" else f"{value}"
                raise MeasurementError(
                    f"{self.path}: row {i + self.first_row}, column {column!r} is {shown}; "
                    "fill the gap, drop the row, or set 'gaps: interpolate' for the column"
                )
        return out


def read_table(path: str | Path, kind: str | None = None, records: str = "entries", separator: str = ",") -> Table:
    """The columns of a file. ``kind`` is csv, parquet or json (from the suffix when left out); ``records`` names the list
    of rows in a JSON file, whose other entries are its header. Raises MeasurementError.
    """
    file = Path(path)
    chosen = kind or FORMATS.get(file.suffix.lower())
    if chosen not in ("csv", "parquet", "json"):
        raise MeasurementError(f"{file}: unknown format {kind or file.suffix!r}; expected .csv, .parquet or .json")
    try:
        check_file(file, LARGEST)
        if file.stat().st_size == 0:
            raise MeasurementError(f"{file}: the file is empty")
        table = {"csv": _csv, "parquet": _parquet, "json": _json}[chosen](file, records, separator)
    except FileNotFoundError:
        raise MeasurementError(f"{file}: no such file") from None
    except UntrustedError as error:
        raise MeasurementError(f"{file}: {error}") from None
    except UnicodeDecodeError:
        raise MeasurementError(f"{file}: not a text file; is it really {chosen}?") from None
    except OSError as error:
        raise MeasurementError(f"{file}: cannot be read ({error.strerror or error})") from None
    if len(table) == 0:
        raise MeasurementError(f"{file}: no rows in it (zero length)")
    return table


def _csv(file: Path, records: str, separator: str) -> Table:
    try:
        frame = pd.read_csv(file, sep=separator, dtype=str, keep_default_na=False, skip_blank_lines=False)
    except pd.errors.EmptyDataError:
        raise MeasurementError(f"{file}: the file is empty") from None
    except UnicodeDecodeError:
        raise
    except (pd.errors.ParserError, ValueError, MemoryError) as error:
        raise MeasurementError(f"{file}: not a table: {' '.join(str(error).split())}") from None
    while len(frame) and all(v == "" for v in frame.iloc[-1]):
        frame = frame.iloc[:-1]
    return Table(file, {str(c).strip(): frame[c].tolist() for c in frame.columns}, first_row=2)


def _parquet(file: Path, records: str, separator: str) -> Table:
    try:
        found = ParquetFile(file).metadata
        if found.num_rows * max(found.num_columns, 1) > MOST_CELLS:
            raise ValueError(
                f"{found.num_rows} rows of {found.num_columns} columns; at most {MOST_CELLS} values are read"
            )
        frame = pd.read_parquet(file)
    except (ValueError, OSError, TypeError, KeyError, ArrowException, MemoryError, RecursionError) as error:
        raise MeasurementError(f"{file}: not a Parquet file: {' '.join(str(error).split())[:120]}") from None
    return Table(file, {str(c): frame[c].tolist() for c in frame.columns})


def _json(file: Path, records: str, separator: str) -> Table:
    try:
        data = json.loads(file.read_text(encoding="utf-8"))
    except (json.JSONDecodeError, RecursionError) as error:
        raise MeasurementError(f"{file}: not JSON: {' '.join(str(error).split())}") from None
    if not isinstance(data, Mapping) or not isinstance(data.get(records), list):
        keys = nearest(records, data) if isinstance(data, Mapping) else "the file is not a mapping"
        raise MeasurementError(f"{file}: no list named {records!r} in it; {keys}")
    rows = data[records]
    columns: dict[str, list[Any]] = {}
    for i, row in enumerate(rows):
        if not isinstance(row, Mapping):
            raise MeasurementError(f"{file}: row {i + 1}: expected a mapping of columns, not {str(row)[:40]!r}")
        for name in row:
            columns.setdefault(str(name), [None] * len(rows))
        for name, value in row.items():
            columns[str(name)][i] = value
    return Table(file, columns, {str(k): v for k, v in data.items() if k != records})
