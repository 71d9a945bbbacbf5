"""Which files of a folder are recordings, and what their trials are called."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import zip_longest
from pathlib import Path

import numpy as np

from ee_dist.measurements.errors import MeasurementError
from ee_dist.measurements.readers import kind_of, read
from ee_dist.measurements.readers.json_rows import read_json
from ee_dist.measurements.readers.options import Options
from ee_dist.measurements.table import Table

PROSE = ".txt"
"""The suffix of tables, and of notes."""
DEEPEST = 4
"""Folders below the one that was named in which files are looked for."""


def recordings_in(folder: Path, kind: str | None = None) -> tuple[list[Path], list[str]]:
    """The recordings (of a ``kind``) of a folder by name, or, where it holds none, of the folders below it: one a trial, as
    loggers make them. And notes on what was left out. Both empty where there is nothing."""
    found = _those(folder, kind)
    below = [folder]
    while not found and below and len(below[0].parts) - len(folder.parts) < DEEPEST:
        below = [d for f in below for d in sorted(f.iterdir()) if d.is_dir() and not d.is_symlink()]
        found = [file for d in below for file in ([d] if kind_of(d) else _those(d, kind))]
    others = {kind_of(f) for f in found} - {"json"}
    loose = [f for f in found if others and kind_of(f) == "json" and not _has_rows(f)]
    notes = []
    if loose:
        more = f" and {len(loose) - 1} more" if len(loose) > 1 else ""
        notes.append(f"{loose[0].name}{more} left out: no rows in it")
    if len({f.suffix.lower() for f in found} - {PROSE, ".json"}):
        prose = {f: why for f in found if f.suffix.lower() == PROSE and (why := _no_table(f))}
        notes += [f"{f.name} left out: {why}" for f, why in prose.items()]
        loose += prose
    again = _written_twice([f for f in found if f not in loose])
    if again:
        more = f" and {len(again) - 1} more" if len(again) > 1 else ""
        file, first = next(iter(again.items()))
        notes.append(f"{file.name}{more} left out: the same rows as in {first.name}, read once")
        loose += again
    return [f for f in found if f not in loose], notes


def _written_twice(files: Sequence[Path]) -> dict[Path, Path]:
    """Files of which each is another's record in another form, under the same name but for its suffix, and that other; of each
    pair of suffixes the first two files tell."""
    told: dict[tuple[str, str], bool] = {}
    firsts: dict[tuple[Path, str], Path] = {}
    again = {}
    for file in files:
        first = firsts.setdefault((file.parent, file.stem), file)
        if first == file:
            continue
        forms = (first.suffix, file.suffix)
        if forms not in told:
            told[forms] = _same(first, file)
        if told[forms]:
            again[file] = first
    return again


def _same(one: Path, other: Path) -> bool:
    """Whether two files hold the same numbers in the same columns."""
    try:
        tables = [[t for r in read(f) for t in r.tables] for f in (one, other)]
        return len(tables[0]) == len(tables[1]) and all(
            [*a.addresses()] == [*b.addresses()] and len(a) == len(b) and all(_alike(a, b, c) for c in a.addresses())
            for a, b in zip(*tables, strict=True)
        )
    except MeasurementError:
        return False


def _alike(one: Table, other: Table, column: str) -> bool:
    a, b = one.numbers(column, gaps=True), other.numbers(column, gaps=True)
    return bool(np.allclose(a, b, rtol=1e-4, atol=1e-4 * float(np.nanmax(np.abs(a), initial=0.0)), equal_nan=True))


def _those(folder: Path, kind: str | None) -> list[Path]:
    return sorted(f for f in folder.iterdir() if kind_of(f) is not None and kind in (None, kind_of(f)))


def _no_table(file: Path) -> str:
    """Why a text beside recordings of another kind is none itself, but what people write about them; empty: it is one."""
    try:
        read(file)
    except MeasurementError as error:
        return str(error).removeprefix(f"{file}: ")
    return ""


def _has_rows(file: Path) -> bool:
    """Whether a JSON beside recordings is one itself: it may as well say how they were made."""
    try:
        return bool(read_json(file, Options()))
    except MeasurementError:
        return False


def own_names(files: Sequence[Path]) -> dict[Path, str]:
    """What tells each file from the others: its stem or, where two have the same, with the folders in which they differ."""
    stems = [f.stem if f.suffix else f.name for f in files]
    if len(set(stems)) == len(stems):
        return dict(zip(files, stems, strict=True))
    folders = [f.parent.parts for f in files]
    shared = next((k for k, words in enumerate(zip_longest(*folders)) if len(set(words)) > 1), max(map(len, folders)))
    apart = [" ".join(f[shared:]) for f in folders]
    if len(set(stems)) > 1 or len(set(apart)) < len(apart):
        apart = [
            f"{a} {f.name if len(set(folders)) == 1 else stem}".strip()
            for a, f, stem in zip(apart, files, stems, strict=True)
        ]
    return dict(zip(files, apart, strict=True))
