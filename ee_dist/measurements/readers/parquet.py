"""Parquet files, with list columns as arrays (T, n)."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from ee_dist.measurements.errors import MeasurementError
from ee_dist.measurements.readers.options import Options, bounded
from ee_dist.measurements.table import Recorded, Table

FINE_NS = 1_000_000
"""Rows closer than this (ns) are counted from the first: seconds since 1970 are numbers in steps of a quarter of 1 us."""


def read_parquet(file: Path, options: Options) -> tuple[Recorded, ...]:
    """One trial with one table. Raises MeasurementError."""
    columns, notes = columns_of(file)
    return (Recorded("", (Table(file, columns, notes=notes),)),)


def columns_of(file: Path, only: Sequence[str] | None = None) -> tuple[dict[str, Any], tuple[str, ...]]:
    """The columns of a file, and notes. Raises MeasurementError."""
    try:
        source = pq.ParquetFile(file)
        names = [n for n in source.schema_arrow.names if only is None or n in only]
        # Not from the columns: what the library throws at a damaged one ends the process (Arrow 26).
        groups = [source.metadata.row_group(i) for i in range(source.metadata.num_row_groups)]
        stored = sum(g.total_byte_size for g in groups)
        bounded(file, max(stored, 8 * source.metadata.num_rows * len(names)))
        table = source.read(columns=names)
    except (pa.ArrowException, ValueError, OSError) as error:
        if isinstance(error, (MeasurementError, FileNotFoundError, IsADirectoryError, PermissionError)):
            raise
        raise MeasurementError(f"{file}: not a Parquet file: {' '.join(str(error).split())[:120]}") from None
    notes: list[str] = []
    return {n: _cells(table.column(n).combine_chunks(), n, notes) for n in names}, tuple(notes)


def _cells(column: Any, name: str, notes: list[str]) -> Any:
    if isinstance(column, pa.ChunkedArray):
        column = pa.concat_arrays(column.chunks) if column.num_chunks else pa.array([], column.type)
    kind = column.type
    if pa.types.is_timestamp(kind):
        stamps = column.cast(pa.timestamp("ns")).cast(pa.int64())
        if stamps.null_count == 0 and len(stamps):
            ns = stamps.to_numpy(zero_copy_only=False)
            if len(ns) > 1 and np.median(np.diff(ns)) >= FINE_NS:
                # Files of one trial keep the clock that they share.
                notes.append(f"{name}: dates read as seconds since 1970")
                return ns / 1e9
            notes.append(f"{name}: dates read as seconds from the first row")
            return (ns - ns[0]) / 1e9
    even = pa.types.is_fixed_size_list(kind)
    lists = even or pa.types.is_list(kind) or pa.types.is_large_list(kind)
    if lists and column.null_count == 0 and len(column) and _is_number(kind.value_type):
        widths = {kind.list_size} if even else set(column.value_lengths().to_pylist())
        values = column.flatten()
        if len(widths) == 1 and values.null_count == 0:
            return values.to_numpy(zero_copy_only=False).reshape(len(column), widths.pop())
    if _is_number(kind) and column.null_count == 0:
        return column.to_numpy(zero_copy_only=False)
    return column.to_pylist()


def _is_number(kind: Any) -> bool:
    return bool(pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_boolean(kind))
