"""A recording and a mapping make sensor logs, and a report of what was done to the numbers on the way."""

from __future__ import annotations

import fnmatch
from collections.abc import Container, Sequence
from collections.abc import Mapping as AnyMapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ee_dist.basics.names import listed
from ee_dist.basics.quoted import quoted
from ee_dist.effects.catalogue import Hypothesis, term
from ee_dist.engines.drivers import Commands
from ee_dist.measurements.errors import MeasurementError, nearest
from ee_dist.measurements.led import Lag, Led, goes_on
from ee_dist.measurements.looking import Looked, repeats, units_shown
from ee_dist.measurements.mapping import Column, Estimated, Given, Mapping
from ee_dist.measurements.not_recorded import Stood, with_those_that_stood
from ee_dist.measurements.on_grid import OnGrid
from ee_dist.measurements.reading import holes_told, told_of
from ee_dist.measurements.report import COMMAND, ENDS, Report, in_one_line, without_ends, without_rest
from ee_dist.measurements.robot_channels import check_names, command_kind
from ee_dist.measurements.sampling import LowPass
from ee_dist.measurements.standing import dwells, told_to_rest
from ee_dist.measurements.table import LARGEST, Recorded
from ee_dist.measurements.trials import trials_of
from ee_dist.recording.records import HARDWARE, TrialRecord
from ee_dist.robots.model import Robot, Sensor
from ee_dist.trials.log import Array, SensorLog


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
    trials = with_those_that_stood(trials_of(files, mapping), mapping, robot)
    begun = [_Import(r, mapping, robot, i, stood) for i, (r, stood) in enumerate(trials)]
    # One logger reads its sensors at one pace; of a trial in which hardly anything moves only others tell it.
    paces: dict[str, float] = {}
    for each in begun:
        paces |= {k: v for k, v in each.on.paces().items() if k not in paces}
    several = len(begun) > 1
    shown = {unit for each in begun for unit in each.sensors(paces)}
    why = goes_on([each.lags() for each in begun])
    found = [each.run(shown, several, why) for each in begun]
    names = [report.trial for _, report in found]
    for i, setting in enumerate(mapping.settings):
        for wanted in setting.trials:
            if not fnmatch.filter(names, wanted):
                raise MeasurementError(
                    f"{mapping.source}: settings[{i}]: trials: no trial is named {quoted(wanted)}; {nearest(wanted, names)}"
                )
    return found


class _Import:
    def __init__(self, recorded: Recorded, mapping: Mapping, robot: Robot, index: int, stood: Stood) -> None:
        """``stood``: the joints that were not recorded. Raises MeasurementError."""
        self.recorded, self.mapping, self.robot, self.index, self.stood = recorded, mapping, robot, index, stood
        self.where = str(mapping.source)
        self.header = {k: v for t in reversed(recorded.tables) for k, v in t.header.items()}
        self.report = Report(str(recorded.tables[0].path), self._name())
        for table in recorded.tables:
            self.report.done += list(table.notes)
        self.report.done += [stood.line] * bool(stood.line)
        self.on = OnGrid(recorded, mapping, robot, self.report)
        self.led = Led(self.on, mapping, robot)

    def sensors(self, paces: AnyMapping[str, float]) -> set[str]:
        """Reads the sensors, and returns the units of positions that they show. ``paces``: seconds between readings by table, of
        the trials in which that shows. Raises MeasurementError."""
        self.on.at_paces(paces)
        self.report.done += told_of(self.on.clocks, self.on.read_at)
        self.report.suspicious += holes_told(self.on.empty, self.on.clocks)
        self.positions = self._sensors()
        return units_shown(self.robot, self.mapping, self.channels)

    def lags(self) -> list[Lag]:
        """How late joints are after their commands, once the sensors are read. Raises MeasurementError."""
        return self.led.lags(self.positions, self._speeds())

    def run(self, shown: Container[str], several: bool, why: str) -> tuple[TrialRecord, Report]:
        """The rest, once the sensors are read. ``shown``: the units of positions that some trial shows; ``several``: whether
        there are others, so that a refusal names this one; ``why`` commands go on by lines from row to row, if they do. Raises
        MeasurementError."""
        positions = self.positions
        self.report.suspicious += repeats(self.robot, self.mapping, self.on.clocks, self.on.paces())
        torques = self.led.torques()
        commands = self.led.commands(torques, why)
        self._tell_of_rest(commands, positions)
        self._clear_who_dwells(commands)
        self.report.suspicious = in_one_line(self.report.suspicious)
        self.led.on_one_turn(commands, self.channels)
        supply = None
        if self.mapping.supply is not None:
            supply = self.on.column(self.mapping.supply, "V", "supply", step_like=True)
        external = self.led.external()
        self.led.released(commands)
        joints = None
        if all(m in positions for m in self.robot.motor_names):
            joints = np.stack([positions[m] for m in self.robot.motor_names], axis=1)
        looked = Looked(
            self.robot, self.mapping, self.channels, commands, torques, joints, self.on.step_s, self.report.rate_read_hz,
            max(self.on.paces().values(), default=0.0), shown, self.report.trial if several else "",
        )  # fmt: skip
        self.report.suspicious += looked.found()
        log = SensorLog(
            times_s=self.on.at_s,
            sensors=np.stack([self.channels[n] for n in self.robot.sensor_names], axis=1),
            commands=commands,
            sensor_names=self.robot.sensor_names,
            sensor_units=tuple(s.unit for s in self.robot.sensors),
            motor_names=self.robot.motor_names,
            joints=joints,
            torques=torques,
            supply_v=supply,
            external=external,
            filled=self.on.filled(),
        )
        sent = Commands(commands.copy())
        absent = self.stood.sensors
        return TrialRecord(self.index, self.report.trial, HARDWARE, sent, log, self._settings(), absent), self.report

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

    def _sensors(self) -> dict[str, Array]:
        """Fills ``channels``; returns positions by joint."""
        self.channels: dict[str, Array] = {}
        sensors = {s.name: s for s in self.robot.sensors}
        positions: dict[str, Array] = {}
        for name, column in self.mapping.sensors.items():
            if isinstance(column, Column):
                touch = sensors[name].kind == "touch"
                self.channels[name] = self.on.column(column, sensors[name].unit, name, touch, reading=not touch)
                if sensors[name].kind == "position":
                    positions[sensors[name].target] = self.channels[name]
        alike: dict[LowPass, list[tuple[str, str]]] = {}
        for name, column in self.mapping.sensors.items():
            if isinstance(column, Estimated):
                if column.speed_of not in self.channels:
                    raise MeasurementError(
                        f"{self.where}: sensors: {name}: speed_of: no channel {quoted(column.speed_of)}; "
                        f"{nearest(column.speed_of, self.channels)}"
                    )
                low_pass = LowPass(column.cutoff_hz, column.order)
                self.channels[name] = low_pass.speed(self.channels[column.speed_of], self.on.step_s)
                values = self.channels[name]
                self.report.ranges[name] = (float(values.min()), float(values.max()), sensors[name].unit)
                alike.setdefault(low_pass, []).append((name, column.speed_of))
        self.report.done += [
            f"{_estimated(of, sensors)}, to be seen and not compared: central differences behind a {low_pass}"
            for low_pass, of in alike.items()
        ]
        return positions

    def _speeds(self) -> dict[str, Array]:
        """Speeds that were read, by joint: one that is estimated from positions says no more than these."""
        return {
            s.target: self.channels[s.name]
            for s in self.robot.sensors
            if s.kind == "velocity" and isinstance(self.mapping.sensors.get(s.name), Column)
        }

    def _tell_of_rest(self, commands: Array, positions: AnyMapping[str, Array]) -> None:
        """One line on all joints that nobody moved in this trial, in place of two suspicious ones on each."""
        rest = told_to_rest(self.robot, commands, positions)
        still = [s.name for s in self.robot.sensors if s.target in rest]
        self.report.suspicious = without_rest(self.report.suspicious, [*still, *(f"{COMMAND} {j}" for j in rest)])
        if read := [j for j in rest if j not in self.stood.joints]:
            self.report.done.append(f"not moved in this trial, as told: {listed(read)}")

    def _clear_who_dwells(self, commands: Array) -> None:
        """No position is told to be clipped that rests where its command goes no farther."""
        told = {d.joint: k for k, d in enumerate(self.robot.drives) if command_kind(d) == "position"}
        for s in self.robot.sensors:
            column = self.mapping.sensors.get(s.name)
            if s.kind != "position" or s.target not in told or not isinstance(column, Column):
                continue
            turned = column.sign * column.scale < 0  # the lines are on the numbers of the file
            for end, highest in zip(ENDS, (not turned, turned), strict=True):
                if dwells(commands[:, told[s.target]], self.channels[s.name], highest):
                    self.report.suspicious = without_ends(self.report.suspicious, s.name, end)

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
            seen = self.on.main.table.numbers(value.name)
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


def _estimated(of: Sequence[tuple[str, str]], sensors: AnyMapping[str, Sensor]) -> str:
    """Which speeds were estimated from which positions (the names of both channels), those of one filter in one line."""
    if len(of) == 1:
        return "{}: estimated from {}".format(*of[0])
    return f"speeds of {len(of)} joints ({listed(sensors[speed].target for speed, _ in of)}): estimated from their positions"
