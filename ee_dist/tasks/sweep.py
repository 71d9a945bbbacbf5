"""Jobs of a sweep that went wrong: the others are made all the same, and the end says which are missing."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from ee_dist.tasks.folder import shown

NAMED = 3
"""Folders that the last line names."""


@dataclass
class Jobs:
    """What became of the jobs of one command line, in this process."""

    folder: Path = Path()
    """Of the sweep."""
    well: int = 0
    broken: list[tuple[Path, int]] = field(default_factory=list)
    """Folder and exit status of each that went wrong."""

    @property
    def goes_on(self) -> bool:
        """Whether the next job is worth trying: where none ended well yet, all of them may have the same mistake."""
        return self.well > 0

    @property
    def status(self) -> int:
        return max((status for _, status in self.broken), default=0)

    def account(self) -> str:
        """Which runs are missing, and how to make them."""
        names = ", ".join(shown(folder) for folder, _ in self.broken[:NAMED])
        more = f" and {len(self.broken) - NAMED} more" if len(self.broken) > NAMED else ""
        return (
            f"{len(self.broken)} of {self.well + len(self.broken)} runs ended early: {names}{more}; "
            f"once that is put right, the same command and resume={shown(self.folder)} makes them"
        )
