"""What drives were told, and what they gave: commands, torques, and what pushed on joints from outside."""

from __future__ import annotations

import math
from collections.abc import Mapping as AnyMapping
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ee_dist.basics.names import listed
from ee_dist.basics.quoted import quoted
from ee_dist.measurements.errors import MeasurementError
from ee_dist.measurements.evenly_led import SOON, evenly_led
from ee_dist.measurements.mapping import LINES, Column, Mapping
from ee_dist.measurements.on_grid import HELD, OnGrid
from ee_dist.measurements.report import COMMAND, TORQUE
from ee_dist.measurements.robot_channels import command_kind, command_kinds, command_units, torque_units
from ee_dist.measurements.signals import lags
from ee_dist.measurements.units import TURN
from ee_dist.robots.model import Robot
from ee_dist.trials.log import Array

OR_HELD = "('commands_between: held' if they were): "
WHY_LINES = f"joints are ahead of what is held from row to row, as none can be {OR_HELD}"
WHY_EVEN = (
    f"they change evenly, and joints follow within a row at even speeds, as by no stiff drive that holds them {OR_HELD}"
)
SELDOM_S = 0.05
"""Rows so far apart, of commands that change from each to the next, may have others in between."""
AT_ONCE = 0.3
"""Of a row of commands: joints that are not even so much later than a line through them are not led by what is held from one row
to the next, which is half a row later."""
AGREE = 1.0
"""Rows by which the lags of joints that one controller leads may differ: of more than half of them, or nothing is told."""


@dataclass(frozen=True)
class Lag:
    """How many rows of its commands a joint is later than lines through them in a trial, how far they sent it in all, and whether
    it was led evenly (see evenly_led.py)."""

    joint: str
    rows: float
    path: float
    even: bool = False


def goes_on(trials: Sequence[Sequence[Lag]]) -> str:
    """Why commands go on by lines from row to row, if they do: the joints of all trials follow these so closely that none can
    have been held, or as closely as a row, and evenly. One controller leads all trials: each joint counts in each by how far it
    was sent there, beside the trial that sent it farthest. A trial in which three joints hardly move, one of them 90 ms ahead
    and another as late, tells nothing."""
    every = [lag for trial in trials for lag in trial]
    if not every:
        return ""
    farthest: dict[str, float] = {}
    for lag in every:
        farthest[lag.joint] = max(farthest.get(lag.joint, 0.0), lag.path)
    every.sort(key=lambda lag: lag.rows)
    rows, weights = (np.array(v) for v in zip(*((g.rows, g.path / farthest[g.joint]) for g in every), strict=True))
    middle = float(np.interp(0.5 * weights.sum(), np.cumsum(weights) - 0.5 * weights, rows))  # the weighted median
    agreed = weights[np.abs(rows - middle) < AGREE].sum() > 0.5 * weights.sum()
    even = weights[[g.even for g in every]].sum() > 0.5 * weights.sum()
    if not agreed or middle <= -1.0:
        return ""
    return WHY_LINES if middle < AT_ONCE else WHY_EVEN if middle < SOON and even else ""


class Led:
    """The drives of a robot, as the mapping tells of them."""

    def __init__(self, on: OnGrid, mapping: Mapping, robot: Robot) -> None:
        self.on, self.mapping, self.robot, self.report = on, mapping, robot, on.report

    def _commands(self, torques: Array | None, lines: bool) -> Array:
        """What the drives were told, (T, M). Without any: the torques where the drives obey torques, else NaN; of joints that
        all swing freely, nothing."""
        units = command_units(self.robot)
        if self.mapping.commands:
            nothing = np.zeros(len(self.on.at_s))  # what a passive joint is told
            return self._by_motor(self.mapping.commands, units, COMMAND, nothing, lines)
        if not units:
            return np.zeros((len(self.on.at_s), len(self.robot.drives)))
        assert torques is not None
        if command_kinds(self.robot) == {"torque"} and np.isfinite(torques).all():
            self.report.done.append(
                "no commands: the drives obey torques, so the measured ones are taken as what was asked"
            )
            return torques.copy()
        self.report.done.append("no commands were recorded: only a balance of forces can compare this log")
        return np.full(torques.shape, math.nan)

    def commands(self, torques: Array | None, why: str) -> Array:
        """Commands (T, M), held from one row to the next; or, where they go on (``why``), on lines between the rows: what was
        logged are points on the way of a controller, as clients of industrial arms have them."""
        lines = bool(why) or self.mapping.commands_between == LINES
        found = self._commands(torques, lines)
        self.report.between = LINES if lines else self.mapping.commands_between or ""
        if lines:
            self.report.done = [line.replace(HELD, "") for line in self.report.done]
            self.report.done.append(
                f"commands: {why}they are taken as points between which the controller went on, by straight lines"
                if self.mapping.commands_between is None
                else "commands: by straight lines from one row to the next, as the mapping says"
            )
        elif self.mapping.commands_between is None:
            self._tell_of_slow_rows()
        return found

    def _tell_of_slow_rows(self) -> None:
        """Of commands that a logger kept only now and then, what looks like a delay may be that they are held here."""
        columns = [c for d in self.robot.drives if isinstance(c := self.mapping.commands.get(d.joint), Column)]
        seldom = []
        for c in columns:
            own = self.on.clocks[c.table]
            if own.table.planned or own.timing.median_s < SELDOM_S:
                continue
            changes = np.diff(own.table.numbers(c.column, gaps=True)) != 0
            if len(changes) and changes.mean() > 0.5:
                seldom.append(own.timing.median_s)
        if seldom:
            self.report.done.append(
                f"commands: held over rows that are {1e3 * max(seldom):.3g} ms apart, and others in most of them: where the "
                f"controller went on in between, half a row ({500 * max(seldom):.3g} ms) of what looks like delay is none "
                "('commands_between: lines' takes them so)"
            )

    def lags(self, positions: AnyMapping[str, Array], speeds: AnyMapping[str, Array]) -> list[Lag]:
        """Those of the joints by which it shows, where nobody says how commands go on. ``positions``, and ``speeds`` that were
        read (T,), by joint."""
        asked = {
            d.joint: self.mapping.commands.get(d.joint) for d in self.robot.drives if command_kind(d) == "position"
        }
        led = {j: c.table for j, c in asked.items() if isinstance(c, Column) and j in positions}
        if self.mapping.commands_between is not None or self.on.as_is or len({*led.values()}) != 1:
            return []
        before = list(self.report.done), list(self.report.suspicious), dict(self.report.ranges)
        names, commands = list(led), self._commands(None, True)
        self.report.done, self.report.suspicious, self.report.ranges = before
        commands = commands[:, [self.robot.motor_names.index(j) for j in names]]
        row_s = self.on.clocks[led[names[0]]].timing.median_s
        seen = np.stack([positions[j] for j in names], axis=1)
        paths = np.abs(np.diff(commands, axis=0)).sum(axis=0)
        found = []
        for k, late in lags(commands, seen, self.on.step_s).items():
            read = speeds.get(names[k])
            even = read is not None and evenly_led(commands[:, k], seen[:, k], read, self.on.step_s, row_s)
            found.append(Lag(names[k], late / row_s, float(paths[k]), even))
        return found

    def on_one_turn(self, commands: Array, channels: AnyMapping[str, Array]) -> None:
        """Brings unwrapped commands to the turn of their positions: at 178 and -178 degrees the two may begin next to one
        another, and go on a whole turn apart."""
        position_of = {s.target: s.name for s in self.robot.sensors if s.kind == "position"}
        for k, drive in enumerate(self.robot.drives):
            asked, name = self.mapping.commands.get(drive.joint), position_of.get(drive.joint, "")
            seen = self.mapping.sensors.get(name)
            if command_kind(drive) != "position" or self.robot.joint(drive.joint).kind != "hinge":
                continue
            if asked is None or not isinstance(seen, Column) or not (asked.unwrap or seen.unwrap):
                continue
            turns = round(float(np.median(commands[:, k] - channels[name])) / TURN)
            if turns:
                commands[:, k] -= turns * TURN
                low, high = float(commands[:, k].min()), float(commands[:, k].max())
                self.report.ranges[f"command of {drive.joint}"] = (low, high, "rad")
                self.report.done.append(f"command of {drive.joint}: brought {-turns:+d} turns nearer to the positions")

    def torques(self) -> Array | None:
        """Torques of the drives, (T, M), NaN at those without a column; none where the mapping names no column."""
        columns, motors = self.mapping.torques, self.robot.motor_names
        if not columns:
            return None
        without = [m for m in motors if m not in columns]
        if without:
            self.report.done.append(
                f"torques at {len(motors) - len(without)} of {len(motors)} joints: a balance of forces compares them there; "
                f"those of {listed(without)} are not known"
            )
        unknown = np.full(len(self.on.at_s), math.nan)
        return self._by_motor(columns, torque_units(self.robot), TORQUE, unknown)

    def _by_motor(
        self,
        columns: Any,
        units: dict[str, str],
        what: str,
        without: Array,
        lines: bool = False,
        step_like: bool = True,
    ) -> Array:
        """(T, M): the columns of the drives that have one, ``without`` (T,) at the others."""
        return np.stack(
            [
                self.on.column(columns[m], units[m], f"{what} {m}", step_like, lines=lines)
                if m in columns and m in units
                else without
                for m in self.robot.motor_names
            ],
            axis=1,
        )

    def external(self) -> Array | None:
        """Known torques on the joints that are not the drives', (T, M); none where the mapping names no column."""
        columns = self.mapping.external
        if not columns:
            return None
        rest = np.zeros(len(self.on.at_s))
        return self._by_motor(columns, torque_units(self.robot), "external torque on", rest, step_like=False)

    def released(self, commands: Array) -> None:
        """A drive that is switched off obeys no command: its command is NaN."""
        if self.mapping.enabled is None:
            return
        on = self.on.column(self.mapping.enabled, "1", "enabled", True, quiet=True) > 0.5
        if not on.any():
            raise MeasurementError(
                f"{self.mapping.source}: enabled: {quoted(self.mapping.enabled.column)} is 0 in every row: the drives never "
                "obeyed"
            )
        if not on.all():
            commands[~on] = math.nan
            self.report.done.append(f"drives released in {int((~on).sum())} rows ({self.mapping.enabled.column})")
