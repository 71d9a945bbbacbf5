"""The problem of a whole simulated robot: predictions on the recorded commands, compared channel by channel.

A residual value is the mean over a block of rows of (measured - predicted), in units of what that difference would be
from noise and from the spread of equally good models (see predictability.py), softened beyond six of them so that one
missed contact does not outweigh a minute of agreement; of a real robot that touches nothing beyond sixty.
Two values a window and channel
compare how noisy and how frozen the channel is, which is all that a noisy or dropping sensor changes.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from ee_dist.discrepancy.measured_trial import MeasuredTrial, reading_s, shown
from ee_dist.discrepancy.meters import motions
from ee_dist.discrepancy.problem import EVENT, Index, Problem, Series
from ee_dist.discrepancy.recorded import means_of, row_by_row
from ee_dist.discrepancy.ways.open_loop.falls import fallen
from ee_dist.discrepancy.ways.open_loop.in_units import InUnits, farther_off, in_units, told_in_units
from ee_dist.discrepancy.ways.open_loop.layout import lay_out
from ee_dist.discrepancy.ways.open_loop.predictability import MEMBERS, ensemble
from ee_dist.discrepancy.ways.open_loop.prediction import (
    Predictor,
    ToSensors,
    digest,
    of_rows,
    report,
    rollout_of,
)
from ee_dist.discrepancy.ways.open_loop.residual import command_residuals, residual_of
from ee_dist.discrepancy.ways.open_loop.scale import Scale, channel_scale, no_more_than_places
from ee_dist.discrepancy.ways.open_loop.set_ups import SetUps
from ee_dist.discrepancy.ways.open_loop.stretches import (
    STRETCH_S,
    Stretch,
    at_most,
    enough,
    forgets,
    in_one_go,
    stretches,
    too_long,
    unsettled,
)
from ee_dist.discrepancy.ways.open_loop.texture import REPEATING, ROUGH, digest_held, moving
from ee_dist.discrepancy.ways.open_loop.unmodelled import Unmodelled, of_trial
from ee_dist.discrepancy.ways.open_loop.views import Views
from ee_dist.discrepancy.ways.open_loop.weights import FIRM, SOFT, TINY, Weights, weigh
from ee_dist.discrepancy.ways.open_loop.words import begun_in_motion, counted_less, some_of_it, uncompared
from ee_dist.effects.catalogue import Hypothesis, applied, apply, find
from ee_dist.effects.effect import Beside
from ee_dist.effects.groups import members_of
from ee_dist.effects.integral import INTEGRAL
from ee_dist.effects.stamps import STAMPED_LATE
from ee_dist.engines.drivers import Network
from ee_dist.evaluation.jobs import Evaluator, Job, Whole
from ee_dist.robots.model import Robot, Sensor
from ee_dist.trials.log import Array, SensorLog

BLOCK_S = 0.04
"""Time that readings are averaged over, where they are taken more seldom than rows are simulated."""
TOGETHER = 4_000_000
"""Residual values that are computed together: of long logs those of a few hypotheses."""
SAVED = 0.6
"""Share of the rows that the beginning of trials may have, to be worth a look by itself."""
AT_ONCE = 16
"""Values that a contact or a reversal is in."""


OF_ALL_TRIALS = (
    "Each trial's error is weighed by the noise and the spans of the channels in all of these trials; by itself, or beside "
    "others, the same trial may have another."
)


class OpenLoop(Problem):
    """Open loop: the model gets the recorded commands and nothing else.

    ``block`` readings are averaged into a value (fewer, of sensors that were read seldom), ``window`` readings (a multiple)
    are a segment. Rows that an import filled in are simulated and not compared. ``unmodelled`` widens the scales by what a
    calibrated model is known to leave; ``gained``: energy that an effect took off an untouched robot.
    ``before``: what the model is believed to have; the spread of ``members`` neighbours of that model weighs the
    residuals. ``scale``: of the channels, where it is known. ``parts``: the stretches of the trials that are compared, where
    these are long; each trial as a whole where none are given.
    """

    way = "open_loop"

    def __init__(
        self,
        trials: Sequence[MeasuredTrial],
        robot: Robot,
        evaluator: Evaluator,
        block: int = 4,
        window: int = 60,
        unmodelled: Unmodelled | None = None,
        gained: float = 0.0,
        before: Hypothesis = (),
        members: int = MEMBERS,
        scale: Scale | None = None,
        parts: Sequence[Stretch] = (),
    ) -> None:
        self.robot, self.measured, self.evaluator = robot, tuple(trials), evaluator
        self.soft = FIRM if self._touches_nothing else SOFT
        spacing = reading_s(trials)
        self.block = block if not spacing else min(block, max(1, round(BLOCK_S / spacing)))
        self._whole: OpenLoop | None = None
        self.parts = tuple(parts) or in_one_go(robot, trials)
        trials = [p.run for p in self.parts]
        self._rows = [len(t.log.readings) for t in trials]
        # Of a single window nothing could be held out.
        window = min(window, sum(self._rows) // 2)
        self.window = max(1, window // self.block) * self.block
        block, window = self.block, self.window
        self._members, self._before = members, before
        self.shared_by_trials = OF_ALL_TRIALS if len(self.measured) > 1 else ""
        self._set_ups = SetUps()
        self.scale = scale or channel_scale(robot, self.measured)
        self._unmodelled, self.gained, self.calibrated = unmodelled or {}, gained, unmodelled is not None
        self.predictor = Predictor(trials, robot, evaluator, block, window)
        self._looped = tuple(k for k, t in enumerate(trials) if isinstance(t.driver, Network))
        rows = self.predictor.rows
        read = [of_rows(t.log.sensors, r) for t, r in zip(trials, rows, strict=True)]
        # What is simulated has steps only where its sensors are described to.
        self._data = [
            digest_held(values, block, window) if t.commands_held else digest(values, block, window)
            for t, values in zip(trials, read, strict=True)
        ]
        self._moving = [
            moving(values, window, TINY * self.scale.least) if t.commands_held else np.ones_like(d.repeated, dtype=bool)
            for t, values, d in zip(trials, read, self._data, strict=True)
        ]
        if scale is None and self._touches_nothing:
            self.scale = no_more_than_places(self.scale, robot, *self._off(robot), self._changing())
        self.weights = self._weighed(before)
        imported = [self.measured[p.trial].log.filled is not None for p in self.parts]
        self.layout, self.slices = lay_out(robot, self.parts, imported, self.weights, self.soft)
        self.views = Views(
            robot, self.parts, tuple(self.slices), tuple(self._data), self.weights, block, window, self.soft
        )
        self.averaged = f"means over {block * (spacing or robot.time_step_s):.3g} s"
        self.error_definition = (
            "root mean square over channels and time of the residual in standard deviations of its noise "
            f"and of equally good models ({self.averaged}, softened beyond {self.soft:g})"
        )

    @property
    def looped(self) -> tuple[int, ...]:
        return self._looped

    @cached_property
    def searched(self) -> OpenLoop:
        """Of records that would take a search too long some stretches, where these tell as much."""
        if self._whole is not None or not too_long(self.robot, self.measured) or not forgets(self.robot, self.measured):
            return self
        parts = stretches(self.robot, self.measured, self.window)
        some = at_most(parts, enough(self.robot, parts)) if parts else ()
        return self if len(some) == len(parts) else self.of(self.measured, some)

    @property
    def whole(self) -> OpenLoop:
        return self._whole or self

    @property
    def _touches_nothing(self) -> bool:
        """Whether these are logs of a real robot that is bolted down, without a floor."""
        return self.robot.touches_nothing and all(t.real for t in self.measured)

    @cached_property
    def events(self) -> Array:
        """Of a real robot that touches nothing, what its sharpest turns make of a step."""
        found = super().events.copy()
        if not self._touches_nothing:
            return found
        sensors = len(self.robot.sensors)
        found[:, :sensors] = 0.0
        for part, data, deviation in zip(self.parts, self._data, self.weights.deviation, strict=True):
            spacing = reading_s([part.run]) or self.robot.time_step_s
            steps = self.block * spacing / self.robot.time_step_s
            bent = np.diff(data.means.astype(float), n=2, axis=0) / deviation[1:-1] / steps
            found[part.trial, :sensors] += np.sort(bent**2, axis=0)[-AT_ONCE:].sum(axis=0)
        return np.minimum(found, EVENT)

    @cached_property
    def piece_of(self) -> Index:
        return np.repeat(np.arange(len(self.parts)), [s.stop - s.start for s in self.slices])

    def beginning(self, seconds: float) -> Problem:
        if self._whole is not None:
            some = at_most(self.parts, max(2, round(seconds / STRETCH_S)))
            return self if len(some) == len(self.parts) else self.of(self.measured, some)
        rows = [int(np.searchsorted(t.log.times_s, t.log.times_s[0] + seconds)) for t in self.measured]
        if self.looped or sum(rows) > SAVED * sum(len(t.log) for t in self.measured):
            return self
        # What a stretch at rest says of the noise of a channel is not what the whole log says.
        return self.of([replace(t, log=t.log.head(n)) for t, n in zip(self.measured, rows, strict=True)])

    def of(self, trials: Sequence[MeasuredTrial], parts: Sequence[Stretch] = ()) -> OpenLoop:
        """The same of other trials, or of ``parts`` of its own."""
        found = OpenLoop(
            trials,
            self.robot,
            self.evaluator,
            self.block,
            self.window,
            self._unmodelled or None,
            self.gained,
            self._before,
            self._members,
            self.scale,
            parts,
        )
        if parts:
            found._whole = self.whole
        return found

    def _off(self, model: Robot) -> tuple[Array, Array]:
        """(S,) root mean squares of what a model misses, in the units of the channels, and (S,) which were recorded at all."""
        found = self.predictor.digests([(k, self._held([model], k)[0]) for k in range(len(self.parts))])
        gaps = [d.means.astype(float) - p.means for d, p in zip(self._data, found, strict=True)]
        read = row_by_row(gaps, [p.run.recorded(self.robot) for p in self.parts])
        return np.sqrt(means_of(np.concatenate(gaps) ** 2, read)), np.asarray(read.any(axis=0))

    def _changing(self) -> Array:
        """(S,) root mean squares of what each channel changes by in a second, from block to block, without its noise."""
        noise, squares, read = 2.0 * self.scale.noise**2 / self.block, [], []
        for part, data in zip(self.parts, self._data, strict=True):
            changes = np.diff(data.means.astype(float), axis=0)
            lasting = self.block * (reading_s([part.run]) or self.robot.time_step_s)
            squares.append((changes**2 - noise) / lasting**2)
            read.append(changes)
        there = row_by_row(read, [p.run.recorded(self.robot) for p in self.parts])
        return np.sqrt(np.maximum(means_of(np.concatenate(squares), there), 0.0))

    def _weighed(self, before: Hypothesis) -> Weights:
        models = [apply(self.robot, before)]
        models += ensemble(models[0], self._members)
        parts = range(len(self.parts))
        known = [of_trial(self._unmodelled, p.run.name, len(self.robot.sensors)) ** 2 for p in self.parts]
        held = [self._held(models, k) for k in parts]
        return weigh(self.predictor, self._data, self._moving, self.scale, known, held, self._touches_nothing)

    @cached_property
    def trust(self) -> tuple[float, ...]:
        quiet = np.array([s.kind != "touch" for s in self.robot.sensors])
        alone = self.scale.scale**2 / self.block
        each = zip(self.weights.deviation, self.weights.own, strict=True)
        widened = np.array([float(np.mean((d**2 / alone)[:, own[quiet[own]]])) for d, own in each])
        of = np.array([p.trial for p in self.parts])
        return tuple(float(1.0 / np.mean(widened[of == k])) for k in range(len(self.measured)))

    def shows(self, effect: str, target: str) -> bool:
        """Where most sensors repeat readings, or are rough, that one is so too says nothing; a simulation knows when it commands;
        and a stretch says nothing of what an integral has added up before it."""
        if effect == STAMPED_LATE and not all(t.real for t in self.measured):
            return False
        if effect == INTEGRAL and self._whole is not None:
            return False
        alike = self.weights.repeating if effect in REPEATING else self.weights.rugged if effect == ROUGH else ()
        if not alike:
            return super().shows(effect, target)
        members = members_of(self.robot, target, self.robot.sensor_names) or (target,)
        return not any(x.kind in alike for x in self.robot.sensors if x.name in members)

    @property
    def notes(self) -> list[str]:
        lines = super().notes + uncompared(self.weights.repeating, self.weights.rugged)
        if forgets(self.robot, self.measured):
            lines += begun_in_motion([t.name for t in self.measured if unsettled(t, self.robot)])
        lines += counted_less(self.scale.loosened, self.scale.of_lag)
        if self._whole is not None:
            compared = sum(self._rows) * (reading_s(self.measured) or self.robot.time_step_s)
            lasting = sum(float(t.log.times_s[-1] - t.log.times_s[0]) for t in self.measured)
            lines.append(some_of_it(len(self.parts), compared, lasting))
        return lines

    def residuals(self, hypotheses: Sequence[Hypothesis], trials: Sequence[int] | None = None) -> Array:
        """(H, n), as the contract says. Raises EffectError for a hypothesis that does not fit the robot."""
        own = None if trials is None else set(trials)
        return self.residuals_of_pieces(
            hypotheses, [k for k, p in enumerate(self.parts) if own is None or p.trial in own]
        )

    def residuals_of_pieces(self, hypotheses: Sequence[Hypothesis], pieces: Collection[int]) -> Array:
        models, chosen = applied(self.robot, hypotheses), sorted(pieces)
        out = np.zeros((len(models), len(self.segment_of)))
        size = max(1, TOGETHER // max(1, len(self.segment_of)))
        for k in range(0, len(models), size):
            self._fill(out[k : k + size], models[k : k + size], chosen)
        return out

    def _fill(self, out: Array, models: Sequence[Robot], chosen: Sequence[int]) -> None:
        """Residuals (H, n) of some models on the chosen parts, into ``out``."""
        digests = self.predictor.digests([(k, m) for k in chosen for m in self._held(models, k)])
        for place, k in enumerate(chosen):
            mine, trial = digests[place * len(models) : (place + 1) * len(models)], self.parts[k].run
            first, last = self.slices[k].start, self.slices[k].stop
            if isinstance(trial.driver, Network):
                sent = command_residuals(trial, models, self.robot, self.block, self.soft)
                out[:, last - sent.shape[1] : last] = sent
                last -= sent.shape[1]
            for row, d in zip(out, mine, strict=True):
                row[first:last] = residual_of(self._data[k], d, self.weights, k, self._moving[k], self.robot, self.soft)

    def _held(self, models: Sequence[Robot], part: int) -> list[Robot]:
        """The models as they are held in a part of a trial; those held alike share them, for a robot's digest is not free."""
        run = self.parts[part].run
        held = self._set_ups.held(models, run.setup)
        return held if run.begun is None else [run.begun.later(m) for m in held]

    def noise_floor(self) -> tuple[float, str]:
        source = self.scale.source
        return float(np.sqrt(self.floor.mean())), f"{source}, and what calibration left" if self._unmodelled else source

    def smooth(self, residual: Array) -> Array:
        """Before softening."""
        return self.views.smooth(residual)

    def beside(self, residual: Array, channel: int) -> list[Beside]:
        """By the means of blocks."""
        return self.views.beside(residual, channel)

    def raw(self, residual: Array) -> Array:
        """(n,) in the units of the channels; NaN where the texture of a channel is compared."""
        return self.views.raw(residual)

    def series(self, hypothesis: Hypothesis) -> list[Series]:
        """What every channel of every trial reported, and should have reported without noise."""
        return self.views.series(self.predicted(hypothesis))

    def remarks(self, hypothesis: Hypothesis) -> list[str]:
        return [*self.other_errors(hypothesis), *self.spoiled(hypothesis)]

    def spoiled(self, model: Hypothesis) -> list[str]:
        return fallen(self.robot, self.measured, motions(self, model)) if self.robot.free_base else []

    def other_errors(self, *models: Hypothesis) -> list[str]:
        """In the units of the channels: root mean squares over all rows, by kind of sensor."""
        parts = told_in_units([self._in_units(m) for m in models])
        return [f"Root mean squares over all rows of these trials: {'; '.join(parts)}."] if parts else []

    def farther_off(self, before: Hypothesis, after: Hypothesis, fell: bool) -> str:
        came = set(after).symmetric_difference(before)
        if all(find(t.effect).family == "sensing" for t in came):
            # Noise that a channel has makes no prediction nearer.
            return ""
        return farther_off(self._in_units(before), self._in_units(after), fell)

    def _in_units(self, model: Hypothesis) -> InUnits:
        return in_units(self.whole.series(model), self.robot.sensors)

    def simulated(self, hypothesis: Hypothesis, beside: Sequence[Sensor] = ()) -> list[SensorLog | None]:
        believed = apply(self.robot, hypothesis)
        rollouts = [shown(rollout_of(t, apply(believed, t.setup)), beside) for t in self.measured]
        return list(self.evaluator.evaluate([Job(r, Whole()) for r in rollouts]))

    def predicted(self, hypothesis: Hypothesis) -> list[Array]:
        """What the channels should have reported, without noise: (T, S) by trial, or by stretch."""
        model, runs = apply(self.robot, hypothesis), [p.run for p in self.parts]
        models = [self._held([model], k)[0] for k in range(len(runs))]
        rollouts = [rollout_of(t, m) for t, m in zip(runs, models, strict=True)]
        jobs = [Job(r, ToSensors(t.early(self.robot))) for t, r in zip(runs, rollouts, strict=True)]
        true = self.evaluator.evaluate(jobs)
        return [report(m, v) for m, v in zip(models, true, strict=True)]
