"""The mapping: which column is which channel, in which unit. One YAML file for all files of one kind.

See docs/bring_your_robot.md for the form, and docs/examples for those of public data sets.
"""

from __future__ import annotations

from collections.abc import Mapping as Dictionary
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ee_dist.measurements.readers.options import Options

BETWEEN, LINES = "commands_between", "lines"
"""Where a mapping and a recording say what commands do from one row to the next; that they are points between which a controller
goes on."""
ESTIMATED = "estimated"
"""Where a recording says which of its channels nobody measured: speeds that were made of positions."""
HELD_IF = {"held": True, LINES: True, "steps": False}
"""Whether drives are those of a robot, by what may be said there; else each command was taken in one step of a simulation."""


@dataclass(frozen=True)
class Column:
    """A column as a channel: value = sign * scale * number + offset, which is in ``unit``.

    ``table`` is the table it stands in, where a trial has several. ``signed_bits``: an unsigned counter of that width that
    holds a signed number. ``unwrap``: an angle that jumps by whole turns; ``rolls_over``: the numbers after which
    a reading begins anew, where these are no turn. ``gaps: interpolate`` fills empty cells from
    their neighbours, or with the last command. ``lead_s``: how long before its time stamp a command took effect,
    or a torque or another reading was what it tells.
    ``smooth_s``: centred mean over that time. ``sure``: the unit is right although the numbers look as if it were not.
    ``held``: the value (in ``unit``) of a channel that stood still in trials that have no such column, or an empty one.
    """

    column: str
    unit: str = "1"
    sign: float = 1.0
    scale: float = 1.0
    offset: float = 0.0
    signed_bits: int = 0
    unwrap: bool = False
    rolls_over: float = 0.0
    gaps: str = "error"
    lead_s: float = 0.0
    smooth_s: float = 0.0
    table: str = ""
    sure: bool = False
    held: float | None = None


@dataclass(frozen=True)
class Even:
    """Rows at equal distances, where no column holds the time."""

    rate_hz: float


@dataclass(frozen=True)
class Clock:
    """A table with a clock of its own: its file (with {trial} for the name of the trial), its time, and what to add to it
    to get the time of the first table; None where that is to be estimated."""

    file: str = ""
    time: Column | Even | None = None
    offset_s: float | None = None


@dataclass(frozen=True)
class Split:
    """How the rows of one file are several trials: by the value of a column, or wherever the time starts again."""

    column: str = ""
    restarts: bool = False


@dataclass(frozen=True)
class Estimated:
    """A speed that nobody measured: central differences of a position channel behind a low-pass."""

    speed_of: str
    cutoff_hz: float = 50.0
    order: int = 4


@dataclass(frozen=True)
class Given:
    """A number that a file states, times ``scale``: an entry of its header, or a column that is the same all through a trial."""

    place: str
    """``header`` or ``column``."""
    name: str
    scale: float = 1.0


@dataclass(frozen=True)
class Setting:
    """What is known to be special about a trial, as an effect: a value is a number, or one that the file states."""

    effect: str
    target: str
    values: Dictionary[str, float | Given]
    trials: tuple[str, ...] = ()
    """Names of the trials that it is for, with * and ?; none: all."""


@dataclass(frozen=True)
class Mapping:
    """A checked mapping. ``robot`` is a name, a path or a description; ``folder`` is where its paths begin."""

    source: Path
    robot: Any
    time: Column | Even | None
    """None where the format states the time."""
    sensors: Dictionary[str, Column | Estimated]
    commands: Dictionary[str, Column]
    torques: Dictionary[str, Column] = field(default_factory=dict)
    external: Dictionary[str, Column] = field(default_factory=dict)
    supply: Column | None = None
    enabled: Column | None = None
    settings: tuple[Setting, ...] = ()
    gains: Dictionary[str, Dictionary[str, float]] = field(default_factory=dict)
    """Gains of drives (kp, kd) that a file states and the robot's description only assumes, by joint or for all_joints."""
    reading: Options = Options()
    tables: Dictionary[str, Clock] = field(default_factory=dict)
    side_by_side: Dictionary[str, str] = field(default_factory=dict)
    """Names of the files that are one table, row by row, by what goes before the names of their columns, with {trial}."""
    one_joint_each: Dictionary[str, str] = field(default_factory=dict)
    """Names of the files that hold one joint each, every one a trial, by what goes before the names of their columns, with *."""
    split: Split | None = None
    rate_hz: float | None = None
    commands_between: str | None = None
    """What commands do from one row to the next (a word of ``HELD_IF``); None where the joints are to show it."""
    trial: str | None = None
    """Name of a trial, with {key} for entries of the file's header."""

    @property
    def folder(self) -> Path:
        return self.source.parent

    def columns(self) -> list[tuple[str, str, Column]]:
        """(group, name, column) of every channel that is a column."""
        groups: tuple[tuple[str, Dictionary[str, Any]], ...] = (
            ("sensors", self.sensors), ("commands", self.commands), ("torques", self.torques),
            ("external", self.external), ("supply", {"": self.supply}), ("enabled", {"": self.enabled}),
        )  # fmt: skip
        return [(group, name, c) for group, columns in groups for name, c in columns.items() if isinstance(c, Column)]
