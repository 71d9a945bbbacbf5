"""One reader for each format, one contract: a path gives trials, a trial tables, a table named columns of numbers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from ee_dist.basics.quoted import quoted
from ee_dist.measurements.errors import MeasurementError
from ee_dist.measurements.lost import without_lost
from ee_dist.measurements.readers.arrays import read_npz
from ee_dist.measurements.readers.bags import is_bag, read_bag, read_mcap
from ee_dist.measurements.readers.hdf5 import read_hdf5
from ee_dist.measurements.readers.json_rows import read_json
from ee_dist.measurements.readers.lerobot import is_lerobot, read_lerobot
from ee_dist.measurements.readers.matlab import read_mat
from ee_dist.measurements.readers.options import Options
from ee_dist.measurements.readers.parquet import read_parquet
from ee_dist.measurements.readers.text import read_text
from ee_dist.measurements.table import Recorded

Reader = Callable[[Path, Options], tuple[Recorded, ...]]
READERS: dict[str, Reader] = {
    "csv": read_text,
    "parquet": read_parquet,
    "json": read_json,
    "npz": read_npz,
    "mat": read_mat,
    "hdf5": read_hdf5,
    "bag": read_bag,
    "mcap": read_mcap,
    "lerobot": read_lerobot,
}
MOST_COLUMNS = 10_000
FORMATS = {
    ".csv": "csv",
    ".txt": "csv",
    ".tsv": "csv",
    ".dat": "csv",
    ".parquet": "parquet",
    ".pq": "parquet",
    ".json": "json",
    ".jsonl": "json",
    ".npz": "npz",
    ".npy": "npz",
    ".mat": "mat",
    ".h5": "hdf5",
    ".hdf5": "hdf5",
    ".bag": "bag",
    ".db3": "bag",
    ".mcap": "mcap",
}
"""Formats by the suffix of a file. Two are folders: a ROS 2 bag and a LeRobot data set."""


def kind_of(path: Path) -> str | None:
    """The format of a file by its suffix, of a folder by what is in it; None for another."""
    if path.is_dir():
        return "lerobot" if is_lerobot(path) else "bag" if is_bag(path) else None
    return FORMATS.get(path.suffix.lower())


def read(path: str | Path, options: Options = Options()) -> tuple[Recorded, ...]:  # noqa: B008
    """The trials of a recording. Raises MeasurementError in one line, naming the file, for all that cannot be read."""
    file = Path(path)
    if not file.exists():
        raise MeasurementError(f"{file}: no such file or folder")
    chosen = options.kind or kind_of(file)
    if chosen not in READERS and file.is_dir():
        raise MeasurementError(
            f"{file}: a folder; expected a file, a ROS 2 bag (metadata.yaml) or a LeRobot data set (meta/info.json)"
        )
    if chosen not in READERS:
        raise MeasurementError(
            f"{file}: unknown format {quoted(options.kind or file.suffix)}; expected {', '.join(FORMATS)}"
        )
    odd = [
        p for p in (file, *(file.rglob("*") if file.is_dir() else ())) if p.exists() and not (p.is_file() or p.is_dir())
    ]
    if odd:
        # A pipe would be waited for, and a device has no end.
        raise MeasurementError(f"{odd[0]}: not an ordinary file; expected a recording")
    try:
        if file.is_file() and file.stat().st_size == 0:
            raise MeasurementError(f"{file}: the file is empty")
        found = READERS[chosen](file, options)
    except FileNotFoundError:
        raise MeasurementError(f"{file}: no such file") from None
    except IsADirectoryError:
        raise MeasurementError(f"{file}: a folder; expected a file") from None
    except MemoryError:
        raise MeasurementError(f"{file}: does not fit into memory; cut it into parts") from None
    except OSError as error:
        raise MeasurementError(f"{file}: cannot be read ({error.strerror or error})") from None
    columns = max((len(t.columns) for r in found for t in r.tables), default=0)
    if columns > MOST_COLUMNS:
        raise MeasurementError(
            f"{file}: {columns} columns; at most {MOST_COLUMNS} are read: leave out what is no channel"
        )
    found = tuple(r for r in found if any(len(t) for t in r.tables))
    if not found:
        raise MeasurementError(f"{file}: no rows in it (zero length)")
    return tuple(replace(r, tables=tuple(map(without_lost, r.tables))) for r in found)
