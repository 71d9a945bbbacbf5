"""JSON: a header and a list of rows, a list of rows alone, columns by name, one row a line, or a list of trials of columns."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ee_dist.basics.quoted import quoted
from ee_dist.measurements.errors import MeasurementError, nearest
from ee_dist.measurements.readers.options import Options, bounded
from ee_dist.measurements.table import Recorded, Table

DEEPEST = 6
"""Mappings inside a row are columns of their own, ``state.q``, down to this depth."""
LONG = 40
"""Numbers in a list from which it is a column rather than what all joints had in a row."""
TEXT_BYTES = 8
"""What a byte of JSON takes in memory once it is read, at most."""


def read_json(file: Path, options: Options) -> tuple[Recorded, ...]:
    """One trial with one table, or several such. Raises MeasurementError."""
    bounded(file, file.stat().st_size * TEXT_BYTES, "convert it to Parquet")
    data = _parsed(file)
    header: dict[str, Any] = {}
    rows: Any = data
    if isinstance(data, Mapping):
        name = _rows_of(data, options.records)
        if name is None:
            columns = {
                str(k): v for k, v in data.items() if isinstance(v, list) and v and not isinstance(v[0], Mapping)
            }
            lengths = {len(v) for v in columns.values()}
            if len(columns) < 2 or len(lengths) != 1:
                raise MeasurementError(
                    f"{file}: no list named {quoted(options.records)} in it; {nearest(options.records, data)}"
                )
            rest = {str(k): v for k, v in data.items() if str(k) not in columns}
            return (Recorded("", (Table(file, columns, rest),)),)
        rows = data[name]
        header = {str(k): v for k, v in data.items() if k != name}
    elif not (isinstance(data, list) and data and isinstance(data[0], Mapping)):
        raise MeasurementError(f"{file}: no list named {quoted(options.records)} in it; the file is not a mapping")
    if _are_trials(rows):
        return tuple(_trial(file, k, entry, header) for k, entry in enumerate(rows))
    return (Recorded("", (Table(file, _columns(file, rows), header),)),)


def _are_trials(entries: Any) -> bool:
    """Whether entries are trials with columns rather than rows: lists in each that are equally long, and longer than a robot
    has joints or of another length in the next."""
    found = []
    for entry in entries:
        found.append(_longest(_flat(entry)) if isinstance(entry, Mapping) else {})
        if len(found[-1]) < 2:
            return False
    lengths = {len(next(iter(columns.values()))) for columns in found}
    return bool(lengths) and (min(lengths) >= LONG or (len(lengths) > 1 and min(lengths) > 1))


def _longest(flat: Mapping[str, Any]) -> dict[str, list[Any]]:
    """The longest lists of an entry, but for those of texts and of further entries."""
    lists = {
        k: v for k, v in flat.items() if isinstance(v, list) and v and not any(isinstance(c, (str, Mapping)) for c in v)
    }
    most = max(map(len, lists.values()), default=0)
    return {k: v for k, v in lists.items() if len(v) == most}


def _trial(file: Path, index: int, entry: Mapping[str, Any], header: Mapping[str, Any]) -> Recorded:
    """An entry as a trial: its long lists are columns, the rest says something of it. It is counted, for kinds come again."""
    flat = _flat(entry)
    columns = _longest(flat)
    rest = {k: v for k, v in flat.items() if k not in columns}
    word = next((v for v in rest.values() if isinstance(v, str) and v), "")
    return Recorded(f"{word} {index + 1}".strip(), (Table(file, columns, {**header, **rest}),))


def _flat(entry: Mapping[str, Any]) -> dict[str, Any]:
    flat: dict[str, Any] = {}
    _flatten(entry, "", flat, 0)
    return flat


def _parsed(file: Path) -> Any:
    try:
        text = file.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise MeasurementError(f"{file}: not a text file; is it really json?") from None
    try:
        return json.loads(text)
    except RecursionError:
        raise MeasurementError(f"{file}: nested too deeply; expected a list of rows") from None
    except ValueError as error:
        lines = [s for s in text.splitlines() if s.strip()]
        if len(lines) > 1 and lines[0].lstrip().startswith("{") and lines[0].rstrip().endswith("}"):
            return _lines(file, lines)
        raise MeasurementError(f"{file}: not JSON: {str(error)[:120]}") from None


def _lines(file: Path, lines: list[str]) -> list[Any]:
    rows = []
    for i, line in enumerate(lines):
        try:
            rows.append(json.loads(line))
        except (ValueError, RecursionError) as error:
            raise MeasurementError(f"{file}: line {i + 1}: not JSON: {str(error)[:120]}") from None
    return rows


def _rows_of(data: Mapping[str, Any], records: str) -> str | None:
    """The entry that holds the rows: the named one, or the only list of mappings."""
    if isinstance(data.get(records), list):
        return records
    lists = [k for k, v in data.items() if isinstance(v, list) and v and isinstance(v[0], Mapping)]
    return lists[0] if len(lists) == 1 else None


def _columns(file: Path, rows: list[Any]) -> dict[str, Any]:
    columns: dict[str, list[Any]] = {}
    for i, row in enumerate(rows):
        if not isinstance(row, Mapping):
            raise MeasurementError(f"{file}: row {i + 1}: expected a mapping of columns, not {quoted(row)}")
        flat: dict[str, Any] = {}
        _flatten(row, "", flat, 0)
        for name, value in flat.items():
            columns.setdefault(name, [None] * len(rows))[i] = value
    return columns


def _flatten(row: Mapping[str, Any], before: str, into: dict[str, Any], depth: int) -> None:
    for key, value in row.items():
        if isinstance(value, Mapping) and depth < DEEPEST:
            _flatten(value, f"{before}{key}.", into, depth + 1)
        elif not isinstance(value, Mapping):
            into[f"{before}{key}"] = value
