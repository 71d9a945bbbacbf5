"""Files and folders: written whole or not at all, and found, or found free, by their names."""

from __future__ import annotations

import glob
import os
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any


def write_whole(path: Path, content: str | bytes) -> None:
    """Write a file whole or not at all: what was there before stays until all of it is on the disk. Raises OSError that
    names the file."""
    partial = path.with_name(path.name + ".part")
    try:
        with partial.open("wb") as file:
            file.write(content.encode() if isinstance(content, str) else content)
            file.flush()
            os.fsync(file.fileno())
        partial.replace(path)
    except OSError as error:
        with suppress(OSError):
            partial.unlink(missing_ok=True)
        # What fails in writing, not in opening, knows no name.
        error.filename = error.filename or str(path)
        raise


def real(path: str | Path) -> Path:
    """Where a path leads; of a link that leads to itself the link, so that whoever opens it says what is wrong."""
    return Path(os.path.realpath(path))


def named(asked: Any) -> list[Path]:
    """The files and folders that a setting names, one or several: each by its name, or all that match it as a pattern
    (``runs/sine_*.csv``), by name. What matches nothing is left as it is, so that whoever opens it says what is wrong."""
    found: list[Path] = []
    for path in map(str, asked if isinstance(asked, (list, tuple)) else [asked]):
        matching = [] if os.path.lexists(path) else sorted(glob.glob(path, recursive=True))
        found += map(Path, matching or [path])
    return found


def repeated(files: Sequence[Path]) -> Path | None:
    """The first of some files that is one of those before it, by whatever path."""
    known: set[Path] = set()
    for file in files:
        if real(file) in known:
            return file
        known.add(real(file))
    return None


def fresh(folder: Path) -> Path:
    """The folder, or with a number behind it the first that does not exist."""
    return numbered(folder) if folder.exists() else folder


def numbered(folder: Path) -> Path:
    """The first that does not exist of the folder with 2, 3, ... behind its name."""
    number = 2
    while (found := folder.with_name(f"{folder.name}_{number}")).exists():
        number += 1
    return found
