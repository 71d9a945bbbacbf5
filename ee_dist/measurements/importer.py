"""A file and a mapping make a sensor log, and a report of what was done to the numbers on the way."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ee_dist.effects.catalogue import Hypothesis, term
from ee_dist.engines.drivers import Commands
from ee_dist.measurements.errors import MeasurementError, nearest
from ee_dist.measurements.mapping import Column, Estimated, Mapping
from ee_dist.measurements.sampling import LowPass, Timing, check_times, grid, held, linear, smoothed
from ee_dist.measurements.suspicious import (
    command_suspicion,
    speed_suspicion,
    suspicions,
    time_suspicion,
    unit_suspicion,
)
from ee_dist.measurements.tables import Table, read_table
from ee_dist.measurements.units import factor
from ee_dist.recording.records import HARDWARE, TrialRecord
from ee_dist.robots.model import Robot
from ee_dist.trials.log import Array, SensorLog

POSITION_UNIT = {"hinge": "rad", "slide": "m"}
TORQUE_UNIT = {"hinge": "N.m", "slide": "N"}
SAME_RATE = 1e-3
"""A record whose even step is within this share of the wanted one is taken sample by sample."""


@dataclass
class Report:
    """What the import of one file did and saw. Rates in Hz, gaps as (row, seconds), ranges as (lowest, highest)."""

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

    def as_dict(self) -> dict[str, Any]:
        return asdict(self)


def import_file(path: str | Path, mapping: Mapping, robot: Robot, index: int = 0) -> tuple[TrialRecord, Report]:
    """One trial from one file. Raises MeasurementError: see ``tables``, ``sampling`` and ``check_names``."""
    check_names(mapping, robot)
    table = read_table(path, mapping.kind, mapping.records, mapping.separator)
    return _Import(table, mapping, robot, index).run()


def check_names(mapping: Mapping, robot: Robot) -> None:
    """Raises MeasurementError where the mapping names sensors or joints that the robot does not have, or leaves some out."""
    where, motors = str(mapping.source), robot.motor_names
    named = {*mapping.sensors, *mapping.commands}
    if named and not named & {*robot.sensor_names, *motors}:
        raise MeasurementError(
            f"{where}: is for another robot: none of its names ({', '.join(sorted(named))}) is one of {robot.name}'s: "
            f"{', '.join((*robot.sensor_names, *motors))}"
        )
    for group, names, allowed in (
        ("sensors", mapping.sensors, robot.sensor_names),
        ("commands", mapping.commands, motors),
        ("torques", mapping.torques, motors),
    ):
        for name in names:
            if name not in allowed:
                raise MeasurementError(f"{where}: {group}: {robot.name} has no {name!r}; {nearest(name, allowed)}")
    missing = [m for m in motors if m not in mapping.commands]
    if missing:
        raise MeasurementError(f"{where}: commands: no column for joint {missing[0]!r} of {robot.name}")
    absent = [s for s in robot.sensor_names if s not in mapping.sensors]
    if absent:
        raise MeasurementError(
            f"{where}: sensors: no column for {absent[0]!r} of {robot.name}; add one, or for a speed 'speed_of: <position>', "
            "or take the sensor out of the robot's description"
        )


class _Import:
    def __init__(self, table: Table, mapping: Mapping, robot: Robot, index: int) -> None:
        self.table, self.mapping, self.robot, self.index = table, mapping, robot, index
        self.report = Report(str(table.path), self._name())

    def run(self) -> tuple[TrialRecord, Report]:
        timing = self._time()
        positions = self._sensors()
        commands = self._motor_columns(self.mapping.commands, POSITION_UNIT, "command")
        assert commands is not None
        torques = self._motor_columns(self.mapping.torques, TORQUE_UNIT, "torque")
        supply = None
        if self.mapping.supply is not None:
            supply = self._column(self.mapping.supply, "V", "supply", step_like=True)
        self._released(commands)
        self._look(timing, commands)
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
            return self.table.path.stem
        try:
            return str(self.mapping.trial).format(**self.table.header)
        except (KeyError, IndexError, ValueError):
            keys = ", ".join(self.table.header) or "none"
            raise MeasurementError(
                f"{self.mapping.source}: trial: {self.mapping.trial!r} names an entry that the header of {self.table.path} "
                f"does not have; there are: {keys}"
            ) from None

    # -- time --------------------------------------------------------------------------------------------------------

    def _time(self) -> Timing:
        column, table, report = self.mapping.time, self.table, self.report
        raw = table.numbers(column.column)
        self.times_s = raw * factor(column.unit, "s", f"{self.mapping.source}: time") * column.scale
        timing = check_times(self.times_s, table.path, column.column, table.first_row)
        step = self.robot.time_step_s if self.mapping.rate_hz is None else 1.0 / self.mapping.rate_hz
        length = float(self.times_s[-1] - self.times_s[0])
        if length < step:
            raise MeasurementError(
                f"{table.path}: {length:g} s long, less than a step of {step:g} s; are the times in another unit?"
            )
        self.step_s = step
        self.as_is = timing.even and abs(timing.median_s / step - 1) < SAME_RATE
        self.at_s = np.arange(len(raw)) * step if self.as_is else grid(self.times_s, step)
        report.rows_read, report.rows, report.seconds = len(raw), len(self.at_s), length
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
        note = time_suspicion(timing.median_s, length, column.unit)
        if note:
            report.suspicious.append(note)
        for row, seconds in timing.gaps[:5]:
            report.suspicious.append(f"time: a gap of {seconds:.4g} s before row {row}")
        return timing

    # -- columns -----------------------------------------------------------------------------------------------------

    def _column(self, column: Column, unit: str, name: str, step_like: bool, quiet: bool = False) -> Array:
        """The column on the grid, in ``unit``; ``step_like`` values are held, others joined by lines."""
        raw = self.table.numbers(column.column, gaps=column.gaps == "interpolate")
        if not quiet and not column.signed_bits:
            self.report.suspicious += suspicions(f"{name} ({column.column})", raw[np.isfinite(raw)])
        size = factor(column.unit, unit, f"{self.mapping.source}: {name}")
        if np.isnan(raw).any():
            good = np.flatnonzero(np.isfinite(raw))
            if len(good) < 2:
                raise MeasurementError(f"{self.table.path}: column {column.column!r}: nearly all cells are empty")
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
        if column.unwrap:
            values = np.unwrap(values)
        if not self.as_is:
            if step_like:
                values = held(self.at_s, self.times_s, values, column.lead_s)
            else:
                values = linear(self.at_s, self.times_s, values)
        if column.smooth_s > 0:
            values = smoothed(values, self.step_s, column.smooth_s)
            self.report.done.append(f"{name}: mean over {column.smooth_s:g} s")
        self.report.ranges[name] = (float(values.min()), float(values.max()), unit)
        return values

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
                        f"{self.mapping.source}: sensors: {name}: speed_of: no channel {column.speed_of!r}; "
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

    def _motor_columns(self, columns: Any, units: dict[str, str], what: str) -> Array | None:
        if not columns:
            return None
        missing = [m for m in self.robot.motor_names if m not in columns]
        if missing:
            raise MeasurementError(f"{self.mapping.source}: {what}s: no column for joint {missing[0]!r}")
        kinds = {j.name: j.kind for j in self.robot.joints}
        return np.stack(
            [self._column(columns[m], units[kinds[m]], f"{what} of {m}", True) for m in self.robot.motor_names], axis=1
        )

    def _released(self, commands: Array) -> None:
        """A drive that is switched off obeys no command: its command is NaN."""
        if self.mapping.enabled is None:
            return
        on = self._column(self.mapping.enabled, "1", "enabled", True, quiet=True) > 0.5
        if not on.all():
            commands[~on] = math.nan
            self.report.done.append(f"drives released in {int((~on).sum())} rows ({self.mapping.enabled.column})")

    def _look(self, timing: Timing, commands: Array) -> None:
        report = self.report
        position_of = {s.target: self.channels[s.name] for s in self.robot.sensors if s.kind == "position"}
        for s in self.robot.sensors:
            if s.kind == "position":
                joint = self.robot.joint(s.target)
                report.suspicious += _some(
                    [unit_suspicion(s.name, self.channels[s.name], joint.lower, joint.upper, s.unit)]
                )
            elif s.kind == "velocity" and s.target in position_of:
                note = speed_suspicion(s.name, self.channels[s.name], position_of[s.target], self.step_s)
                report.suspicious += _some([note])
        for k, motor in enumerate(self.robot.motor_names):
            obeyed = np.isfinite(commands[:, k])
            if motor in position_of and obeyed.sum() > 10:
                report.suspicious += _some([command_suspicion(motor, commands[obeyed, k], position_of[motor][obeyed])])

    def _settings(self) -> Hypothesis:
        found = []
        for s in self.mapping.settings:
            values = {}
            for key, value in s.values.items():
                if isinstance(value, tuple):
                    name, scale = value
                    entry = self.table.header.get(name)
                    if isinstance(entry, bool) or not isinstance(entry, (int, float)):
                        raise MeasurementError(
                            f"{self.table.path}: header entry {name!r} for {s.effect} is {entry!r}; expected a number"
                        )
                    value = float(entry) * scale
                values[key] = value
            found.append(term(s.effect, s.target, **values))
        return tuple(found)


def _some(notes: Iterable[str | None]) -> list[str]:
    return [n for n in notes if n]


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
        lines += [f"  {name}: {low:.5g} to {high:.5g} {unit}" for name, (low, high, unit) in r.ranges.items()]
        lines += [f"  done: {d}" for d in r.done]
        lines += [f"  suspicious: {s}" for s in r.suspicious]
    return "\n".join(lines)
