"""All tables of a trial on one clock: that of the first sensor's table."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ee_dist.basics.names import counted
from ee_dist.measurements.alignment import SHARED, Match, match, one_clock
from ee_dist.measurements.clocks import clocked, loosely_clocked
from ee_dist.measurements.errors import MeasurementError
from ee_dist.measurements.frozen import frozen
from ee_dist.measurements.jumps import FEWEST, hops
from ee_dist.measurements.mapping import Column, Even, Mapping
from ee_dist.measurements.robot_channels import command_kind
from ee_dist.measurements.table import Recorded, Table
from ee_dist.measurements.units import factor
from ee_dist.robots.model import Robot, Sensor
from ee_dist.trials.log import Array

LEAST_SHARED = 0.5
"""Share of the main table's time that its other tables must cover."""

STALE, LEAST_STALE, NEARLY, NEXT, FIRST, ENOUGH = 5.0, 2e-3, 0.99, 10, 3, 30
"""A first reading is of another moment where a joint would go so many times as fast to the next as in nearly all steps after,
and at least so far, rad (m); their share, and the next ones, of which it is all; first rows that may be so, and steps by which
that is judged."""


class TrialClocks:
    """``main`` is the clocked table of the first sensor, ``clocks`` all by name, on its clock; ``unit`` is what the mapping
    says its time is in, ``lost`` where rows are missing among those that come in bunches. What was done goes to ``done``. Raises
    MeasurementError where the clocks cannot be brought together.
    """

    def __init__(self, recorded: Recorded, mapping: Mapping, robot: Robot, done: list[str]) -> None:
        self.recorded, self.mapping, self.robot, self.done = recorded, mapping, robot, done
        self.where, self.lost = str(mapping.source), ""
        used = mapping.columns()
        self.first = next((c.table for g, _, c in used if g == "sensors"), "")
        time = self._time(self.first)
        self.unit = time.unit if isinstance(time, Column) else "s"
        self.main = clocked(self._table(self.first), time, self.where, self._positions())
        self._tell_moments()
        self.clocks = {self.first: self.main}
        for name in dict.fromkeys(c.table for _, _, c in used):
            if name != self.first:
                self.clocks[name] = loosely_clocked(self._table(name), self._time(name), self.where)
        self._align()
        self._tell_bunched()

    def _positions(self) -> Array | None:
        """(T, J) what the main table says of joints' positions, as it stands there."""
        kinds = {s.name: s.kind for s in self.robot.sensors}
        read = [
            c.column
            for n, c in self.mapping.sensors.items()
            if isinstance(c, Column) and c.table == self.first and kinds.get(n) == "position"
        ]
        table = self._table(self.first)
        try:
            return np.stack([table.numbers(c, gaps=True) for c in read], axis=1) if read else None
        except MeasurementError:  # What is wrong with a column is said where it is read.
            return None

    def _tell_bunched(self) -> None:
        """Tells of rows that are taken at an even pace; other tables that bear the same stamps follow."""
        if self.main.stamped is None:
            return
        stamps, pace = self.main.stamped, self.main.timing.median_s
        steps = 1e3 * np.diff(stamps)
        for name, found in self.clocks.items():
            if name != self.first and float(np.isin(found.times_s, stamps).mean()) > SHARED:
                found.times_s = np.interp(found.times_s, stamps, self.main.times_s)
        self._look_for_lost()
        keep = "; 'sure: true' at the time keeps the stamps" if self.main.table.clock is None else ""
        who, apart = self.first or self.main.table.path.name, f"{steps.min():.3g} to {steps.max():.3g} ms apart"
        self.done.append(
            f"{who}: stamps come in bunches ({apart}), and positions go on evenly from row to row: rows are taken "
            f"{1e3 * pace:.4g} ms apart ({1 / pace:.4g} Hz){keep}"
        )

    def _look_for_lost(self) -> None:
        """Rows at an even pace from one of which to the next several times as far was gone, by the joints as they were read."""
        read = self._positions()
        if read is None:
            return
        rows = np.unique(np.concatenate([hops(column, self.main.times_s) for column in read.T]))
        if len(rows) >= FEWEST:
            first = self.main.table.line(int(rows[0]) + 1)
            self.lost = (
                f"time: rows seem to be lost at {len(rows)} places, before row {first} first, where "
                "a joint goes several times as far in one row as around it: rows count as evenly apart there"
            )

    def _tell_moments(self) -> None:
        every, kept = len(self._table(self.first)), len(self.main.table)
        if kept < every:
            self.done.append(
                f"{self.first or self.main.table.path.name}: {counted(every - kept, 'row')} of {every} bear the time of the row "
                "before: of such rows the last counts"
            )

    def _table(self, name: str) -> Table:
        return self.recorded.table(name, self.where)

    def _time(self, name: str) -> Column | Even | None:
        """The time of a table: its own, that of all, or (None) what the format states."""
        own, table, time = self.mapping.tables.get(name), self._table(name), self.mapping.time
        if own is not None and own.time is not None:
            return own.time
        if table.clock is not None and not (isinstance(time, Column) and time.column in table):
            return None
        return time

    def _align(self) -> None:
        """Brings the clocks of all tables to that of the first: as the format or the mapping states it, or as signals fit."""
        stated = {n: self.mapping.tables[n].offset_s if n in self.mapping.tables else None for n in self.clocks}
        for name, found in self.clocks.items():
            offset = stated[name]
            if offset is not None:
                found.times_s = found.times_s + offset
                self.done.append(f"{name}: {offset:g} s added to its clock, as the mapping says")
        for name, found in self.clocks.items():
            if name == self.first or stated[name] is not None:
                continue
            if found.table.clock is not None and self.main.table.clock is not None:
                continue
            if one_clock(self.main.stamps_s, found.times_s):
                self.done.append(
                    f"{name}: its clock and that of {self.first} count from one epoch, stamp the same rows, or begin and end "
                    "together: taken as the same"
                )
                continue
            fit = self._fit(name)
            if fit is None or not fit.clear:
                why = (
                    "no channel to match it by"
                    if fit is None
                    else (f"best fit {fit.correlation:.2f} at {fit.offset_s:.4g} s, another {fit.rival:.2f}")
                )
                raise MeasurementError(
                    f"{self.where}: tables: {name}: its clock is not that of {self.first or self.main.table.path.name}, and the "
                    f"signals do not tell the offset ({why}); say 'offset_s: SECONDS' to add to it (0 if it is one clock)"
                )
            found.times_s = found.times_s + fit.offset_s
            self.done.append(
                f"{name}: {fit.offset_s:.4f} s added to its clock, where its signals fit best those of "
                f"{self.first} (correlation {fit.correlation:.3f}); a lag of the drives is part of it: "
                "state offset_s if you know it"
            )

    def _fit(self, name: str) -> Match | None:
        """The offset of a table by its commands against positions, speeds or torques, or its speeds against theirs."""
        targets = {s.name: (s.kind, s.target) for s in self.robot.sensors}
        of_joint = {targets[n]: c for n, c in self.mapping.sensors.items() if isinstance(c, Column) and n in targets}
        kinds = {d.joint: command_kind(d) for d in self.robot.drives}
        pairs: list[tuple[Array, Array]] = []
        held_between = False
        here, there = self.main, self.clocks[name]
        for group, channel, c in self.mapping.columns():
            if c.table != name or group not in ("sensors", "commands"):
                continue
            kind, joint = targets[channel] if group == "sensors" else (kinds[channel], channel)
            base = self.mapping.torques.get(joint) if kind == "torque" else of_joint.get(("position", joint))
            known = ("position", "velocity", "speed", "torque")
            if base is None or kind not in known or base.table != self.first:
                continue
            own = base.sign * base.scale * here.table.numbers(base.column)
            if kind in ("velocity", "speed"):
                own = np.gradient(own, here.times_s)
            pairs.append((own, c.sign * c.scale * there.table.numbers(c.column)))
            held_between = held_between or group == "commands"
        if not pairs or len(there.times_s) < 3:
            return None
        a, b = (np.stack([p[k] for p in pairs], axis=1) for k in (0, 1))
        return match(here.times_s, a, there.times_s, b, held_between)

    def cut(self) -> None:
        """Cuts the main table to the time that the others cover, to where all commands are known, and to where readings are of
        the motion; what is held needs no end."""
        self._cut_to_shared()
        self._cut_to_commands()
        self._cut_frozen()
        self._cut_stale()

    def _cut_to_shared(self) -> None:
        start, end = self.main.times_s[0], self.main.times_s[-1]
        for name, found in self.clocks.items():
            if name == self.first:
                continue
            start = max(start, found.times_s[0])
            if any(g == "sensors" and c.table == name for g, _, c in self.mapping.columns()):
                end = min(end, found.times_s[-1])
            elif found.times_s[-1] < start:
                end = start
        times_s = self.main.times_s
        inside = np.flatnonzero((times_s >= start - 1e-9) & (times_s <= end + 1e-9))
        if len(inside) < LEAST_SHARED * len(times_s):
            raise MeasurementError(
                f"{self.where}: the tables of {self.recorded.name} share only {max(0.0, end - start):.4g} s of "
                f"{times_s[-1] - times_s[0]:.4g} s; are their clocks in the same unit? else give offset_s for one of them"
            )
        if len(inside) < len(times_s):
            self.done.append(f"{len(times_s) - len(inside)} rows left out that not all tables cover")
            self._keep(slice(int(inside[0]), int(inside[-1]) + 1))

    def _cut_to_commands(self) -> None:
        """Cuts what was before the first command of any joint: cells that are empty there do not say what was asked for."""
        start, latest = -np.inf, ""
        for group, channel, c in self.mapping.columns():
            if group == "commands" and c.gaps == "interpolate":
                found = self.clocks[c.table]
                known = np.flatnonzero(np.isfinite(found.table.numbers(c.column, gaps=True)))
                if len(known) and found.times_s[known[0]] > start:
                    start, latest = found.times_s[known[0]], channel
        inside = np.flatnonzero(self.main.times_s >= start - 1e-9)
        if len(inside) < 2:
            raise MeasurementError(
                f"{self.where}: commands: {latest}: its first command comes when {self.main.table} ends; nothing to compare"
            )
        if inside[0] > 0:
            self.done.append(f"{int(inside[0])} rows left out that are before the first command of {latest}")
            self._keep(slice(int(inside[0]), None))

    def _cut_frozen(self) -> None:
        """Cuts rows at either end in which the logger repeated one reading."""
        for run in reversed(frozen(self.mapping, self.main, self.first, self.robot)):
            if run.rows.start == 0 or run.rows.stop == len(self.main.times_s):
                self.done.append(f"left out: {run.said(self.main.table.line(run.rows.start))}")
                self._keep(slice(run.rows.stop, None) if run.rows.start == 0 else slice(run.rows.start))

    def _cut_stale(self) -> None:
        """Cuts first rows that were read before the motion, from a buffer or before the controller was on: a simulation would
        begin there, at a speed that nothing had."""
        stale = max(map(self._stale_rows, self.robot.sensors), default=0)
        if stale:
            rows = counted(stale, "first row")
            self.done.append(f"{rows} left out: to the next a joint would go {STALE:g} times as fast as it does after")
            self._keep(slice(stale, None))

    def _stale_rows(self, sensor: Sensor) -> int:
        """How many first rows of a position are of another moment."""
        c = self.mapping.sensors.get(sensor.name)
        if sensor.kind != "position" or not isinstance(c, Column) or c.table != self.first or c.unwrap or c.rolls_over:
            return 0
        read = self.main.table.numbers(c.column, gaps=c.gaps == "interpolate")
        places = read * c.scale * factor(c.unit, sensor.unit, self.where)
        steps = np.abs(np.diff(places))
        speeds = steps / np.diff(self.main.times_s)
        for k in range(FIRST, 0, -1):
            after = speeds[k:][np.isfinite(speeds[k:])]
            if len(after) < ENOUGH or not steps[k - 1] > LEAST_STALE:
                continue
            # A joint that goes on as quickly was in motion, if it rests in all the rest of the record.
            if speeds[k - 1] > STALE * max(float(np.quantile(after, NEARLY)), float(after[:NEXT].max())):
                return k
        return 0

    def _keep(self, rows: slice) -> None:
        """Keeps some rows of the main table."""
        self.main = replace(self.main, table=self.main.table.part(rows), times_s=self.main.times_s[rows], stamped=None)
        self.clocks[self.first] = self.main
