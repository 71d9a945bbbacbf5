"""A recording and a mapping make sensor logs, and a report of what was done to the numbers on the way."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ee_dist.effects.catalogue import Hypothesis, term
from ee_dist.engines.drivers import Commands
from ee_dist.measurements.alignment import Match, match, one_epoch
from ee_dist.measurements.clocks import Clocked, check_grid, clocked, loosely_clocked
from ee_dist.measurements.errors import MeasurementError, nearest
from ee_dist.measurements.mapping import Column, Estimated, Even, Mapping
from ee_dist.measurements.report import Report
from ee_dist.measurements.robot_channels import check_names, command_kind, command_units, torque_units
from ee_dist.measurements.sampling import LowPass, grid, held, linear, smoothed
from ee_dist.measurements.suspicious import (
    command_suspicion,
    speed_suspicion,
    suspicions,
    time_suspicion,
    unit_suspicion,
)
from ee_dist.measurements.table import Recorded, Table
from ee_dist.measurements.trials import trials_of
from ee_dist.measurements.units import factor
from ee_dist.recording.records import HARDWARE, TrialRecord
from ee_dist.robots.model import Robot
from ee_dist.trials.log import Array, SensorLog

SAME_RATE = 1e-3
"""A record whose even step is within this share of the wanted one is taken sample by sample."""
LEAST_SHARED = 0.5
"""Share of the main table's time that its other tables must cover."""


def import_file(path: str | Path, mapping: Mapping, robot: Robot, index: int = 0) -> tuple[TrialRecord, Report]:
    """One trial from one file. Raises MeasurementError: see ``import_files``, and where the file holds several."""
    found = import_files([Path(path)], mapping, robot)
    if len(found) != 1:
        raise MeasurementError(f"{path}: holds {len(found)} trials; expected one")
    record, report = found[0]
    return replace(record, index=index), report


def import_files(files: Sequence[Path], mapping: Mapping, robot: Robot) -> list[tuple[TrialRecord, Report]]:
    """Every trial of the files. Raises MeasurementError: see ``readers``, ``trials``, ``clocks`` and ``check_names``."""
    check_names(mapping, robot)
    return [_Import(r, mapping, robot, i).run() for i, r in enumerate(trials_of(files, mapping))]


class _Import:
    def __init__(self, recorded: Recorded, mapping: Mapping, robot: Robot, index: int) -> None:
        self.recorded, self.mapping, self.robot, self.index = recorded, mapping, robot, index
        self.where = str(mapping.source)
        self.header = {k: v for t in reversed(recorded.tables) for k, v in t.header.items()}
        self.report = Report(str(recorded.tables[0].path), self._name())
        for table in recorded.tables:
            self.report.done += list(table.notes)

    def run(self) -> tuple[TrialRecord, Report]:
        self._time()
        positions = self._sensors()
        torques = self._motor_columns(self.mapping.torques, torque_units(self.robot), "torque")
        commands = self._commands(torques)
        supply = None
        if self.mapping.supply is not None:
            supply = self._column(self.mapping.supply, "V", "supply", step_like=True)
        self._released(commands)
        self._look(commands)
        joints = None
        if all(m in positions for m in self.robot.motor_names):
            joints = np.stack([positions[m] for m in self.robot.motor_names], axis=1)
        log = SensorLog(
            times_s=self.at_s,
            sensors=np.stack([self.channels[n] for n in self.robot.sensor_names], axis=1),
            commands=commands,
            sensor_names=self.robot.sensor_names,
            sensor_units=tuple(s.unit for s in self.robot.sensors),
            motor_names=self.robot.motor_names,
            joints=joints,
            torques=torques,
            supply_v=supply,
        )
        record = TrialRecord(self.index, self.report.trial, HARDWARE, Commands(commands.copy()), log, self._settings())
        return record, self.report

    def _name(self) -> str:
        if self.mapping.trial is None:
            return self.recorded.name
        try:
            return str(self.mapping.trial).format(**self.header)
        except (KeyError, IndexError, ValueError, AttributeError):
            keys = ", ".join(self.header) or "none"
            raise MeasurementError(
                f"{self.where}: trial: {self.mapping.trial!r} names an entry that the header of {self.report.file} "
                f"does not have; there are: {keys}"
            ) from None

    # -- time --------------------------------------------------------------------------------------------------------

    def _time(self) -> None:
        """Fills ``main`` (the table of the first sensor), ``clocks`` by table, the grid ``at_s`` and ``step_s``."""
        report, named = self.report, [c.table for _, _, c in self.mapping.columns()]
        first = next((c.table for g, _, c in self.mapping.columns() if g == "sensors"), "")
        time = self._time_column(first)
        self.main = clocked(self._table(first), time, self.where)
        self.clocks = {first: self.main}
        for name in dict.fromkeys(named):
            if name != first:
                self.clocks[name] = loosely_clocked(self._table(name), self._time_column(name), self.where)
        self._align(first)
        step = self.robot.time_step_s if self.mapping.rate_hz is None else 1.0 / self.mapping.rate_hz
        unit = time.unit if isinstance(time, Column) else "s"
        check_grid(self.main, step, self.mapping.rate_hz is not None, unit)
        self._overlap(first)
        times_s, timing = self.main.times_s, self.main.timing
        length = float(times_s[-1] - times_s[0])
        self.step_s = step
        self.as_is = timing.even and abs(timing.median_s / step - 1) < SAME_RATE
        self.at_s = np.arange(len(times_s)) * step if self.as_is else grid(times_s, step)
        report.rows_read, report.rows, report.seconds = len(times_s), len(self.at_s), length
        report.rate_read_hz, report.rate_hz = 1 / timing.median_s, 1 / step
        report.even, report.resampled, report.gaps = timing.even, not self.as_is, list(timing.gaps)
        if not self.as_is:
            how = (
                "even" if timing.even else f"uneven ({1e3 * timing.shortest_s:.3g} to {1e3 * timing.longest_s:.3g} ms)"
            )
            report.done.append(
                f"{how} sampling every {1e3 * timing.median_s:.4g} ms brought to {1e3 * step:.4g} ms: "
                "states by straight lines, commands held"
            )
        note = time_suspicion(timing.median_s, length, unit)
        if note:
            report.suspicious.append(note)
        for row, seconds in timing.gaps[:5]:
            report.suspicious.append(f"time: a gap of {seconds:.4g} s before row {row}")

    def _table(self, name: str) -> Table:
        return self.recorded.table(name, self.where)

    def _time_column(self, name: str) -> Column | Even | None:
        own = self.mapping.tables.get(name)
        if own is not None and own.time is not None:
            return own.time
        return self.mapping.time if self._table(name).clock is None else None

    def _align(self, first: str) -> None:
        """Brings the clocks of all tables to that of the first: as the format or the mapping states it, or as signals fit."""
        stated = {n: self.mapping.tables[n].offset_s if n in self.mapping.tables else None for n in self.clocks}
        for name, found in self.clocks.items():
            offset = stated[name]
            if offset is not None:
                found.times_s = found.times_s + offset
                self.report.done.append(f"{name}: {offset:g} s added to its clock, as the mapping says")
        for name, found in self.clocks.items():
            if name == first or stated[name] is not None:
                continue
            if found.table.clock is not None and self.main.table.clock is not None:
                continue
            if one_epoch(self.main.times_s, found.times_s):
                self.report.done.append(
                    f"{name}: its clock and that of {first} count from one epoch: taken as the same"
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
                    f"{self.where}: tables: {name}: its clock is not that of {first or self.main.table.path.name}, and the "
                    f"signals do not tell the offset ({why}); say 'offset_s: SECONDS' to add to it (0 if it is one clock)"
                )
            found.times_s = found.times_s + fit.offset_s
            self.report.done.append(
                f"{name}: {fit.offset_s:.4f} s added to its clock, where its signals fit best those of "
                f"{first} (correlation {fit.correlation:.3f}); a lag of the drives is part of it: state offset_s if you know it"
            )

    def _fit(self, name: str) -> Match | None:
        """The offset of a table by its commands against positions (or speeds), or its speeds against theirs."""
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
            base = of_joint.get(("position", joint))
            if base is None or kind not in ("position", "velocity", "speed") or base.table == name:
                continue
            own = base.sign * base.scale * here.table.numbers(base.column)
            if kind != "position":
                own = np.gradient(own, here.times_s)
            pairs.append((own, c.sign * c.scale * there.table.numbers(c.column)))
            held_between = held_between or group == "commands"
        if not pairs or len(there.times_s) < 3:
            return None
        a, b = (np.stack([p[k] for p in pairs], axis=1) for k in (0, 1))
        return match(here.times_s, a, there.times_s, b, held_between)

    def _overlap(self, first: str) -> None:
        """Cuts the main table to the time that the others cover; what is held needs no end."""
        start, end = self.main.times_s[0], self.main.times_s[-1]
        for name, found in self.clocks.items():
            if name == first:
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
            self.report.done.append(f"{len(times_s) - len(inside)} rows left out that not all tables cover")
            rows = slice(int(inside[0]), int(inside[-1]) + 1)
            self.main = Clocked(self.main.table.part(rows), times_s[rows], self.main.timing)
            self.clocks[first] = self.main

    # -- columns -----------------------------------------------------------------------------------------------------

    def _column(self, column: Column, unit: str, name: str, step_like: bool, quiet: bool = False) -> Array:
        """The column on the grid, in ``unit``; ``step_like`` values are held, others joined by lines."""
        own = self.clocks[column.table]
        raw = own.table.numbers(column.column, gaps=column.gaps == "interpolate")
        if not quiet and not column.signed_bits:
            self.report.suspicious += suspicions(f"{name} ({column.column})", raw[np.isfinite(raw)])
        size = factor(column.unit, unit, f"{self.where}: {name}")
        if np.isnan(raw).any():
            good = np.flatnonzero(np.isfinite(raw))
            if len(good) < 2:
                raise MeasurementError(f"{own.table}: column {column.column!r}: nearly all cells are empty")
            self.report.done.append(f"{name}: {len(raw) - len(good)} empty cells filled by straight lines")
            raw = np.interp(np.arange(len(raw)), good, raw[good])
        if column.signed_bits:
            half, whole = 2.0 ** (column.signed_bits - 1), 2.0**column.signed_bits
            wrapped = int(np.sum(raw >= half))
            raw = np.where(raw >= half, raw - whole, raw)
            self.report.done.append(
                f"{name}: {wrapped} rows of an unsigned {column.signed_bits}-bit counter read as negative"
            )
        values = (column.sign * column.scale * raw + column.offset) * size
        if not np.isfinite(values).all():
            raise MeasurementError(f"{own.table}: column {column.column!r}: too large a number to be {name}")
        if column.unwrap:
            values = np.unwrap(values)
        if not self._same_rows(own):
            # The grid begins where the main table does.
            at_s = self.at_s + (self.main.times_s[0] - own.times_s[0])
            if step_like:
                values = held(at_s, own.times_s, values, column.lead_s)
            else:
                values = linear(at_s, own.times_s, values)
        if column.smooth_s > 0:
            values = smoothed(values, self.step_s, column.smooth_s)
            self.report.done.append(f"{name}: mean over {column.smooth_s:g} s")
        self.report.ranges[name] = (float(values.min()), float(values.max()), unit)
        return values

    def _same_rows(self, own: Clocked) -> bool:
        """Whether the table's rows are those of the grid, so that nothing is resampled."""
        if own is self.main or not self.as_is:
            return self.as_is
        same = len(own.times_s) == len(self.main.times_s)
        return same and float(np.abs(own.times_s - self.main.times_s).max()) < SAME_RATE * self.step_s

    def _sensors(self) -> dict[str, Array]:
        """Fills ``channels``; returns positions by joint."""
        self.channels: dict[str, Array] = {}
        sensors = {s.name: s for s in self.robot.sensors}
        positions: dict[str, Array] = {}
        for name, column in self.mapping.sensors.items():
            if isinstance(column, Column):
                self.channels[name] = self._column(column, sensors[name].unit, name, sensors[name].kind == "touch")
                if sensors[name].kind == "position":
                    positions[sensors[name].target] = self.channels[name]
        for name, column in self.mapping.sensors.items():
            if isinstance(column, Estimated):
                if column.speed_of not in self.channels:
                    raise MeasurementError(
                        f"{self.where}: sensors: {name}: speed_of: no channel {column.speed_of!r}; "
                        f"{nearest(column.speed_of, self.channels)}"
                    )
                low_pass = LowPass(column.cutoff_hz, column.order)
                self.channels[name] = low_pass.speed(self.channels[column.speed_of], self.step_s)
                values = self.channels[name]
                self.report.ranges[name] = (float(values.min()), float(values.max()), sensors[name].unit)
                self.report.done.append(
                    f"{name}: estimated from {column.speed_of}: central differences behind a {low_pass}"
                )
        return positions

    def _commands(self, torques: Array | None) -> Array:
        """What the drives were told, (T, M). Without any: the torques where the drives obey torques, else NaN."""
        found = self._motor_columns(self.mapping.commands, command_units(self.robot), "command")
        if found is not None:
            return found
        assert torques is not None
        if all(command_kind(d) == "torque" for d in self.robot.drives):
            self.report.done.append(
                "no commands: the drives obey torques, so the measured ones are taken as what was asked"
            )
            return torques.copy()
        self.report.done.append("no commands were recorded: only a balance of forces can compare this log")
        return np.full(torques.shape, math.nan)

    def _motor_columns(self, columns: Any, units: dict[str, str], what: str) -> Array | None:
        if not columns:
            return None
        return np.stack(
            [self._column(columns[m], units[m], f"{what} of {m}", True) for m in self.robot.motor_names], axis=1
        )

    def _released(self, commands: Array) -> None:
        """A drive that is switched off obeys no command: its command is NaN."""
        if self.mapping.enabled is None:
            return
        on = self._column(self.mapping.enabled, "1", "enabled", True, quiet=True) > 0.5
        if not on.any():
            raise MeasurementError(
                f"{self.where}: enabled: {self.mapping.enabled.column!r} is 0 in every row: the drives never obeyed"
            )
        if not on.all():
            commands[~on] = math.nan
            self.report.done.append(f"drives released in {int((~on).sum())} rows ({self.mapping.enabled.column})")

    def _look(self, commands: Array) -> None:
        """Raises MeasurementError for a channel that can only be in another unit; the rest goes into the report."""
        position_of = {s.target: self.channels[s.name] for s in self.robot.sensors if s.kind == "position"}
        for s in self.robot.sensors:
            column = self.mapping.sensors[s.name]
            if s.kind == "position":
                joint = self.robot.joint(s.target)
                unit = column.unit if isinstance(column, Column) and column.scale == 1 else s.unit
                self._judge(
                    unit_suspicion(s.name, self.channels[s.name], joint.lower, joint.upper, s.unit, unit), column
                )
            elif s.kind == "velocity" and s.target in position_of:
                self._judge(speed_suspicion(s.name, self.channels[s.name], position_of[s.target], self.step_s), column)
        for k, drive in enumerate(self.robot.drives):
            obeyed = np.isfinite(commands[:, k])
            if drive.joint in position_of and obeyed.sum() > 10 and command_kind(drive) == "position":
                note = command_suspicion(drive.joint, commands[obeyed, k], position_of[drive.joint][obeyed])
                if note:
                    self.report.suspicious.append(note)

    def _judge(self, found: tuple[str, bool] | None, column: Column | Estimated) -> None:
        if found is None:
            return
        note, certain = found
        if certain and not (isinstance(column, Column) and column.sure):
            raise MeasurementError(f"{self.where}: {note}; if it is right as it stands, add 'sure: true' to it")
        self.report.suspicious.append(note)

    def _settings(self) -> Hypothesis:
        found = []
        for s in self.mapping.settings:
            values = {}
            for key, value in s.values.items():
                if isinstance(value, tuple):
                    name, scale = value
                    entry = self.header.get(name)
                    if isinstance(entry, bool) or not isinstance(entry, (int, float)) or not math.isfinite(entry):
                        raise MeasurementError(
                            f"{self.report.file}: header entry {name!r} for {s.effect} is {entry!r}; expected a number"
                        )
                    value = float(entry) * scale
                values[key] = value
            found.append(term(s.effect, s.target, **values))
        return tuple(found)
