"""A recording and a mapping make sensor logs, and a report of what was done to the numbers on the way."""

from __future__ import annotations

import fnmatch
import math
from collections.abc import Mapping as AnyMapping
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ee_dist.basics.names import listed
from ee_dist.basics.quoted import quoted
from ee_dist.effects.catalogue import Hypothesis, term
from ee_dist.engines.drivers import Commands
from ee_dist.measurements.clocks import Clocked, check_grid
from ee_dist.measurements.errors import MeasurementError, nearest
from ee_dist.measurements.held_readings import written_late
from ee_dist.measurements.looking import Looked, repeats
from ee_dist.measurements.mapping import Column, Estimated, Given, Mapping
from ee_dist.measurements.reading import between_readings, paces_of, rows_read, told_of
from ee_dist.measurements.report import COMMAND, TORQUE, Report, in_one_line
from ee_dist.measurements.robot_channels import check_names, command_kind, command_kinds, command_units, torque_units
from ee_dist.measurements.sampling import LowPass, carried, grid, held, linear, smoothed
from ee_dist.measurements.signals import lag
from ee_dist.measurements.suspicious import suspicions, time_suspicion
from ee_dist.measurements.table import LARGEST, Recorded
from ee_dist.measurements.trial_clocks import TrialClocks
from ee_dist.measurements.trials import trials_of
from ee_dist.measurements.units import TURN, UNITS, factor
from ee_dist.recording.records import HARDWARE, TrialRecord
from ee_dist.robots.model import Robot
from ee_dist.trials.log import Array, SensorLog

WHY_LINES = "joints are ahead of what is held from row to row, as none can be ('commands_between: held' if they were): "
HELD = ", commands held"
"""How the report says that."""
AT_ONCE = 0.3
"""Of a row of commands: joints that are not even so much later than a line through them are not led by what is held from one row
to the next, which is half a row later."""
SAME_RATE = 1e-3
"""A record whose even step is within this share of the wanted one is taken sample by sample."""
DENSER = 1.1
"""Rows to a step from which commands reach the model later than they did the robot by what counts."""


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
    begun = [_Import(r, mapping, robot, i) for i, r in enumerate(trials_of(files, mapping))]
    # One logger reads its sensors at one pace; of a trial in which hardly anything moves only others tell it.
    paces: dict[str, float] = {}
    for each in begun:
        each.clocked()
        paces |= {k: v for k, v in paces_of(each.clocks, each.read_at).items() if k not in paces}
    found = [each.run(paces) for each in begun]
    if any(each.goes_on for each in begun):
        # One controller leads all trials: of a slow one only others tell how it goes from point to point.
        for i, each in enumerate(begun):
            if not each.goes_on:
                again = _Import(each.recorded, mapping, robot, i)
                again.clocked()
                again.goes_on = True
                found[i] = again.run(paces)
    names = [report.trial for _, report in found]
    for i, setting in enumerate(mapping.settings):
        for wanted in setting.trials:
            if not fnmatch.filter(names, wanted):
                raise MeasurementError(
                    f"{mapping.source}: settings[{i}]: trials: no trial is named {quoted(wanted)}; {nearest(wanted, names)}"
                )
    return found


class _Import:
    def __init__(self, recorded: Recorded, mapping: Mapping, robot: Robot, index: int) -> None:
        self.recorded, self.mapping, self.robot, self.index = recorded, mapping, robot, index
        self.where, self.goes_on = str(mapping.source), mapping.commands_between == "lines"
        self.header = {k: v for t in reversed(recorded.tables) for k, v in t.header.items()}
        self.report = Report(str(recorded.tables[0].path), self._name())
        for table in recorded.tables:
            self.report.done += list(table.notes)

    def clocked(self) -> None:
        """When rows were, and in which of them sensors were read. Raises MeasurementError."""
        self._time()
        self.read_at = rows_read(self.mapping, self.clocks)

    def run(self, paces: AnyMapping[str, float]) -> tuple[TrialRecord, Report]:
        """``paces``: seconds between readings by table, of the trials in which that shows. Raises MeasurementError."""
        if paces.keys() - paces_of(self.clocks, self.read_at).keys():
            self.read_at = rows_read(self.mapping, self.clocks, paces)
        self.report.done += told_of(self.clocks, self.read_at)
        positions = self._sensors()
        self.report.suspicious += repeats(self.mapping, self.clocks, paces_of(self.clocks, self.read_at))
        torques = self._torques()
        commands = self._commands_given(torques, positions)
        if self.goes_on:
            self.report.done = [line.replace(HELD, "") for line in self.report.done]
            self.report.done.append(
                f"commands: {WHY_LINES}they are taken as points between which the controller went on, by straight lines"
                if self.mapping.commands_between is None
                else "commands: by straight lines from one row to the next, as the mapping says"
            )
        self.report.suspicious = in_one_line(self.report.suspicious)
        self._on_one_turn(commands)
        supply = None
        if self.mapping.supply is not None:
            supply = self._column(self.mapping.supply, "V", "supply", step_like=True)
        external = self._external()
        self._released(commands)
        joints = None
        if all(m in positions for m in self.robot.motor_names):
            joints = np.stack([positions[m] for m in self.robot.motor_names], axis=1)
        looked = Looked(
            self.robot, self.mapping, self.channels, commands, torques, joints, self.step_s, self.report.rate_read_hz,
            max(paces_of(self.clocks, self.read_at).values(), default=0.0),
        )  # fmt: skip
        self.report.suspicious += looked.found()
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
            external=external,
            filled=self._filled(),
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
                f"{self.where}: trial: {quoted(self.mapping.trial)} names an entry that the header of {self.report.file} "
                f"does not have; there are: {keys}"
            ) from None

    # -- time --------------------------------------------------------------------------------------------------------

    def _time(self) -> None:
        """Fills ``main`` (the table of the first sensor), ``clocks`` by table, the grid ``at_s`` and ``step_s``."""
        report = self.report
        step = self.robot.time_step_s if self.mapping.rate_hz is None else 1.0 / self.mapping.rate_hz
        found = TrialClocks(self.recorded, self.mapping, self.robot, report.done)
        unit = found.unit
        check_grid(found.main, step, self.mapping.rate_hz is not None, unit)
        found.cut()
        self.main, self.clocks = found.main, found.clocks
        times_s, timing = self.main.times_s, self.main.timing
        length = float(times_s[-1] - times_s[0])
        self.step_s = step
        # The median alone misses a clock whose steps are mostly right and now and then longer.
        steps_s = (timing.median_s, length / (len(times_s) - 1))
        self.as_is = timing.even and all(abs(s / step - 1) < SAME_RATE for s in steps_s)
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
                f"states by straight lines{HELD}"
                + (_late(timing.median_s, step) if step > DENSER * timing.median_s else "")
            )
        note = time_suspicion(timing.median_s, length, unit)
        if note:
            report.suspicious.append(note)
        for row, seconds in timing.gaps[:5]:
            report.suspicious.append(f"time: a gap of {seconds:.4g} s before row {row}")

    def _filled(self) -> Array | None:
        """Rows between readings."""
        rows_s = self._rows_s() if self.as_is else None
        return between_readings(self.at_s, rows_s, self.main, self.clocks, self.read_at, self.report.done)

    def _rows_s(self) -> Array:
        """When the rows of the log were, (T,) s since the main table began. Rows that are taken sample by sample count as evenly
        apart, but a step that is off by SAME_RATE adds up over a long record: other tables are read at the true times."""
        return self.main.times_s - self.main.times_s[0] if self.as_is else self.at_s

    # -- columns -----------------------------------------------------------------------------------------------------

    def _column(
        self, column: Column, unit: str, name: str, step_like: bool, quiet: bool = False, reading: bool = False
    ) -> Array:
        """The column on the grid, in ``unit``; ``step_like`` values are held, others, and any ``reading``, joined by lines."""
        own = self.clocks[column.table]
        raw = own.table.numbers(column.column, gaps=column.gaps == "interpolate")
        size = factor(column.unit, unit, f"{self.where}: {name}")
        good = np.flatnonzero(np.isfinite(raw))
        # A goal that was sent once holds from then on.
        if len(good) < min(len(raw), 1 if step_like else 2):
            spared = f": leave out the {name}, which may stay unknown" if name.startswith(TORQUE) else ""
            raise MeasurementError(f"{own.table}: column {quoted(column.column)}: nearly all cells are empty{spared}")
        if not quiet and not column.signed_bits:
            self.report.suspicious += suspicions(f"{name} ({column.column})", raw[good], _turn(column))
        if len(good) < len(raw):
            how = "in which the last value holds" if step_like else "filled by straight lines"
            self.report.done.append(f"{name}: {len(raw) - len(good)} empty cells {how}")
            raw = carried(raw) if step_like else np.interp(np.arange(len(raw)), good, raw[good])
        if column.signed_bits:
            half, whole = 2.0 ** (column.signed_bits - 1), 2.0**column.signed_bits
            wrapped = int(np.sum(raw >= half))
            raw = np.where(raw >= half, raw - whole, raw)
            self.report.done.append(
                f"{name}: {wrapped} rows of an unsigned {column.signed_bits}-bit counter read as negative"
            )
        values = (column.sign * column.scale * raw + column.offset) * size
        if not np.isfinite(values).all():
            raise MeasurementError(f"{own.table}: column {quoted(column.column)}: too large a number to be {name}")
        if column.unwrap:
            values = np.unwrap(values)
        rows = self.read_at.get(column.table)
        if (reading or name.startswith(TORQUE)) and rows is not None and len(rows) < len(values):
            late = written_late(raw, rows)
            # Torques are readings too where they keep to their pace; what was told to drives does not.
            if reading or late is not None:
                # Between readings a state goes on: it does not stand still and jump.
                read = values[np.minimum(rows + (late or 0), len(values) - 1)]
                values = linear(own.times_s - own.times_s[0], own.times_s[rows], read)
        if not self._same_rows(own):
            # The grid begins where the main table does.
            at_s = self._rows_s() + (self.main.times_s[0] - own.times_s[0])
            if step_like and (own.table.planned or (self.goes_on and name.startswith(COMMAND))):
                values = linear(at_s + column.lead_s, own.times_s, values)
            elif step_like:
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
                touch = sensors[name].kind == "touch"
                self.channels[name] = self._column(column, sensors[name].unit, name, touch, reading=not touch)
                if sensors[name].kind == "position":
                    positions[sensors[name].target] = self.channels[name]
        for name, column in self.mapping.sensors.items():
            if isinstance(column, Estimated):
                if column.speed_of not in self.channels:
                    raise MeasurementError(
                        f"{self.where}: sensors: {name}: speed_of: no channel {quoted(column.speed_of)}; "
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
        """What the drives were told, (T, M). Without any: the torques where the drives obey torques, else NaN; of joints that
        all swing freely, nothing."""
        units = command_units(self.robot)
        if self.mapping.commands:
            nothing = np.zeros(len(self.at_s))  # what a passive joint is told
            return self._by_motor(self.mapping.commands, units, "command of", True, nothing)
        if not units:
            return np.zeros((len(self.at_s), len(self.robot.drives)))
        assert torques is not None
        if command_kinds(self.robot) == {"torque"} and np.isfinite(torques).all():
            self.report.done.append(
                "no commands: the drives obey torques, so the measured ones are taken as what was asked"
            )
            return torques.copy()
        self.report.done.append("no commands were recorded: only a balance of forces can compare this log")
        return np.full(torques.shape, math.nan)

    def _commands_given(self, torques: Array | None, positions: AnyMapping[str, Array]) -> Array:
        """Commands (T, M), held from one row to the next; or, where joints are ahead of them so, on lines between the rows: what
        was logged are points on the way of a controller, as clients of industrial arms have them."""
        asked = {
            d.joint: self.mapping.commands.get(d.joint) for d in self.robot.drives if command_kind(d) == "position"
        }
        led = {j: c.table for j, c in asked.items() if isinstance(c, Column) and j in positions}
        if self.mapping.commands_between is None and not self.goes_on and not self.as_is and len({*led.values()}) == 1:
            before = list(self.report.done), list(self.report.suspicious)
            self.goes_on = True
            lines = self._commands(torques)
            asked_of = lines[:, [self.robot.motor_names.index(j) for j in led]]
            row_s = self.clocks[next(iter(led.values()))].timing.median_s
            late = lag(asked_of, np.stack([positions[j] for j in led], axis=1), self.step_s)
            if late is not None and -row_s < late < AT_ONCE * row_s:
                return lines
            self.goes_on, (self.report.done, self.report.suspicious) = False, before
        return self._commands(torques)

    def _on_one_turn(self, commands: Array) -> None:
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
            turns = round(float(np.median(commands[:, k] - self.channels[name])) / TURN)
            if turns:
                commands[:, k] -= turns * TURN
                low, high = float(commands[:, k].min()), float(commands[:, k].max())
                self.report.ranges[f"command of {drive.joint}"] = (low, high, "rad")
                self.report.done.append(f"command of {drive.joint}: brought {-turns:+d} turns nearer to the positions")

    def _torques(self) -> Array | None:
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
        unknown = np.full(len(self.at_s), math.nan)
        return self._by_motor(columns, torque_units(self.robot), TORQUE, True, unknown)

    def _by_motor(self, columns: Any, units: dict[str, str], what: str, step_like: bool, without: Array) -> Array:
        """(T, M): the columns of the drives that have one, ``without`` (T,) at the others."""
        return np.stack(
            [
                self._column(columns[m], units[m], f"{what} {m}", step_like) if m in columns and m in units else without
                for m in self.robot.motor_names
            ],
            axis=1,
        )

    def _external(self) -> Array | None:
        """Known torques on the joints that are not the drives', (T, M); none where the mapping names no column."""
        columns = self.mapping.external
        if not columns:
            return None
        rest = np.zeros(len(self.at_s))
        return self._by_motor(columns, torque_units(self.robot), "external torque on", False, rest)

    def _released(self, commands: Array) -> None:
        """A drive that is switched off obeys no command: its command is NaN."""
        if self.mapping.enabled is None:
            return
        on = self._column(self.mapping.enabled, "1", "enabled", True, quiet=True) > 0.5
        if not on.any():
            raise MeasurementError(
                f"{self.where}: enabled: {quoted(self.mapping.enabled.column)} is 0 in every row: the drives never obeyed"
            )
        if not on.all():
            commands[~on] = math.nan
            self.report.done.append(f"drives released in {int((~on).sum())} rows ({self.mapping.enabled.column})")

    def _settings(self) -> Hypothesis:
        found = []
        for s in self.mapping.settings:
            if s.trials and not any(fnmatch.fnmatchcase(self.report.trial, wanted) for wanted in s.trials):
                continue
            values = {k: self._given(v, s.effect) if isinstance(v, Given) else v for k, v in s.values.items()}
            found.append(term(s.effect, s.target, **values))
        return tuple(found)

    def _given(self, value: Given, effect: str) -> float:
        """A number of the file's header, or of a column that is one number all through the trial. Raises MeasurementError."""
        entry: Any = self.header.get(value.name)
        if value.place == "column":
            seen = self.main.table.numbers(value.name)
            if (seen != seen[0]).any():
                raise MeasurementError(
                    f"{self.report.file}: column {quoted(value.name)} for {effect} changes within the trial ({seen.min():g} to "
                    f"{seen.max():g}); if these are trials of their own, add 'split: {{column: {value.name}}}'"
                )
            entry = float(seen[0])
        if isinstance(entry, bool) or not isinstance(entry, (int, float)) or not abs(entry) <= LARGEST:
            raise MeasurementError(
                f"{self.report.file}: {value.place} entry {quoted(value.name)} for {effect} is {quoted(entry)}; "
                "expected a number"
            )
        return float(entry) * value.scale


def _turn(column: Column) -> float:
    """A whole turn in the numbers of a column: 360 of one in degrees; endless where it holds no angle, or was unwrapped."""
    kind, size = UNITS.get(column.unit, ("", 1.0))
    if kind != "angle" or column.unwrap or column.scale == 0:
        return math.inf
    return TURN / size / abs(column.scale)


def _late(every_s: float, step_s: float) -> str:
    """What comes of commands that change between the model's steps."""
    return (
        f" and up to {1e3 * step_s:.3g} ms late, by which delays that are found may be off; with time_step_s: {every_s:.4g} in "
        "the robot's description it steps as often as the log"
    )
