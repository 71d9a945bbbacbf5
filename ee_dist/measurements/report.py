"""What the import of a trial did and saw, for the terminal, a file and the summary."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

TORQUE = "torque of"
"""How the report names what a drive gave, before its joint."""
COMMAND, STUCK_AT, MANY = "command of", ": stuck at ", 3
"""How it names commands, what it says of a channel that never changes, and of how many of them in one line."""
CLIPPED, ENDS = ": clipped? ", ("highest", "lowest")
"""What it says of a channel that is long at an end of its readings, and what it calls the two."""
ROUNDING = 1e-12
"""Share of the larger end of a range below which the other end is what rounding left."""


@dataclass
class Report:
    """What the import of one trial did and saw. Rates in Hz, gaps as (row, seconds), ranges as (lowest, highest)."""

    file: str
    trial: str
    rows_read: int = 0
    rows: int = 0
    seconds: float = 0.0
    rate_read_hz: float = 0.0
    rate_hz: float = 0.0
    even: bool = True
    resampled: bool = False
    gaps: list[tuple[int, float]] = field(default_factory=list)
    ranges: dict[str, tuple[float, float, str]] = field(default_factory=dict)
    done: list[str] = field(default_factory=list)
    suspicious: list[str] = field(default_factory=list)
    between: str = ""
    """How commands go on from row to row, where the mapping says it or the joints do: a word of ``commands_between``."""

    def as_dict(self) -> dict[str, Any]:
        return asdict(self)


def in_one_line(suspicious: Sequence[str]) -> list[str]:
    """The lines, those on commands that stay as they are in one: trials in which a joint or two move have many of them."""
    still = [s for s in suspicious if s.startswith(COMMAND) and STUCK_AT in s]
    if len(still) < MANY:
        return list(suspicious)
    line = f"commands of {len(still)} joints stay as they are for the whole record, first {still[0].partition(' (')[0]}"
    return [line if s == still[0] else s for s in suspicious if s == still[0] or s not in still]


def without_rest(suspicious: Sequence[str], channels: Collection[str]) -> list[str]:
    """The lines, without those on ``channels`` that never change because nobody moved them."""
    return [s for s in suspicious if STUCK_AT not in s or not s.startswith(tuple(f"{c} (" for c in channels))]


def without_ends(suspicious: Sequence[str], channel: str, end: str) -> list[str]:
    """The lines, without that on a channel that is long at an ``end`` of its readings."""
    return [s for s in suspicious if not (s.startswith(f"{channel} (") and CLIPPED in s and f"the {end} value" in s)]


def describe(reports: Sequence[Report]) -> str:
    """The reports as text, for the terminal and a file."""
    lines: list[str] = []
    for r in reports:
        lines.append(f"{r.file}: trial {r.trial!r}")
        lines.append(
            f"  {r.rows_read} rows over {r.seconds:.4g} s, {r.rate_read_hz:.4g} Hz"
            + ("" if r.even else " (median; uneven)")
            + f" -> {r.rows} rows at {r.rate_hz:.4g} Hz; gaps: {len(r.gaps)}"
        )
        lines += [f"  {name}: {_range(low, high)} {unit}" for name, (low, high, unit) in r.ranges.items()]
        lines += [f"  done: {d}" for d in r.done]
        lines += [f"  suspicious: {s}" for s in r.suspicious]
    return "\n".join(lines)


def _range(low: float, high: float) -> str:
    """``-0.5 to 1.2``; what rounding left beside the other end is 0."""
    size = max(abs(low), abs(high))
    return " to ".join(f"{0.0 if abs(x) < ROUNDING * size else x:.5g}" for x in (low, high))
