"""Arrays by name as tables: what NumPy's archives, MATLAB's files and HDF5 have in common, and the first of them."""

from __future__ import annotations

import re
import zipfile
from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ee_dist.measurements.errors import MeasurementError
from ee_dist.measurements.readers.options import Options, bounded
from ee_dist.measurements.table import WIDEST, Recorded, Table

FEW = 16
"""Arrays shorter than this beside long ones are settings, not series."""
TRIAL = re.compile(
    r"^(\d+|.*(trial|episode|ep|demo|run|rec|record|recording|exp|test|traj|rollout|meas)s?[ _.-]?\d+)$", re.I
)
"""What groups are called that hold a trial each."""


_UNITS, _JOINTS = re.compile("unit", re.I), re.compile("joint|motor|servo", re.I)
"""What texts are called that are units of columns, and names of joints."""
_SIGNS = (b"\x93NUMPY", b"\x80")
"""How an array begins, and a pickle, which deserves a reason of its own."""


def recorded(file: Path, name: str, arrays: Mapping[str, Any], notes: tuple[str, ...] = ()) -> Recorded:
    """A trial of arrays: those of one length are one table, numbers and texts its header.

    Arrays are (T,), (T, n) or (n, T); n texts are the names of n columns, or of joints. Raises MeasurementError where none is a
    series.
    """
    series: dict[str, Any] = {}
    header: dict[str, Any] = {}
    texts: dict[str, list[str]] = {}
    said = list(notes)
    for key, value in arrays.items():
        array = np.asarray(value)
        if array.dtype.kind not in "fiub":
            if array.ndim == 0 and array.dtype.kind in "US":
                header[key] = str(array)
            elif array.dtype.kind == "U" and 1 < array.size == max(array.shape) <= WIDEST:
                texts[key] = [str(c).strip() for c in array.ravel()]
            continue
        array = np.squeeze(array)
        if array.ndim == 0:
            header[key] = array.item()
        elif array.ndim <= 2:
            series[key] = array
        else:
            said.append(f"{key}: left out, its shape is {array.shape}; expected (T,) or (T, n)")
    lengths = Counter(len(a) for a in series.values() if a.ndim == 1)
    longest = max((max(a.shape) for a in series.values()), default=0)
    groups: dict[int, dict[str, Any]] = {}
    for key, array in series.items():
        rows = _rows(array, lengths)
        if rows < FEW <= longest:
            header[key] = array.tolist()
        elif array.ndim == 2 and min(array.shape) > WIDEST:
            said.append(f"{key}: left out, its shape is {array.shape}")
        else:
            groups.setdefault(rows, {})[key] = array.T if array.ndim == 2 and array.shape[0] != rows else array
    if not groups:
        raise MeasurementError(f"{file}: no array of numbers in it that is a series; there are: {_shapes(arrays)}")
    tables = tuple(
        _called(
            Table(
                file,
                columns,
                header,
                name="" if len(groups) == 1 else next(iter(columns)),
                notes=tuple(said) if not k else (),
            ),
            texts,
        )
        for k, columns in enumerate(groups.values())
    )
    return Recorded(name, tables)


def _called(table: Table, texts: Mapping[str, list[str]]) -> Table:
    """The table with the names that the file itself has for the columns of its arrays: of joints, in all that have as many, or
    of quantities, for the one array that has as many. Units are told by their name."""
    wide = {k: v.shape[1] for k, v in table.columns.items() if v.ndim == 2}
    units = [t for k, t in texts.items() if _UNITS.search(k)]
    for key, names in texts.items():
        theirs = [k for k, width in wide.items() if width == len(names)]
        if _UNITS.search(key) or not theirs or len(set(names)) < len(names) or not all(names):
            continue
        if _JOINTS.search(key):
            return replace(table, parts={k: tuple(names) for k in theirs})
        if len(theirs) > 1 or set(names) & (table.columns.keys() - {theirs[0]}):
            continue
        columns: dict[str, Any] = {}
        for k, array in table.columns.items():
            columns |= dict(zip(names, array.T, strict=True)) if k == theirs[0] else {k: array}
        stated = next((dict(zip(names, u, strict=True)) for u in units if len(u) == len(names)), {})
        return replace(
            table, columns=columns, spread={theirs[0]: tuple(names)}, units={k: u for k, u in stated.items() if u}
        )
    return table


def _rows(array: Any, lengths: Counter[int]) -> int:
    """Which side of an array is time: the one that other series have, or else the longer."""
    if array.ndim == 1:
        return len(array)
    a, b = array.shape
    known = [n for n in (a, b) if n in lengths]
    return known[0] if len(known) == 1 else max(a, b)


def _shapes(arrays: Mapping[str, Any]) -> str:
    return ", ".join(f"{k} {np.shape(v)}" for k, v in list(arrays.items())[:8]) or "none"


def read_npz(file: Path, options: Options) -> tuple[Recorded, ...]:
    """NumPy's .npz and .npy. Pickled objects are never loaded: they could run code. Raises MeasurementError."""
    try:
        packed = zipfile.is_zipfile(file)
        if not packed and not file.read_bytes()[:6].startswith(_SIGNS):
            raise MeasurementError(f"{file}: not an archive of NumPy (.npz) nor an array (.npy); is it cut short?")
        if packed:
            with zipfile.ZipFile(file) as archive:
                bounded(file, sum(i.file_size for i in archive.infolist()))
        else:
            bounded(file, file.stat().st_size)
        found = np.load(file, allow_pickle=False)
        if isinstance(found, np.ndarray):
            return (recorded(file, "", {file.stem: found}),)
        arrays: dict[str, Any] = {}
        notes: list[str] = []
        with found:
            for key in found.files:
                try:
                    arrays[key] = found[key]
                except ValueError as error:
                    if "pickle" not in str(error).lower():
                        raise
                    notes.append(f"{key}: left out, it holds Python objects, which are not loaded: they could run code")
        if not arrays and notes:
            raise MeasurementError(f"{file}: {notes[0]}; save arrays of numbers")
        return (recorded(file, "", arrays, tuple(notes)),)
    except (MeasurementError, MemoryError, FileNotFoundError, PermissionError):
        raise
    except Exception as error:  # Headers are parsed as Python, and archives as zip: both raise what they stumble upon.
        if "pickle" in str(error).lower() or "object" in str(error).lower():
            raise MeasurementError(
                f"{file}: holds Python objects (a pickle), which are not loaded: they could run code; save arrays of numbers"
            ) from None
        raise MeasurementError(f"{file}: not an archive of NumPy, or cut short: {in_one_line(error)}") from None


def in_one_line(error: BaseException) -> str:
    """What a library said, short."""
    return " ".join(f"{error or type(error).__name__}".split())[:120]
