"""Stretches of a record that are simulated in one go, each from where the robot was measured to be."""

from __future__ import annotations

import hashlib
import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ee_dist.discrepancy.measured_trial import MeasuredTrial, released
from ee_dist.discrepancy.past import Past, limited
from ee_dist.discrepancy.problem import Index
from ee_dist.discrepancy.starting import starting_speeds
from ee_dist.discrepancy.thinning import one_of_each
from ee_dist.effects.scales import longest_delay
from ee_dist.engines.contract import Rollout
from ee_dist.engines.drivers import Commands
from ee_dist.measurements.errors import MeasurementError
from ee_dist.robots.model import Robot
from ee_dist.trials.log import Array, SensorLog, State

MOST_STEPS, FEWEST = 60_000, 6
"""Steps that a search simulates for each model at most, of windows that start anew; but so many windows of each trial."""


@dataclass(frozen=True)
class ToPositions:
    """The reduction that keeps some rows of some channels, (rows, C)."""

    columns: tuple[int, ...]
    rows: range | tuple[int, ...]

    @property
    def key(self) -> str:
        return f"positions:{self.columns}:{hashlib.sha256(repr(self.rows).encode()).hexdigest()}"

    def __call__(self, log: SensorLog) -> Array:
        return log.sensors[np.ix_(self.rows, self.columns)]


@dataclass(frozen=True, eq=False)
class Piece:
    """A stretch of a trial that is simulated in one go. ``log`` is what was measured of it, ``rows`` those of its rows that are
    compared."""

    trial: int
    start_s: float
    log: SensorLog
    rows: range | tuple[int, ...]
    commands: Array
    enabled: Array | None
    start: State
    again: tuple[tuple[int, State], ...] = ()
    """Rows at which it starts anew from the measured state."""
    past: Past | None = None
    """What came before, of which controllers with limits of their own know how far they have led their goals."""

    @property
    def window(self) -> Index:
        """(R,) which of the windows between the rows at which it starts anew each compared row is in."""
        found = np.searchsorted([k for k, _ in self.again], np.asarray(self.rows), side="right")
        return np.unique(found, return_inverse=True)[1].astype(np.int64)

    @property
    def stretches(self) -> list[slice]:
        """Which of the compared rows are in each of those windows."""
        edges = np.flatnonzero(np.diff(self.window)) + 1
        return [slice(a, b) for a, b in zip((0, *edges), (*edges, len(self.rows)), strict=True)]

    @property
    def times_s(self) -> Array:
        """(R,) of the rows that are compared, since its start."""
        return np.asarray(self.log.times_s[list(self.rows)] - self.log.times_s[0])

    def coarser(self, count: int) -> Piece:
        """The same in steps of ``count`` rows, of which those that are compared are. What the drives were told meanwhile is told
        them as its mean: neither early nor late."""

        def mean(values: Array | None) -> Array | None:
            if values is None:
                return None
            first = np.arange(0, len(values), count)
            lengths = np.diff([*first, len(values)]).reshape(-1, *(1,) * (values.ndim - 1))
            return np.asarray(np.add.reduceat(values, first, axis=0) / lengths)

        commands = mean(self.commands)
        assert commands is not None
        log = replace(
            self.log.part(0, len(self.log), count), supply_v=mean(self.log.supply_v), external=mean(self.log.external)
        )
        rows, again = tuple(r // count for r in self.rows), tuple((k // count, state) for k, state in self.again)
        return replace(self, log=log, rows=rows, commands=commands, again=again)

    def measured(self, columns: Sequence[int]) -> Array:
        """(R, C) of some channels."""
        return np.asarray(self.log.sensors[np.ix_(self.rows, columns)])

    def beside(self, positions: Array, speeds: Array) -> list[Piece]:
        """The same from states that are off by these (M,), one joint's position or speed at a time."""
        steps = [(d, 0.0 * d) for d in np.diag(positions) if d.any()] + [
            (0.0 * d, d) for d in np.diag(speeds) if d.any()
        ]

        def moved(state: State, by: tuple[Array, Array]) -> State:
            return State(state.joints + by[0], state.speeds + by[1])

        return [
            replace(self, start=moved(self.start, by), again=tuple((k, moved(s, by)) for k, s in self.again))
            for by in steps
        ]

    def rollout(self, model: Robot, steps: int, switched: bool) -> Rollout:
        """For ``steps`` rows, the last inputs held; ``switched``: say that the drives are on even where they always are."""
        enabled = np.ones(len(self.log)) if self.enabled is None and switched else self.enabled
        start = self.start
        if self.past is not None and any(map(limited, model.drives)):
            start = replace(start, goals=self.past.goals(model))
        return Rollout(
            model,
            Commands(self.commands),
            steps,
            start=start,
            supply_v=self.log.supply_v,
            enabled=enabled,
            external=self.log.external,
            again=self.again,
        )


def pieces(
    index: int, trial: MeasuredTrial, robot: Robot, windows_s: float | None, every: int, steps: int = 1
) -> list[Piece]:
    """Of a trial by its number, in windows of ``windows_s`` or in one; of every so many rows is compared one. ``steps``: so many
    rows at once are gone from the start of each. Raises MeasurementError for a log that no simulation can start from."""
    log = trial.log
    if log.joints is None:
        raise MeasurementError(
            f"trial {trial.name!r}: no joint positions in its log: nothing to start a simulation from"
        )
    if log.motor_names != robot.motor_names or log.sensor_names != robot.sensor_names:
        raise MeasurementError(
            f"trial {trial.name!r} is of another robot: its channels are {', '.join(log.sensor_names)}; "
            f"{robot.name} has {', '.join(robot.sensor_names)}"
        )
    dt = float(np.median(np.diff(log.times_s)))
    if abs(dt / robot.time_step_s - 1) > 1e-3:
        raise MeasurementError(
            f"trial {trial.name!r} has a row every {dt:g} s, {robot.name} a time step of {robot.time_step_s:g} s; import it at "
            f"{1 / robot.time_step_s:g} Hz"
        )
    speeds = starting_speeds(trial, robot)
    # A window is simulated from as long before it as a delay may be: what drives hold within them when it begins (commands on
    # their way, play) comes from there.
    run_up = round(longest_delay(robot) / robot.time_step_s)
    run_up += -run_up % steps
    commands, enabled = released(trial.obeyed(log.commands, robot))
    length = len(log) if windows_s is None else max(2, round(windows_s / dt))
    # An integral is what a controller made of all that came before.
    remembers = any(d.ki > 0 for d in robot.drives)
    # What was sent before a record began nobody knows. A goal that is held hardly moves a joint that stands there; a torque,
    # taken to have been held for as long as commands are late, would throw it: there the first window is a later one.
    unknown = run_up if windows_s is not None and any(d.command == "torque" for d in robot.drives) else 0
    found = []
    for first in range(unknown if unknown + length <= len(log) else 0, len(log), len(log) if remembers else length):
        last = len(log) if remembers else min(first + length, len(log))
        if last - first < min(length, len(log)) // 2:
            break
        begin = max(0, first - run_up)
        begin += (first - begin) % steps
        anew = range(first + length, last - length // 2, length) if first == begin else [first]
        part = log.part(begin, last)
        seen = range(first - begin, len(part), every)
        rows = seen if log.filled is None else tuple(r for r in part.readings.tolist() if r >= first - begin)
        if not rows:
            continue  # a gap in the log
        found.append(
            Piece(
                index,
                begin * dt,
                part,
                rows,
                commands[begin:last],
                None if enabled is None else enabled[begin:last],
                State(log.joints[begin].copy(), speeds[begin].copy()),
                tuple((k - begin, State(log.joints[k].copy(), speeds[k].copy())) for k in anew),
                Past(commands, enabled, log.joints, dt, begin) if begin else None,
            )
        )
    return found


def spared(windows: Sequence[Piece], steps: int = 1) -> int:
    """Of how many windows one is enough: 1 where all of them are few steps, of ``steps`` rows each, or are simulated in one
    go."""
    needed = math.ceil(sum(len(p.log) for p in windows) / (steps * MOST_STEPS))
    return max(1, min(needed, in_turn(windows, FEWEST)))


def in_turn(windows: Sequence[Piece], count: int) -> int:
    """Of how many windows one may be left so that each trial has ``count`` of them."""
    return max(1, min(Counter(p.trial for p in windows).values(), default=0) // count)


def thinned(windows: Sequence[Piece], one_in: int) -> list[Piece]:
    """One of so many windows of each trial, at places that no period of a motion falls together with."""
    of_trial: dict[int, list[Piece]] = {}
    for p in windows:
        of_trial.setdefault(p.trial, []).append(p)
    found: list[Piece] = []
    for own in of_trial.values():
        found += one_of_each(own[first : first + one_in] for first in range(0, len(own), one_in))
    return found
