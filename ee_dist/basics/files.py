"""Files that are there whole or not at all."""

from __future__ import annotations

import glob
import os
from contextlib import suppress
from pathlib import Path


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


def named(path: str | Path) -> list[Path]:
    """The file or folder of that name, or all that match it as a pattern (``runs/sine_*.csv``), by name. What matches nothing
    is left as it is, so that whoever opens it says what is wrong."""
    found = [] if os.path.lexists(path) else sorted(glob.glob(str(path), recursive=True))
    return [Path(f) for f in found] or [Path(path)]
