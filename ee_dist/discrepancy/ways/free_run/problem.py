"""The problem of a whole record simulated freely: from the measured first state, in the loop of the robot's own controller.

The model gets what the robot got (commands, supply voltage, when its drives were released) and nothing else, for the
whole record; what counts is how far its joints are from where they were measured. That is what a user of the model will
do with it, and the strictest test: an error once made goes on. It suits robots that are held by their controller.

A residual value is sign(e) * sqrt(|e|), so that squares add up to absolute errors: the mean square is the mean absolute
position error. A stick that lasts too long moves a joint far away for a while; squares of that would outweigh the rest.

Joints that turn and joints that slide have nothing in common but their noise: each unit is counted by its own.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from ee_dist.basics.altered import altered
from ee_dist.discrepancy.measured_trial import MeasuredTrial, shown
from ee_dist.discrepancy.problem import TIMES_NOISE, Index, Problem, Series, Through, error
from ee_dist.discrepancy.starting import speeds_off
from ee_dist.discrepancy.ways.free_run.at_rest import doubt, hardly_better, stands_still
from ee_dist.discrepancy.ways.free_run.layout import lay_out
from ee_dist.discrepancy.ways.free_run.longer_steps import SLIGHT, every_row_is_known, moved_by
from ee_dist.discrepancy.ways.free_run.noise import noise_by_unit, noiseless
from ee_dist.discrepancy.ways.free_run.pieces import FEWEST, ToPositions, in_turn, pieces, spared, thinned
from ee_dist.discrepancy.ways.free_run.starts import GROWN, grown_by_start, positions_off, speeds_there
from ee_dist.discrepancy.ways.free_run.windows import led, longer, most_telling, window_s
from ee_dist.discrepancy.ways.free_run.words import how_begun, in_unit, of_models, taken_less
from ee_dist.effects.catalogue import Hypothesis
from ee_dist.effects.integral import INTEGRAL
from ee_dist.evaluation.jobs import Evaluator, Job, Whole
from ee_dist.measurements.errors import MeasurementError
from ee_dist.robots.model import Robot, Sensor
from ee_dist.trials.log import Array, SensorLog

BLOCKS = 6
"""Segments that a record run through in one go is cut into."""


class FreeRun(Problem):
    """Free runs: whole records simulated from their measured first state. Channels are the joint positions.

    ``every``: rows of a log from one residual value to the next; where sensors were read more seldom than rows are simulated,
    their readings are taken instead. ``windows_s`` starts the model anew from the measured
    state so often, and makes segments of the windows; None runs each trial through, in BLOCKS segments. ``one_in``: of so many
    windows one is simulated, and ``steps`` rows at a time.
    """

    way = "free_run"
    families = frozenset({"body", "drive", "world"})
    switches = False
    natural_name = "mean absolute position error"

    def __init__(
        self,
        trials: Sequence[MeasuredTrial],
        robot: Robot,
        evaluator: Evaluator,
        every: int = 3,
        windows_s: float | None = None,
        one_in: int = 1,
        steps: int = 1,
    ) -> None:
        self.windows_s, self.one_in, self.steps = windows_s, one_in, steps
        self.robot, self.measured, self.evaluator, self.every = robot, tuple(trials), evaluator, every
        columns = [k for k, s in enumerate(robot.sensors) if s.kind == "position"]
        if not columns:
            raise MeasurementError(f"{robot.name}: no sensor of kind 'position', which a free run is compared by")
        self.own = tuple(np.flatnonzero(t.recorded(robot)[columns]) for t in self.measured)
        """Of each trial, which of these were recorded: nothing is compared of others."""
        if nothing := [t.name for t, own in zip(self.measured, self.own, strict=True) if not len(own)]:
            raise MeasurementError(
                f"trial {nothing[0]!r}: no position was recorded in it, which a free run is compared by; leave it out (trials=)"
            )
        self.columns = tuple(columns)
        # What is predicted is the motion: noise of its sensors would count against every model.
        self.bare = noiseless(robot)
        self.pieces = [p for k, t in enumerate(trials) for p in pieces(k, t, robot, windows_s, every, steps)]
        recorded = [[columns[c] for c in own] for own in self.own]
        by_unit = noise_by_unit(self.pieces, [t.log for t in self.measured], robot, recorded)
        if one_in > 1:
            self.pieces = thinned(self.pieces, one_in)
        if steps > 1:
            self.pieces = [p.coarser(steps) for p in self.pieces]
        self.noise = np.array([by_unit.get(robot.sensors[k].unit, np.nan) for k in columns])
        """(C,) mean absolute error that noise alone would leave, in the unit of each channel; NaN of units of which nobody
        recorded any."""
        names, blocks = [t.name for t in self.measured], BLOCKS if windows_s is None else 1
        self.layout, self.slices = lay_out(robot, self.columns, names, self.pieces, self.own, blocks)
        self.weight = self.layout.floor.copy()
        """(n,) what a value's noise counts: a mean absolute error of 1, by the weight of its trial."""
        grown = self._by_start() if windows_s is not None else np.ones(1)
        if grown.mean() >= GROWN:
            noise = self.layout.floor
            # What a start does stays of one sign for the rest of its window.
            self.layout = replace(self.layout, floor=noise * grown, known=noise * (grown - 1.0), by_segment=True)
        self.units = tuple(by_unit)
        self.natural_unit = self.units[0] if len(by_unit) == 1 else TIMES_NOISE
        how = "free runs of the whole record" if windows_s is None else f"windows of {windows_s:g} s"
        if windows_s is not None:
            self.natural_name = f"mean absolute position error over {windows_s:g} s"
        self.error_definition = (
            f"mean absolute position error over {how}, every trial counting the same (for programs: its square root, in units "
            f"of the noise of the readings, {', '.join(f'{noise:.2g} {unit}' for unit, noise in by_unit.items())})"
        )

    def residuals(self, hypotheses: Sequence[Hypothesis], trials: Sequence[int] | None = None) -> Array:
        """(H, n), as the contract says. Raises EffectError for a hypothesis that does not fit the robot."""
        chosen = [i for i, p in enumerate(self.pieces) if trials is None or p.trial in set(trials)]
        return self.residuals_of_pieces(hypotheses, chosen)

    @cached_property
    def piece_of(self) -> Index:
        return np.repeat(np.arange(len(self.pieces)), [s.stop - s.start for s in self.slices])

    def residuals_of_pieces(self, hypotheses: Sequence[Hypothesis], pieces: Collection[int]) -> Array:
        chosen = sorted(pieces)
        models = self._models(hypotheses, {self.pieces[i].trial for i in chosen}, self.steps)
        # Rollouts of one length with the same inputs share a batch, so all run as long as the longest.
        steps, switched = max(len(p.log) for p in self.pieces), any(p.enabled is not None for p in self.pieces)
        jobs = [
            Job(p.rollout(m, steps, switched), ToPositions(self.columns, p.rows))
            for p in (self.pieces[i] for i in chosen)
            for m in models[p.trial]
        ]
        found = self.evaluator.evaluate(jobs)
        out = np.zeros((len(hypotheses), len(self.segment_of)))
        for place, i in enumerate(chosen):
            measured, own = self.pieces[i].measured(self.columns), self.own[self.pieces[i].trial]
            gap = measured[None] - np.stack(found[place * len(hypotheses) : (place + 1) * len(hypotheses)])
            gap = gap[..., own]
            with np.errstate(invalid="ignore"):
                value = np.sign(gap) * np.sqrt(np.abs(gap) * (self.weight[self.slices[i].start] / self.noise[own]))
            out[:, self.slices[i]] = np.where(np.isfinite(value), value, np.inf).reshape(len(hypotheses), -1)
        return out

    def floor_under(self, hypothesis: Hypothesis) -> float:
        if not self.layout.by_segment:
            return super().floor_under(hypothesis)
        return float((self.weight * self._by_start(hypothesis)).sum())

    def _by_start(self, hypothesis: Hypothesis = ()) -> Array:
        """(n,) by how much more than noise a perfect model would leave that moves as the robot with a hypothesis does, for it
        starts from what was measured."""
        noise, trials = self.noise, list(enumerate(zip(self.measured, self.own, strict=True)))
        models = [self._simulated(k, hypothesis) for k, _ in trials]
        positions = [positions_off(self.robot, self.columns, own, noise) for _, (_, own) in trials]
        speeds = [(t.log.times_s - t.log.times_s[0], speeds_off(t, self.robot)) for _, (t, _) in trials]
        starts = [(models[p.trial], positions[p.trial], speeds_there(p, *speeds[p.trial])) for p in self.pieces]
        return grown_by_start(self.pieces, starts, self.columns, self.own, noise, self.evaluator)

    def _models(self, hypotheses: Sequence[Hypothesis], trials: Collection[int], steps: int) -> dict[int, list[Robot]]:
        """What is simulated for each hypothesis, so many rows at a time, by trial; trials in which the robot was held alike share
        them."""
        alike: dict[tuple[Hypothesis, bool | None], list[Robot]] = {}
        for k in trials:
            t = self.measured[k]
            how = t.setup, t.commands_held
            if how not in alike:
                models = t.models(self.bare, hypotheses)
                if steps > 1:
                    models = [altered(m, time_step_s=m.time_step_s * steps) for m in models]
                alike[how] = [t.simulated(m) for m in models]
        return {k: alike[self.measured[k].setup, self.measured[k].commands_held] for k in trials}

    def _simulated(self, trial: int, hypothesis: Hypothesis) -> Robot:
        return self._models([hypothesis], (trial,), self.steps)[trial][0]

    def shows(self, effect: str, target: str) -> bool:
        """A window knows nothing of what an integral has added up before it."""
        return (effect != INTEGRAL or self.windows_s is None) and super().shows(effect, target)

    def noise_floor(self) -> tuple[float, str]:
        seldom = any(p.log.filled is not None for p in self.pieces)
        how = f"estimated: {'divided' if seldom else 'second'} differences of the measured positions"
        if not self.layout.by_segment:
            return 1.0, how
        return float(np.sqrt(self.floor.mean())), f"{how}, and what they do to the start of each window"

    def smooth(self, residual: Array) -> Array:
        """The error itself, in units of the noise, instead of its root."""
        return np.asarray(residual * np.abs(residual))

    def weight_of(self, trial: int) -> float:
        return float(self.weight[self.trial_of == trial].max(initial=0.0)) or 1.0

    def natural(self, value: float) -> float:
        """Mean absolute position error, rad or m; of joints of both kinds times that of noise alone."""
        return value**2 * (float(self.noise[0]) if len(self.units) == 1 else 1.0)

    def told(self, error: float) -> str:
        value = self.natural(error)
        return in_unit(value, self.units[0]) if len(self.units) == 1 else f"{value:.3g} {self.natural_unit}"

    def told_by_unit(self, residual: Array) -> str:
        """The mean absolute position error of a residual (n,), of joints of each kind in their own unit."""
        off, unit_of = np.abs(self.raw(residual)), np.array(self.layout.units)[self.channel_of]
        # Every trial counts the same, as it does in the error.
        return " and ".join(in_unit(float(np.average(off[m], weights=self.weight[m])), u)
                            for u in self.units for m in [unit_of == u])  # fmt: skip

    def raw(self, residual: Array) -> Array:
        return np.asarray(np.sign(residual) * residual**2 * self.noise[self.channel_of] / self.weight)

    def series(self, hypothesis: Hypothesis) -> list[Series]:
        """Every stretch from one start to the next, as far as residuals were taken."""
        gap = self.raw(self.residuals([hypothesis])[0])
        out = []
        for i, p in enumerate(self.pieces):
            channels = self.own[p.trial].tolist()
            off = gap[self.slices[i]].reshape(-1, len(channels))
            measured, times = p.measured(self.columns), p.start_s + p.times_s
            for own in p.stretches:
                for at, c in enumerate(channels):
                    read = measured[own, c]
                    out.append(Series(p.trial, c, self.layout.units[c], times[own], read, read - off[own, at]))
        return out

    @cached_property
    def searched(self) -> FreeRun:
        """The same by windows. Over a whole record errors jump where a joint sticks or slips: fits are caught, and what is
        foretold of another motion depends on which of many equal ones was found. Of long records in fine steps some of them: a
        search simulates them ten thousand times."""
        found = self if self.windows_s is not None else self._in_windows
        steps = found._steps_enough
        one_in = spared(found.pieces, steps)
        return found if one_in == steps == 1 else self._by(found.windows_s, one_in, steps)

    def as_searched(self, like: Problem) -> FreeRun:
        if self.windows_s is not None:
            return self
        windows_s = like.windows_s if isinstance(like, FreeRun) else None
        return self._in_windows if windows_s is None else self._by(windows_s)

    def beginning(self, seconds: float) -> Problem:
        """Windows from all over the trials, half as many as the beginning would have: each begins from what was measured, and
        they are less alike than one stretch."""
        if self.windows_s is None:
            return self
        one_in = in_turn(self.pieces, max(FEWEST, round(0.5 * seconds / self.windows_s)))
        return self if one_in == 1 else self._by(self.windows_s, self.one_in * one_in, self.steps)

    @cached_property
    def _steps_enough(self) -> int:
        """How many rows a search may go at a time."""
        if self.windows_s is None or not self.layout.by_segment or not every_row_is_known(self.measured, self.robot):
            return 1
        count, trials = self.every, list(enumerate(self.measured))
        windows = [p for k, t in trials for p in pieces(k, t, self.robot, self.windows_s, count, count)]
        off = moved_by(windows, count, self._as_described, self.columns, self.evaluator)
        own = [self.own[p.trial] for p in windows]
        times = np.concatenate([(o / self.noise)[:, c].ravel() for o, c in zip(off, own, strict=True)])
        return count if float(np.mean(times)) <= SLIGHT * float(self.floor.mean()) else 1

    def _as_described(self, steps: int) -> list[Robot]:
        """The robot of each trial that is simulated so many rows at a time."""
        models = self._models([()], range(len(self.measured)), steps)
        return [models[k][0] for k in sorted(models)]

    @cached_property
    def _in_windows(self) -> FreeRun:
        """The same by windows, all of them: of the usual length, or longer ones where what starts are off by drowns what models
        are off by, and does so less in these."""
        usual = window_s(self.robot)
        found = self._by(usual)
        if not found.layout.by_segment:
            return found
        shortest = min(float(np.ptp(t.log.times_s)) for t in self.measured)
        return most_telling(found, map(self._by, longer(usual, shortest)), lambda p: p._above_starts)

    @property
    def _above_starts(self) -> float:
        """Energy that the robot as described leaves, over what starts and noise may leave; none where it flies apart, nor where
        starts are next to nothing beside the noise on average, and no part of the floor."""
        if not self.layout.by_segment:
            return 0.0
        left = self.residuals([()])[0]
        return float(left @ left / self.floor.sum()) if np.isfinite(left).all() else 0.0

    @cached_property
    def _whole(self) -> FreeRun:
        """The same run through."""
        return self if self.windows_s is None else self._by(None)

    def _by(self, windows_s: float | None, one_in: int = 1, steps: int = 1) -> FreeRun:
        return FreeRun(self.measured, self.robot, self.evaluator, self.every, windows_s, one_in, steps)

    @property
    def notes(self) -> list[str]:
        seconds = sum(float(t.log.times_s[-1] - t.log.times_s[0]) for t in self.measured)
        return super().notes + taken_less(self.one_in, self.steps, self.robot.time_step_s, seconds)

    def remarks(self, hypothesis: Hypothesis) -> list[str]:
        return self.other_errors(hypothesis)

    def run_through(self, models: Sequence[Hypothesis]) -> list[Through] | None:
        if self.windows_s is None or not led(self.robot):
            return None
        whole = self._whole
        return [Through(whole.natural(e), whole.told(e)) for e in map(error, whole.residuals(models))]

    def other_errors(self, *models: Hypothesis) -> list[str]:
        out = []
        if len(self.units) > 1:
            each = [self.told_by_unit(r) for r in self.residuals(models)]
            out += [f"Mean absolute position error: {of_models(each)}."]
        if led(self.robot):
            other = self._in_windows if self.windows_s is None else self._whole
            rows = other.residuals(models)
            each = [other.told(error(r)) if len(self.units) == 1 else other.told_by_unit(r) for r in rows]
            out += [f"{how_begun(other.windows_s)}: {of_models(each)}."]
        if rest := self.says_nothing(models[-1]):
            out += [doubt(rest, error(self.residuals([models[-1]])[0]), self._at_rest)]
        return out

    def says_nothing(self, model: Hypothesis) -> str:
        """One with enough friction stands still, and most of a record is often rest."""
        if self.windows_s is None:
            return ""
        off, noise = error(self.residuals([model])[0]), self.noise_floor()[0]
        return hardly_better(off, self._at_rest, noise, self.told) or self.never_moves(model)

    def never_moves(self, model: Hypothesis) -> str:
        """By the whole record, of a robot that controllers lead."""
        if self.windows_s is None or not led(self.robot) or not model:
            return ""
        whole = self._whole
        described, through = (error(r) for r in whole.residuals([(), model]))
        return stands_still(described, through, whole._at_rest, whole.told)

    @cached_property
    def _at_rest(self) -> float:
        """The error of a robot that stays where each window begins."""
        gap = np.concatenate(
            [
                ((read - read[own.start]) / self.noise)[own, self.own[p.trial]].ravel() * self.weight[at.start]
                for p, at in zip(self.pieces, self.slices, strict=True)
                for read in [p.measured(self.columns)]
                for own in p.stretches
            ]
        )
        return float(np.sqrt(np.abs(gap).mean()))

    def simulated(self, hypothesis: Hypothesis, beside: Sequence[Sensor] = ()) -> list[SensorLog | None]:
        """Of the first stretch of each trial; of a robot that is led, the whole trial."""
        if self.windows_s is not None and led(self.robot):
            return self._whole.simulated(hypothesis, beside)
        if self.steps > 1:
            return self._by(self.windows_s, self.one_in).simulated(hypothesis, beside)
        first = {p.trial: p for p in reversed(self.pieces)}
        jobs = []
        for k, p in sorted(first.items()):
            rollout = p.rollout(self._simulated(k, hypothesis), len(p.log), False)
            jobs.append(Job(shown(rollout, beside), Whole()))
        return list(self.evaluator.evaluate(jobs))

    def mean_absolute(self, hypothesis: Hypothesis) -> Array:
        """(trials,) mean absolute position error of each trial, in ``natural_unit``."""
        residual = self.residuals([hypothesis])[0]
        return np.array([self.natural(self.trial_error(residual, k)) for k in range(len(self.measured))])
