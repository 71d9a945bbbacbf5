"""Tables as text: CSV and its relatives, with or without a header, whatever the separator, the encoding, the decimal sign."""

from __future__ import annotations

import contextlib
import csv
import io
import re
from pathlib import Path
from typing import Any

import numpy as np

from ee_dist.measurements.errors import MeasurementError
from ee_dist.measurements.readers.options import Options, bounded
from ee_dist.measurements.table import Recorded, Table

BLOCK = 20_000
"""Rows that are turned into numbers at once, so that a long file never stands in memory as texts."""
SHAPE, TABLE, SAID = 30, 3, 60
"""Lines that are looked at to see what a table looks like; how many of them at least are one below what stands above it, and how
much of that is said."""
_NUMBER = re.compile(r"^\s*[-+]?(\d+([.,]\d*)?|[.,]\d+)([eE][-+]?\d+)?\s*$|^\s*[-+]?(nan|inf)\s*$", re.IGNORECASE)
_PLAIN = re.compile(r"^([-+]?\d*[.,]?\d+([eE][-+]?\d+)?)?$")
_QUOTED = re.compile(r'"[^"]*"|\[[^\]]*\]|\([^)]*\)|\{[^}]*\}')
SEPARATORS = ("\t", ";", "|", ",")


def read_text(file: Path, options: Options) -> tuple[Recorded, ...]:
    """One trial with one table. Raises MeasurementError."""
    bounded(file, file.stat().st_size, "convert it to Parquet")
    text, notes = _decoded(file)
    lines = text.splitlines()
    above = _preamble(lines, options.separator)
    if above:
        notes.append(f"left out above the table: {lines[above[0]].strip()[:SAID]!r}{' and more' if above[1:] else ''}")
        # Blank, so that the others keep their numbers.
        lines = ["" if k in above else line for k, line in enumerate(lines)]
        text = "\n".join(lines)
    shape = [s for s in lines if s.strip() and s.lstrip()[0] not in "#%"][:SHAPE]
    remarks = [s.lstrip("#% \t") for s in lines[:50] if s.lstrip()[:1] in ("#", "%")]
    if not shape:
        raise MeasurementError(f"{file}: no rows in it (zero length)")
    separator = options.separator or _separator(shape)
    rows = _rows(text, separator)
    cells = [c for _, c in _first(shape, separator)]
    names, headed = _names(cells, remarks, separator, options.header)
    decimal = options.decimal or _decimal(cells[1:] if headed else cells, separator)
    if decimal == "," and options.decimal is None:
        notes.append("decimal commas read as points")
    if not headed and options.header is None:
        notes.append(
            "no header: columns have their numbers as names, from 1" if names is None else "header in a remark"
        )
    if names is None:
        names = [str(i + 1) for i in range(len(cells[0]))]
    if headed:
        next(rows)
    columns, at, units = _columns(file, rows, len(names), decimal)
    labels, twice = _unique(names)
    table = Table(
        file,
        dict(zip(labels, columns, strict=True)),
        lines=at,
        twice=twice,
        notes=tuple(notes),
        units=dict(zip(labels, units, strict=True)) if units else {},
    )
    return (Recorded("", (table,)),)


def _preamble(lines: list[str], separator: str | None) -> list[int]:
    """Numbers of the lines above a table that say what it is: each with at most half as many cells as all that come after."""
    shown = [k for k, s in enumerate(lines) if s.strip() and s.lstrip()[0] not in "#%"][:SHAPE]
    if not shown:
        return []
    sign = separator or _separator([lines[shown[-1]]])
    counts = [len(lines[k].split() if sign == " " else _QUOTED.sub("", lines[k]).split(sign)) for k in shown]
    width = counts[-1]
    first = next((k for k in range(len(counts)) if set(counts[k:]) == {width}), 0)
    if width <= 2 or len(counts) - first < TABLE or any(2 * c > width for c in counts[:first]):
        return []
    # Several names above rows of numbers alone are a header with names missing.
    headed = not all(_NUMBER.match(c) for c in lines[shown[first]].split(sign))
    return shown[:first] if headed or max(counts[:first], default=0) == 1 else []


def _decoded(file: Path) -> tuple[str, list[str]]:
    raw = file.read_bytes()
    if raw[:2] in (b"\xff\xfe", b"\xfe\xff"):
        text = raw.decode("utf-16", errors="replace")
        if sum(c < "\u0250" for c in text) > 0.9 * len(text):
            return text, ["UTF-16"]
    if b"\0" in raw[:100_000]:
        raise MeasurementError(f"{file}: not a text file; is it really csv?")
    try:
        return raw.decode("utf-8-sig"), []
    except UnicodeDecodeError:
        return raw.decode("latin-1"), ["not UTF-8: read as Latin-1"]


def _separator(lines: list[str]) -> str:
    """The sign that stands equally often in every line, outside quotes and brackets. A comma comes last: it may be decimal."""
    bare = [_QUOTED.sub("", s) for s in lines]
    words = [s.split() for s in bare]
    if len({len(w) for w in words}) == 1 and len(words[0]) > 1 and all(_PLAIN.match(c) for w in words[1:] for c in w):
        return "\t" if all(s.count("\t") == len(w) - 1 for s, w in zip(bare, words, strict=True)) else " "
    for sign in SEPARATORS:
        counts = {s.rstrip(sign).count(sign) for s in bare}
        if len(counts) == 1 and counts != {0}:
            return sign
    return next((sign for sign in SEPARATORS[:-1] if sign in bare[-1]), ",")


def _reader(text: str, separator: str) -> Any:
    return csv.reader(io.StringIO(text, newline=""), delimiter=separator, skipinitialspace=True)


def _rows(text: str, separator: str) -> Any:
    """(line number, cells) of every line that is neither blank nor a remark."""
    reader = _reader(text, separator)
    while True:
        try:
            cells = next(reader)
        except StopIteration:
            return
        except csv.Error as error:
            raise MeasurementError(f"row {reader.line_num}: not a table: {error}") from None
        if not cells or (len(cells) == 1 and not cells[0].strip()):
            continue
        if cells[0].lstrip()[:1] in ("#", "%"):
            continue
        if separator == " ":
            cells = [c for c in cells if c]
        yield reader.line_num, _rejoined(cells, separator)


def _rejoined(cells: list[str], separator: str) -> list[str]:
    """Lists that the separator cut into pieces: ``[0.1, 0.2]`` is one cell."""
    if not any(c[:1] in "[({" and c[-1:] not in "])}" for c in cells if c):
        return cells
    out: list[str] = []
    inside = False
    for cell in cells:
        if inside:
            out[-1] += separator + cell
        else:
            out.append(cell)
        inside = out[-1].lstrip()[:1] in ("[", "(", "{") and out[-1].rstrip()[-1:] not in ("]", ")", "}")
    return out


def _first(lines: list[str], separator: str) -> list[tuple[int, list[str]]]:
    return list(_rows("\n".join(lines), separator))


def _names(
    cells: list[list[str]], remarks: list[str], separator: str, header: bool | None
) -> tuple[list[str] | None, bool]:
    """The names of the columns (None: they have none) and whether the first row holds them."""
    first = [c.strip() for c in cells[0]]
    counted = [str(i) for i in range(len(first))] == first and len(first) > 1
    headed = header if header is not None else counted or not all(_NUMBER.match(c) or not c for c in first)
    if header is None and headed and not counted and len(cells) > 1 and any(_NUMBER.match(c) for c in first):
        # A list or a text in the first row of data is no header; a header has no numbers among its names.
        headed = not any(_NUMBER.match(c) and _NUMBER.match(d) for c, d in zip(first, cells[1], strict=False))
    if headed:
        return first, True
    if header is None and remarks:
        named = [c.strip() for c in next(_reader(remarks[-1], separator), [])]
        named = [c for c in named if c] if separator == " " else named
        if len(named) == len(first) and not any(_NUMBER.match(c) for c in named):
            return named, False
    return None, False


def _decimal(cells: list[list[str]], separator: str) -> str:
    flat = [c.strip() for row in cells for c in row]
    commas = sum(bool(re.fullmatch(r"[-+]?\d*,\d+([eE][-+]?\d+)?", c)) for c in flat)
    points = sum(bool(re.fullmatch(r"[-+]?\d*\.\d+([eE][-+]?\d+)?", c)) for c in flat)
    return "," if separator != "," and commas and not points else "."


def _columns(file: Path, rows: Any, width: int, decimal: str) -> tuple[list[Any], list[int], list[str]]:
    """The columns, the line number of each row, and the units where a second line states them."""
    blocks: list[list[Any]] = [[] for _ in range(width)]
    lines: list[int] = []
    pending: list[list[str]] = []
    units: list[str] = []
    for line, found in rows:
        cells = found
        while len(cells) > width and not cells[-1].strip():
            cells = cells[:-1]
        if len(cells) != width:
            hint = "; decimal commas need another separator" if len(cells) > width else ""
            raise MeasurementError(f"{file}: row {line}: {len(cells)} cells; the rows above have {width}{hint}")
        if not lines and not units and _are_units(cells):
            units = [c.strip().strip("[]()").strip() for c in cells]
            continue
        pending.append(cells)
        lines.append(line)
        if len(pending) == BLOCK:
            _flush(pending, blocks, decimal)
    _flush(pending, blocks, decimal)
    while lines and all(_last(b) == "" for b in blocks):
        lines.pop()
        for b in blocks:
            b[-1] = b[-1][:-1]
            if not len(b[-1]):
                b.pop()
    return [_joined(b) for b in blocks], lines, units


def _are_units(cells: list[str]) -> bool:
    """Whether a row holds texts alone, as the second line of some loggers does: ``s;deg;deg`` or ``[s],[deg],[deg]``."""
    bare = [c.strip().strip("[]()") for c in cells]
    return any(bare) and not any(_NUMBER.match(c) or (_QUOTED.match(c.strip()) and re.search(r"\d", c)) for c in bare)


def _last(blocks: list[Any]) -> Any:
    value = blocks[-1][-1]
    return value.strip() if isinstance(value, str) else value


def _flush(pending: list[list[str]], blocks: list[list[Any]], decimal: str) -> None:
    if not pending:
        return
    for k, column in enumerate(zip(*pending, strict=True)):
        values: Any = [c.replace(",", ".") if decimal == "," and _NUMBER.match(c) else c.strip() for c in column]
        with contextlib.suppress(ValueError):
            values = np.array(values, dtype=np.float64)
        blocks[k].append(values)
    pending.clear()


def _joined(blocks: list[Any]) -> Any:
    if blocks and all(isinstance(b, np.ndarray) for b in blocks):
        return np.concatenate(blocks)
    return [v for b in blocks for v in (b.tolist() if isinstance(b, np.ndarray) else b)]


def _unique(names: list[str]) -> tuple[list[str], frozenset[str]]:
    """Names for a dictionary: the second ``q`` becomes ``q #2``, and ``q`` is remembered as standing twice."""
    out: list[str] = []
    twice: set[str] = set()
    for name in names:
        label = name
        if label in out:
            twice.add(name)
            label = f"{name} #{sum(o == name or o.startswith(f'{name} #') for o in out) + 1}"
        out.append(label)
    return out, frozenset(twice - {""})
