"""The columns of a trial's tables brought to one grid of time."""

from __future__ import annotations

import math
from collections.abc import Mapping as AnyMapping

import numpy as np
from numpy.typing import NDArray

from ee_dist.basics.quoted import quoted
from ee_dist.measurements.clocks import Clocked, check_grid, other_clocks
from ee_dist.measurements.errors import MeasurementError
from ee_dist.measurements.frozen import frozen
from ee_dist.measurements.held_readings import read_in_turn, written_late
from ee_dist.measurements.mapping import Column, Mapping
from ee_dist.measurements.reading import between_readings, holes, paces_of, rows_read
from ee_dist.measurements.report import COMMAND, TORQUE, Report
from ee_dist.measurements.sampling import carried, grid, held, linear, smoothed
from ee_dist.measurements.suspicious import clock_suspicion, rolled_over, spike_suspicion, suspicions, time_suspicion
from ee_dist.measurements.table import Recorded
from ee_dist.measurements.trial_clocks import TrialClocks
from ee_dist.measurements.units import TURN, UNITS, factor
from ee_dist.robots.model import Robot
from ee_dist.trials.log import Array

HELD = ", commands held"
"""How the report says that."""
SAME_RATE = 1e-3
"""A record whose even step is within this share of the wanted one is taken sample by sample."""
DENSER = 1.1
"""Rows to a step from which commands reach the model later than they did the robot by what counts."""


class OnGrid:
    """``at_s`` (T,) is the grid, every ``step_s`` from the first row of the ``main`` table, that of the first sensor; ``clocks``
    are of all tables by name, ``read_at`` the rows in which sensors were read, ``empty`` the long runs of those in which one was
    not, ``frozen`` those in which all repeat a reading. Raises MeasurementError: see ``trial_clocks`` and ``clocks``."""

    def __init__(self, recorded: Recorded, mapping: Mapping, robot: Robot, report: Report) -> None:
        self.mapping, self.report, self.where = mapping, report, str(mapping.source)
        step = robot.time_step_s if mapping.rate_hz is None else 1.0 / mapping.rate_hz
        found = TrialClocks(recorded, mapping, robot, report.done)
        self.unit = found.unit
        report.suspicious += [found.lost] * bool(found.lost)
        check_grid(found.main, step, mapping.rate_hz is not None, self.unit)
        found.cut()
        self.main, self.clocks = found.main, found.clocks
        times_s, timing = self.main.times_s, self.main.timing
        length = float(times_s[-1] - times_s[0])
        self.step_s = step
        # The median alone misses a clock whose steps are mostly right and now and then longer.
        steps_s = (timing.median_s, length / (len(times_s) - 1))
        self.as_is = timing.even and all(abs(s / step - 1) < SAME_RATE for s in steps_s)
        self.at_s = np.arange(len(times_s)) * step if self.as_is else grid(times_s, step)
        self.read_at, self.empty = rows_read(mapping, self.clocks), holes(mapping, self.clocks)
        self.shown: AnyMapping[str, float] = {}
        """Seconds between readings by table, as other trials show them."""
        self.frozen: dict[str, NDArray[np.intp]] = {}
        for name, own in self.clocks.items():
            for run in frozen(mapping, own, name, robot):
                rows = np.arange(run.rows.start, run.rows.stop)
                self.frozen[name] = np.concatenate([self.frozen.get(name, rows[:0]), rows])
                report.suspicious.append(f"{run.said(own.table.line(run.rows.start))}: nothing there is compared")
        self._tell()

    def _tell(self) -> None:
        report, timing, step = self.report, self.main.timing, self.step_s
        length = float(self.main.times_s[-1] - self.main.times_s[0])
        report.rows_read, report.rows, report.seconds = len(self.main.times_s), len(self.at_s), length
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
        note = time_suspicion(timing.median_s, length, self.unit)
        if note:
            report.suspicious.append(note)
        other = clock_suspicion(self.main.name, length, other_clocks(self.main))
        if other:
            report.suspicious.append(other)
        for row, seconds in timing.gaps[:5]:
            report.suspicious.append(f"time: a gap of {seconds:.4g} s before row {row}")

    def paces(self) -> dict[str, float]:
        """Seconds between readings by table, of those in which not all rows are readings."""
        return paces_of(self.clocks, self.read_at)

    def at_paces(self, paces: AnyMapping[str, float]) -> None:
        """Readings at the paces that other trials of the logger show. Raises MeasurementError."""
        if paces.keys() - self.paces().keys():
            self.read_at, self.shown = rows_read(self.mapping, self.clocks, paces), paces

    def filled(self) -> Array | None:
        """(T,) which rows lie between readings; None where none does. Tells how many."""
        rows_s = self._rows_s() if self.as_is else None
        none = {t: [rows for _, rows in self.empty.get(t, ())] for t in self.clocks}
        for table, rows in self.frozen.items():
            none[table].append(rows)
        return between_readings(self.at_s, rows_s, self.main, self.clocks, self.read_at, self.report.done, none)

    def _rows_s(self) -> Array:
        """When the rows of the log were, (T,) s since the main table began. Rows that are taken sample by sample count as evenly
        apart, but a step that is off by SAME_RATE adds up over a long record: other tables are read at the true times."""
        return self.main.times_s - self.main.times_s[0] if self.as_is else self.at_s

    def column(
        self,
        column: Column,
        unit: str,
        name: str,
        step_like: bool,
        quiet: bool = False,
        reading: bool = False,
        lines: bool = False,
    ) -> Array:
        """The column on the grid, in ``unit``; ``step_like`` values are held, unless they go on by ``lines``; others, and any
        ``reading``, are joined by lines. ``quiet``: what looks wrong in it is not told."""
        own = self.clocks[column.table]
        raw = own.table.numbers(column.column, gaps=column.gaps == "interpolate")
        if column.table in self.frozen and (reading or name.startswith(TORQUE)):
            # What moved went on meanwhile; it did not stand still and jump.
            known = np.setdiff1d(np.flatnonzero(np.isfinite(raw)), self.frozen[column.table])
            raw = raw if len(known) < 2 else np.interp(np.arange(len(raw)), known, raw[known])
        size = factor(column.unit, unit, f"{self.where}: {name}")
        good = np.flatnonzero(np.isfinite(raw))
        # A goal that was sent once holds from then on.
        if len(good) < min(len(raw), 1 if step_like else 2):
            stood = (
                "; where a joint that stood still was not recorded, 'held: PLACE' at its columns says where it stood"
            )
            spared = f": leave out the {name}, which may stay unknown" if name.startswith(TORQUE) else stood
            raise MeasurementError(f"{own.table}: column {quoted(column.column)}: nearly all cells are empty{spared}")
        if not quiet and not column.signed_bits:
            title = f"{name} ({column.column})"
            said = suspicions(title, raw[good], _turn(column), name.startswith(COMMAND))
            # A speed does not begin anew, however it jumps.
            placed = reading and UNITS[unit][0] in ("angle", "length")
            looked = placed and not (said or column.unwrap or column.rolls_over)
            over = rolled_over(title, raw[good], abs(column.scale) * size) if looked else None
            spike = spike_suspicion(title, raw[good]) if step_like else None
            self.report.suspicious += [*said, *filter(None, (over, spike))]
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
        if column.rolls_over:
            values = np.unwrap(values, period=abs(column.rolls_over * column.scale) * size)
        rows = self.read_at.get(column.table)
        if (reading or name.startswith(TORQUE)) and rows is not None and len(rows) < len(values):
            late = written_late(raw, rows, own.times_s)
            mine = read_in_turn(raw, own.times_s, self.shown.get(column.table)) if late is None else None
            rows = rows if mine is None else mine
            # Torques are readings too where they keep to their pace; what was told to drives does not.
            if reading or late is not None:
                # Between readings a state goes on: it does not stand still and jump.
                read = values[np.minimum(rows + (late or 0), len(values) - 1)]
                values = linear(own.times_s - own.times_s[0], own.times_s[rows], read)
        if column.lead_s or not self._same_rows(own):
            # A torque that was read late is no step: what lies between two rows is between their values.
            lines = lines or (bool(column.lead_s) and name.startswith(TORQUE))
            # The grid begins where the main table does.
            at_s = self._rows_s() + (self.main.times_s[0] - own.times_s[0])
            if step_like and (own.table.planned or lines):
                values = linear(at_s + column.lead_s, own.times_s, values)
            elif step_like:
                values = held(at_s, own.times_s, values, column.lead_s)
            else:
                values = linear(at_s + column.lead_s, own.times_s, values)
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
