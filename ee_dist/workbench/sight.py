"""What the page draws of a hypothesis: its error, where it sits, and the curves of one trial and channel.

Everything here is what task=compare computes, asked for piece by piece so that a slider need not wait for all of it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ee_dist.discrepancy.compare import Comparison, by_trial, circumstances, compare, rows_of
from ee_dist.discrepancy.problem import Problem, Series, error, joined
from ee_dist.effects.catalogue import Hypothesis
from ee_dist.robots.ranges import unit_at
from ee_dist.tasks.config import Config
from ee_dist.tasks.measurements import Measurements
from ee_dist.tasks.ways import Way
from ee_dist.trials.log import Array

Place = tuple[int, int]
"""A trial and a channel, by number."""
AT_ONCE = 3
"""Trials up to which all are simulated at each move of a slider."""
MANY_ROWS = 50_000
"""Rows of all trials from which their simulation takes half a second and more: not while a hand is on a slider."""
AGAINST = ("position", "speed", "command", "load")


@dataclass(frozen=True, eq=False)
class Seen:
    """A hypothesis looked at whole, as task=compare does. ``residual`` (n,)."""

    terms: Hypothesis
    residual: Array
    found: Comparison

    @property
    def finite(self) -> bool:
        return bool(np.isfinite(self.residual).all())


@dataclass(frozen=True, eq=False)
class Glance:
    """What a hand on a slider sees: one channel of one trial, and errors as the sight of the moment weighs them. ``error``:
    over all trials; None where these are so many that it is asked for when the hand pauses, or rests (``Sight.at_pauses``)."""

    terms: Hypothesis
    series: Series | None
    residual: Array
    trial_error: float
    error: float | None


@dataclass(frozen=True, eq=False)
class Cloud:
    """Residuals (k,) of a channel in its unit against what its joint did (k,), at ``times_s`` (k,)."""

    against: str
    unit: str
    times_s: Array
    x: Array
    residual: Array


class Sight:
    """Measurements under one way of comparing, weighed by one model. Not for several threads at once."""

    def __init__(self, measured: Measurements, config: Config, way: Way) -> None:
        self.config, self.way = config, way
        self.problem: Problem = way.make(measured, config)
        # How the logs are read is settled once.
        self.measured = replace(measured, trials=self.problem.measured)
        self._single: dict[int, Problem] = {}

    def weighed(self, terms: Hypothesis) -> Sight:
        """The same by another model: a model's predictability says how much each value counts, so task=compare of a saved
        model gives the error of the sight that is weighed by it."""
        return Sight(replace(self.measured, model=terms), self.config, self.way)

    def seen(self, terms: Hypothesis) -> Seen:
        residual = self.problem.residuals([terms])[0]
        if not np.isfinite(residual).all():
            return Seen(terms, residual, _nothing(self.problem))
        return Seen(terms, residual, compare(self.problem, residual))

    def whole_residual(self, terms: Hypothesis) -> Array:
        """(n,) of all trials."""
        return np.asarray(self.problem.residuals([terms])[0])

    def error(self, terms: Hypothesis) -> float:
        """The one error number over all trials; infinite where the model cannot be simulated."""
        return error(self.whole_residual(terms))

    def trial_residual(self, terms: Hypothesis, trial: int) -> Array:
        """(n,) where only the values of one trial are not zero."""
        return np.asarray(self.problem.residuals([terms], [trial])[0])

    def trial_error(self, residual: Array, trial: int) -> float:
        return self.problem.trial_error(residual, trial)

    def series(self, terms: Hypothesis, place: Place) -> Series | None:
        """Measured and predicted of one channel of one trial, simulating that trial alone."""
        trial, channel = place
        found = [s for s in joined(self._of(trial).series(terms)) if s.channel == channel]
        if not found:
            return None
        return replace(found[0], trial=trial)

    def glance(self, terms: Hypothesis, place: Place) -> Glance:
        few = len(self.problem.trials) <= AT_ONCE and self.at_pauses
        # Few trials are one batch of the engine, and take hardly longer than one.
        residual = self.whole_residual(terms) if few else self.trial_residual(terms, place[0])
        whole = error(residual) if few else None
        return Glance(terms, self.series(terms, place), residual, self.trial_error(residual, place[0]), whole)

    @property
    def at_pauses(self) -> bool:
        """Whether the error over all trials is there soon enough to be looked at while a hand is still on a slider."""
        return sum(len(t.log) for t in self.measured.trials) < MANY_ROWS

    def clouds(self, residual: Array, place: Place) -> list[Cloud]:
        """The residual (n,) of a channel in a trial against what its joint did there; none where it belongs to no joint."""
        trial, channel = place
        layout, problem = self.problem.layout, self.problem
        j = layout.joint_of_channel[channel]
        if j is None:
            return []
        mine = np.flatnonzero((problem.trial_of == trial) & (problem.channel_of == channel) & layout.reading)
        if not len(mine) or not np.isfinite(residual[mine]).all():
            return []
        at = rows_of(problem, trial, layout.time_s[mine])
        around = circumstances(problem, trial)
        joint = problem.robot.motor_names[j]
        slide = problem.robot.joint(joint).kind == "slide"
        sent = unit_at(problem.robot, joint)
        units = dict(zip(AGAINST, ("m", "m/s", sent, "N") if slide else ("rad", "rad/s", sent, "N.m"), strict=True))
        raw, out = problem.raw(residual)[mine], []
        for name in AGAINST:
            x = getattr(around, name)[at, j]
            if np.isfinite(x).all() and np.ptp(x) > 0:
                out.append(Cloud(name, units[name], layout.time_s[mine], x, raw))
        return out

    def worst(self, seen: Seen) -> Place:
        """The channel and trial that the largest part of the error sits in, among readings that can be drawn."""
        problem = self.problem
        table = by_trial(problem, np.nan_to_num(seen.residual, posinf=0.0))
        drawn = {c for c in range(len(problem.channels)) if (problem.layout.reading & (problem.channel_of == c)).any()}
        table = np.where([c in drawn for c in range(table.shape[1])], table, -1.0)
        trial, channel = np.unravel_index(int(np.argmax(table)), table.shape)
        return int(trial), int(channel)

    def _of(self, trial: int) -> Problem:
        if len(self.problem.measured) == 1:
            return self.problem
        if trial not in self._single:
            alone = replace(self.measured, trials=(self.measured.trials[trial],))
            self._single[trial] = self.way.as_read(alone, self.config, self.problem)
        return self._single[trial]


def _nothing(problem: Problem) -> Comparison:
    """Of a model that cannot be simulated."""
    floor, source = problem.noise_floor()
    return Comparison(np.inf, floor, source, problem.error_definition, [], [], {}, np.zeros((0, 0)), [])
