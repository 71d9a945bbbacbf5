"""The problem of a whole record simulated freely: from the measured first state, in the loop of the robot's own controller.

The model gets what the robot got (commands, supply voltage, when its drives were released) and nothing else, for the
whole record; what counts is how far its joints are from where they were measured. That is what a user of the model will
do with it, and the strictest test: an error once made goes on. It suits robots that are held by their controller.

A residual value is sign(e) * sqrt(|e|), so that squares add up to absolute errors: the mean square is the mean absolute
position error. A stick that lasts too long moves a joint far away for a while; squares of that would outweigh the rest.

Joints that turn and joints that slide have nothing in common but their noise: each unit is counted by its own.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from ee_dist.basics.altered import altered
from ee_dist.discrepancy.measured_trial import MeasuredTrial
from ee_dist.discrepancy.problem import TIMES_NOISE, Index, Layout, Problem, Series, Through, error, joints_of
from ee_dist.discrepancy.starting import speeds_off
from ee_dist.discrepancy.ways.free_run.longer_steps import SLIGHT, every_row_is_known, moved_by
from ee_dist.discrepancy.ways.free_run.noise import MEAN_ABSOLUTE, noise_by_unit, noiseless
from ee_dist.discrepancy.ways.free_run.pieces import FEWEST, ToPositions, in_turn, pieces, spared, thinned
from ee_dist.effects.catalogue import Hypothesis
from ee_dist.effects.integral import INTEGRAL
from ee_dist.evaluation.jobs import Evaluator, Job, Whole
from ee_dist.measurements.errors import MeasurementError
from ee_dist.robots.model import Robot
from ee_dist.trials.log import Array, SensorLog

RESTART_S = 0.5
"""Length of windows that start anew from the measured state,"""
LATE, LAGS = 0.5, 4.0
"""but of so many lags where a joint was seen to come later than by so much of it: by the end of such a window it has hardly come
to what it was told, and any soft controller does as well."""
GROWN = 10.0
"""Error over that of noise alone, of a perfect model, from which the starts of windows decide: motions that are not stable.
Below it noise is all of the floor: it is a bound, and hid what was found without it in simulated robots."""
HARDLY_BETTER = 0.8
"""Share of the error of a robot that stays where it is, from which a model says next to nothing of the motion."""
WORSE = 1.5
"""Times as far off as a robot that stays where it is, from which a model goes the wrong way or too far,"""
ASTRAY = (
    "It goes the wrong way, or too far: are sign, scale and unit of commands and positions right, and gains and inertia of the "
    "description?"
)
"""which is asked before"""
MOVES = "Is there more in the record than rest, and is friction no more than what moved the joints?"
AT_NOISE = 1.3
"""Times the noise floor up to which a model is right, be it of a robot at rest."""
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
        by_unit = noise_by_unit(self.pieces, robot, [[columns[c] for c in own] for own in self.own])
        if one_in > 1:
            self.pieces = thinned(self.pieces, one_in)
        if steps > 1:
            self.pieces = [p.coarser(steps) for p in self.pieces]
        self.noise = np.array([by_unit.get(robot.sensors[k].unit, np.nan) for k in columns])
        """(C,) mean absolute error that noise alone would leave, in the unit of each channel; NaN of units of which nobody
        recorded any."""
        self._lay_out(BLOCKS if windows_s is None else 1)
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

    def _lay_out(self, blocks: int) -> None:
        """Segments and places of all residual values. A trial's values carry equal weight in sum, whatever its length."""
        rows, channels = [len(p.rows) for p in self.pieces], [self.own[p.trial] for p in self.pieces]
        starts = np.cumsum([0, *(count * len(own) for count, own in zip(rows, channels, strict=True))])
        self.slices = [slice(int(a), int(b)) for a, b in pairwise(starts)]
        names: list[str] = []
        of_trial: list[int] = []
        seg: list[Array] = []
        time: list[Array] = []
        for p, count, own in zip(self.pieces, rows, channels, strict=True):
            width = len(own)
            block, at = p.window, p.start_s + p.times_s
            cut = int(block.max()) + 1
            if cut == 1:
                cut = min(blocks, max(1, count // 10))
                block = np.arange(count) * cut // count
            seg.append(np.repeat(len(names) + block, width))
            time.append(np.repeat(at, width))
            names += [f"{self.measured[p.trial].name}@{at[np.argmax(block == b)]:.1f}s" for b in range(cut)]
            of_trial += [p.trial] * cut
        segment_of, size = np.concatenate(seg), int(starts[-1])
        trial_of = np.array(of_trial)[segment_of]
        values = np.bincount(trial_of)
        self.weight = (values[values > 0].mean() / np.maximum(values, 1))[trial_of]
        sensors = [self.robot.sensors[k] for k in self.columns]
        self.layout = Layout(
            segments=tuple(names),
            trial_of_segment=np.array(of_trial),
            segment_of=segment_of,
            channel_of=np.concatenate([np.tile(own, count) for own, count in zip(channels, rows, strict=True)]),
            time_s=np.concatenate(time),
            reading=np.ones(size, dtype=bool),
            floor=self.weight.copy(),
            known=np.zeros(size),
            channels=tuple(s.name for s in sensors),
            units=tuple(s.unit for s in sensors),
            joint_of_channel=joints_of(self.robot, [s.target for s in sensors]),
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

    def _by_start(self) -> Array:
        """(n,) by how much more than noise a perfect model would leave, for it starts from what was measured: where a motion is
        not stable, a pole that stands upright, what is wrong with that grows until the window ends. By the robot as it is
        described, a standard deviation beside each measured position and speed."""
        jobs, count = [], []
        of_trial = [
            (self._simulated(k, ()), self._positions_off(k), speeds_off(t, self.robot))
            for k, t in enumerate(self.measured)
        ]
        for p in self.pieces:
            model, positions, speeds = of_trial[p.trial]
            beside = [p, *p.beside(positions, speeds)]
            jobs += [Job(b.rollout(model, len(p.log), False), ToPositions(self.columns, p.rows)) for b in beside]
            count.append(len(beside))
        found, grown = iter(self.evaluator.evaluate(jobs)), []
        for p, many in zip(self.pieces, count, strict=True):
            own, *others = (np.asarray(next(found), dtype=float) for _ in range(many))
            with np.errstate(invalid="ignore", over="ignore"):
                spread = np.sqrt(sum(((o - own) ** 2 for o in others), np.zeros_like(own))) * MEAN_ABSOLUTE / self.noise
            grown.append(np.hypot(1.0, np.where(np.isfinite(spread), spread, 0.0))[:, self.own[p.trial]].ravel())
        return np.concatenate(grown)

    def _positions_off(self, trial: int) -> Array:
        """(M,) standard deviations of the joint positions that a simulation of a trial starts from."""
        joints = {self.robot.sensors[self.columns[c]].target: self.noise[c] for c in self.own[trial]}
        return np.array([joints.get(m, 0.0) / MEAN_ABSOLUTE for m in self.robot.motor_names])

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
        return _told(value, self.units[0]) if len(self.units) == 1 else f"{value:.3g} {self.natural_unit}"

    def told_by_unit(self, residual: Array) -> str:
        """The mean absolute position error of a residual (n,), of joints of each kind in their own unit."""
        off, unit_of = np.abs(self.raw(residual)), np.array(self.layout.units)[self.channel_of]
        # Every trial counts the same, as it does in the error.
        return " and ".join(_told(float(np.average(off[m], weights=self.weight[m])), u)
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

    @property
    def as_searched(self) -> FreeRun:
        return self if self.windows_s is not None else self._in_windows

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
        """The same by windows, all of them."""
        return self._by(window_s(self.robot))

    @cached_property
    def _whole(self) -> FreeRun:
        """The same run through."""
        return self if self.windows_s is None else self._by(None)

    def _by(self, windows_s: float | None, one_in: int = 1, steps: int = 1) -> FreeRun:
        return FreeRun(self.measured, self.robot, self.evaluator, self.every, windows_s, one_in, steps)

    @property
    def notes(self) -> list[str]:
        lines = super().notes
        if self.one_in > 1:
            whole = sum(float(t.log.times_s[-1] - t.log.times_s[0]) for t in self.measured)
            lines.append(
                f"So that the search ends, one in {self.one_in} of the windows is simulated, of {whole:.0f} s in steps of "
                f"{1e3 * self.steps * self.robot.time_step_s:g} ms; compare takes all of them."
            )
        if self.steps > 1:
            step_ms = 1e3 * self.robot.time_step_s
            lines.append(
                f"So that the search ends, it goes in steps of {self.steps * step_ms:g} ms, by which the robot as described is "
                f"off by less than a tenth of the noise floor; compare goes in steps of {step_ms:g} ms."
            )
        return lines

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
            out += [f"Mean absolute position error: {_listed([self.told_by_unit(r) for r in self.residuals(models)])}."]
        if led(self.robot):
            other = self._in_windows if self.windows_s is None else self._whole
            how = "Run through without starting anew"
            if other.windows_s is not None:
                how = f"Started anew from the measured state every {other.windows_s:g} s"
            rows = other.residuals(models)
            each = [other.told(error(r)) if len(self.units) == 1 else other.told_by_unit(r) for r in rows]
            out += [f"{how}: {_listed(each)}."]
        rest = self.says_nothing(models[-1])
        if not rest:
            return out
        worse = error(self.residuals([models[-1]])[0]) > WORSE * self._at_rest
        return [*out, f"{rest[0].upper()}{rest[1:]}. {ASTRAY + ' ' if worse else ''}{MOVES}"]

    def says_nothing(self, model: Hypothesis) -> str:
        """One with enough friction stands still, and most of a record is often rest."""
        if self.windows_s is None:
            return ""
        off = error(self.residuals([model])[0])
        least = max(AT_NOISE * self.noise_floor()[0], math.sqrt(HARDLY_BETTER) * self._at_rest)
        if least <= off < math.inf:
            return (
                f"a robot that stays where each window begins would be off by {self.told(self._at_rest)}, this model is by "
                f"{self.told(off)}: it says next to nothing of the motion"
            )
        return self.never_moves(model)

    def never_moves(self, model: Hypothesis) -> str:
        """By the whole record, of a robot that controllers lead."""
        if self.windows_s is None or not led(self.robot) or not model:
            return ""
        whole = self._whole
        described, through = (error(r) for r in whole.residuals([(), model]))
        rest = whole._at_rest
        if not described < math.sqrt(HARDLY_BETTER) * rest <= through < math.inf:
            return ""
        return (
            f"run through without starting anew a robot that never moves would be off by {whole.told(rest)}, this model is by "
            f"{whole.told(through)}, and as it is described by {whole.told(described)}: it says next to nothing of the motion"
        )

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

    def simulated(self, hypothesis: Hypothesis) -> list[SensorLog | None]:
        """Of the first stretch of each trial; of a robot that is led, the whole trial."""
        if self.windows_s is not None and led(self.robot):
            return self._whole.simulated(hypothesis)
        if self.steps > 1:
            return self._by(self.windows_s, self.one_in).simulated(hypothesis)
        first = {p.trial: p for p in reversed(self.pieces)}
        jobs = []
        for k, p in sorted(first.items()):
            rollout = p.rollout(self._simulated(k, hypothesis), len(p.log), False)
            jobs.append(Job(replace(rollout, pose=True), Whole()))
        return list(self.evaluator.evaluate(jobs))

    def mean_absolute(self, hypothesis: Hypothesis) -> Array:
        """(trials,) mean absolute position error of each trial, in ``natural_unit``."""
        residual = self.residuals([hypothesis])[0]
        return np.array([self.natural(self.trial_error(residual, k)) for k in range(len(self.measured))])


def window_s(robot: Robot) -> float:
    """How long windows of a robot are, by what was seen of it."""
    lag = max((robot.joint(d.joint).lag_s for d in robot.drives), default=0.0)
    return RESTART_S if lag <= LATE * RESTART_S else round(LAGS * lag, 1)


def led(robot: Robot) -> bool:
    """Whether controllers hold the joints to what is commanded."""
    return any(d.command in ("position", "speed") for d in robot.drives)


def _listed(each: Sequence[str]) -> str:
    """Of one model, or of one and of another made from it."""
    return each[0] if len(each) == 1 else f"model {each[0]}, improved model {each[-1]}"


def _told(value: float, unit: str) -> str:
    return f"{value:.3g} {unit}" if value >= 1 else f"{1e3 * value:.3g} {'mrad' if unit == 'rad' else 'mm'}"
