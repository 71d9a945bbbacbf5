"""What a proposal is made of: choices with their reasons, questions for a person, and hints that a person gave."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

SURE, LIKELY, UNKNOWN = "sure", "likely", "unknown"
SHARE = "percent"
FIT = "fit"
"""Instead of gains: to be estimated from what the motion needs by the model."""
FEWEST_ROWS = 21
"""Rows that are needed to tell what columns are."""
UNITS_TO_ASK = ("rad", "deg", "m", "mm", SHARE)


@dataclass(frozen=True)
class Told:
    """What the data say of an order of joints that no person said: how sure, and why; a question where they leave it open, a note
    where they do not."""

    sure: str
    why: str
    question: str = ""
    note: str = ""


@dataclass(frozen=True)
class Hints:
    """What a person said because no file can: ``joints`` in the order of the columns, the ``gains`` of the motors (N.m/A, in
    the same order; or FIT), the ``unit`` of positions (or "percent" of each joint's range), ``rate_hz`` of rows without a
    time. ``written``: orders in which the robot's files list the joints, and what each is called; ``told``: where not a person
    but the data gave ``joints``."""

    joints: Sequence[str] | None = None
    gains: Sequence[float] | str | None = None
    unit: str | None = None
    rate_hz: float | None = None
    written: Sequence[tuple[str, Sequence[str]]] = ()
    told: Told | None = None


@dataclass(frozen=True)
class Choice:
    """One channel: ``entry`` is its line in the mapping (None: left out), ``sure`` how sure, ``why`` the evidence."""

    group: str
    name: str
    entry: dict[str, Any] | None
    sure: str
    why: str
    still: bool = False
    """Whether its column never changes in the trial that was looked at."""

    @property
    def column(self) -> str:
        if self.entry is None:
            return "-"
        if self.group == "settings":
            return next(str(v.get("header", v.get("column"))) for v in self.entry.values() if isinstance(v, dict))
        place = self.entry.get("table")
        column = str(self.entry.get("column", self.entry.get("speed_of", self.entry.get("rate_hz", ""))))
        return f"{place}: {column}" if place else column


@dataclass
class Proposal:
    """All choices, what was assumed for all, and what only a person can know."""

    choices: list[Choice] = field(default_factory=list)
    questions: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    head: dict[str, Any] = field(default_factory=dict)
    """Keys of the mapping besides the channels: robot, tables, split."""
    unused: list[str] = field(default_factory=list)
    """Columns that nothing was made of."""

    def ask(self, question: str) -> None:
        if question not in self.questions:
            self.questions.append(question)
