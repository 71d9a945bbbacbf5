"""What a mapping says about reading, and how much a file may ask for."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ee_dist.measurements.errors import MeasurementError

MOST_BYTES = 2 * 10**9
"""What a file may take in memory: some 60 channels at 1 kHz for an hour."""


@dataclass(frozen=True)
class Options:
    """``kind`` of the format (from the suffix when None); ``records`` names the list of rows in a JSON file; ``separator``,
    ``header`` and ``decimal`` of a text are looked at in the file when None."""

    kind: str | None = None
    records: str = "entries"
    separator: str | None = None
    header: bool | None = None
    decimal: str | None = None


def bounded(file: Path, size: float, cure: str = "cut it into parts") -> None:
    """Raises MeasurementError for more bytes than a file may take."""
    if size > MOST_BYTES:
        raise MeasurementError(f"{file}: would take {size / 1e9:.3g} GB; at most {MOST_BYTES / 1e9:g} GB: {cure}")
