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

from ee_dist.basics.names import counted
from ee_dist.discrepancy.measured_trial import MeasuredTrial, reading_s
from ee_dist.discrepancy.problem import EVENT, Index, Layout, Problem, Series, joints_of
from ee_dist.discrepancy.ways.open_loop.falls import fallen
from ee_dist.discrepancy.ways.open_loop.in_units import InUnits, farther_off, in_units, told_in_units
from ee_dist.discrepancy.ways.open_loop.predictability import MEMBERS, ensemble
from ee_dist.discrepancy.ways.open_loop.prediction import (
    Digest,
    Predictor,
    ToSensors,
    block_sums,
    digest,
    of_rows,
    predicted_commands,
    report,
    rollout_of,
)
from ee_dist.discrepancy.ways.open_loop.scale import Scale, channel_scale
from ee_dist.discrepancy.ways.open_loop.stretches import (
    STRETCH_S,
    Stretch,
    at_most,
    enough,
    forgets,
    in_one_go,
    stretches,
    too_long,
)
from ee_dist.discrepancy.ways.open_loop.texture import REPEATING, by_steps, frozen, moving, repeating
from ee_dist.discrepancy.ways.open_loop.unmodelled import Unmodelled, of_trial
from ee_dist.effects.catalogue import Hypothesis, applied, apply, find
from ee_dist.effects.groups import members_of
from ee_dist.engines.drivers import Network
from ee_dist.evaluation.jobs import Evaluator, Job, Whole
from ee_dist.robots.model import Robot
from ee_dist.robots.ranges import span
from ee_dist.trials.log import Array, SensorLog

BLOCK_S = 0.04
"""Time that readings are averaged over, where they are taken more seldom than rows are simulated."""
SOFT = 6.0
"""Residuals beyond this many standard deviations count by their logarithm;"""
FIRM = 60.0
"""those of a real robot that touches nothing beyond so many. It misses no contact, and differs from its model in every joint:
where nearly all that is compared is softened, what is right in few rows and far off in the others looks as good as what is
near in all."""
TOGETHER = 4_000_000
"""Residual values that are computed together: of long logs those of a few hypotheses."""
SAVED = 0.6
"""Share of the rows that the beginning of trials may have, to be worth a look by itself."""
AT_ONCE = 16
"""Values that a contact or a reversal is in."""
COMMAND_SHARE = 0.005
"""Scale of a network's commands, as a share of the joint's range: they are computed, not measured."""
TINY = 0.25
"""Share of a channel's scale whose roughness is too small to count."""
_SOFT_FLOOR = {SOFT: 0.974, FIRM: 0.9997}
"""Mean square of soft * asinh(x / soft) for standard normal x."""
_ROUGH_FLOOR = 0.93
"""Mean square of the comparison of roughness, for white noise."""


def soften(values: Array, soft: float = SOFT) -> Array:
    """Nearly the identity up to ``soft``, logarithmic beyond."""
    return np.asarray(soft * np.arcsinh(values / soft))


def _held_up(spread: Array) -> Array:
    """(T, C): mean squares that vary from row to row by luck, each at least the mean of its neighbours."""
    if not len(spread):
        return spread  # fewer readings than a window
    padded = np.pad(spread, ((1, 1), (0, 0)), mode="edge")
    return np.asarray(np.maximum(spread, (padded[:-2] + spread + padded[2:]) / 3.0))


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
        self.parts = tuple(parts) or in_one_go(trials)
        trials = [p.run for p in self.parts]
        self._rows = [len(t.log.readings) for t in trials]
        # Of a single window nothing could be held out.
        window = min(window, sum(self._rows) // 2)
        self.window = max(1, window // self.block) * self.block
        block, window = self.block, self.window
        self._members, self._before = members, before
        self._setups: dict[Hypothesis, dict[int, tuple[Robot, Robot]]] = {}
        self.scale = scale or channel_scale(robot, self.measured)
        self._unmodelled, self.gained, self.calibrated = unmodelled or {}, gained, unmodelled is not None
        self.predictor = Predictor(trials, robot, evaluator, block, window)
        self._looped = tuple(k for k, t in enumerate(trials) if isinstance(t.driver, Network))
        rows = self.predictor.rows
        read = [of_rows(t.log.sensors, r) for t, r in zip(trials, rows, strict=True)]
        # What is simulated has steps only where its sensors are described to.
        self._data = [
            _without_steps(digest(values, block, window), values, window)
            if t.commands_held
            else digest(values, block, window)
            for t, values in zip(trials, read, strict=True)
        ]
        self._moving = [
            moving(values, window) if t.commands_held else np.ones_like(d.repeated, dtype=bool)
            for t, values, d in zip(trials, read, self._data, strict=True)
        ]
        self._weigh(before)
        self._lay_out()
        self.error_definition = (
            "root mean square over channels and time of the residual in standard deviations of its noise "
            f"and of equally good models (means over {block * (spacing or robot.time_step_s):.3g} s, softened beyond "
            f"{self.soft:g})"
        )

    @property
    def looped(self) -> tuple[int, ...]:
        return self._looped

    @property
    def trust(self) -> tuple[float, ...]:
        return self._trust

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
        return not (self.robot.free_base or self.robot.world.has_floor) and all(t.real for t in self.measured)

    @cached_property
    def events(self) -> Array:
        """Of a real robot that touches nothing, what its sharpest turns make of a step."""
        found = super().events.copy()
        if not self._touches_nothing:
            return found
        sensors = len(self.robot.sensors)
        found[:, :sensors] = 0.0
        for part, data, deviation in zip(self.parts, self._data, self.deviation, strict=True):
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

    def _weigh(self, before: Hypothesis) -> None:
        """Standard deviations of block means (blocks, S) and of the log of roughness (windows, S), trial by trial."""
        models = [apply(self.robot, before)]
        models += ensemble(models[0], self._members)
        pairs = [(k, m) for k in range(len(self.parts)) for m in self._held(models, k)]
        found = self.predictor.digests(pairs)
        seen = zip(self._data, found[:: len(models)], self._moving, strict=True)
        self.repeating = repeating(self.robot, seen, self.window)
        self._undeclared = self._rougher(found[:: len(models)])
        self._begun = [self.predictor.by_start(k, held) for k, held in pairs[:: len(models)]]
        self.deviation: list[Array] = []
        self.grain_deviation: list[Array] = []
        for k in range(len(self.parts)):
            mine = found[k * len(models) : (k + 1) * len(models)]
            base, others = mine[0], [d for d in mine[1:] if d.finite]
            noise = self.scale.scale**2 / self.block + self._begun[k] + self._known(k)[0]
            spread = np.zeros_like(base.means, dtype=float)
            grain = np.zeros_like(base.rough, dtype=float)
            if others and base.finite:
                spread = np.mean([(d.means.astype(float) - base.means) ** 2 for d in others], axis=0)
                grain = np.mean([np.log(self._rough(d) / self._rough(base)) ** 2 for d in others], axis=0)
            self.deviation.append(np.sqrt(noise + _held_up(spread)))
            self.grain_deviation.append(np.sqrt(2 * 1.95 / self.window + 0.01 + self._known(k)[1] + _held_up(grain)))

        quiet = np.array([s.kind != "touch" for s in self.robot.sensors])
        alone = self.scale.scale**2 / self.block
        widened = np.array([float(np.mean((d**2 / alone)[:, quiet])) for d in self.deviation])
        of = np.array([p.trial for p in self.parts])
        self._trust = tuple(float(1.0 / np.mean(widened[of == k])) for k in range(len(self.measured)))

    @property
    def _tiny(self) -> Array:
        return (TINY * self.scale.scale) ** 2

    def _rough(self, predicted: Digest) -> Array:
        """(windows, S) of a prediction, with the noise that no description declares."""
        return np.asarray(predicted.rough + self._undeclared + self._tiny)

    def _rougher(self, predicted: Sequence[Digest]) -> Array:
        """(S,) variance of noise where none is declared: by how much channels are rougher than the model's, and no more than
        others of their kind, so that a sensor that is noisier than they are stands out."""
        kinds = np.array([s.kind for s in self.robot.sensors])
        if any(s.noise for s in self.robot.sensors) or not all(p.finite for p in predicted):
            return np.zeros(len(kinds))
        more = np.concatenate([d.rough.astype(float) - p.rough for d, p in zip(self._data, predicted, strict=True)])
        own = np.clip(np.median(more, axis=0), 0.0, self.scale.noise**2) if len(more) else np.zeros(len(kinds))
        usual = {
            kind: np.median(own[kinds == kind]) if (kinds == kind).sum() > 2 else own[kinds == kind].min()
            for kind in kinds
        }
        return np.minimum(own, [usual[kind] for kind in kinds])

    def shows(self, effect: str, target: str) -> bool:
        """Where most sensors repeat readings, that one does so too says nothing."""
        if effect not in REPEATING:
            return super().shows(effect, target)
        members = members_of(self.robot, target, self.robot.sensor_names) or (target,)
        return not any(x.kind in self.repeating for x in self.robot.sensors if x.name in members)

    @property
    def notes(self) -> list[str]:
        lines = super().notes + [
            f"Most {kind} sensors repeat readings more often than the model's (coarse steps, rows that were filled "
            "in): how often they do is not compared."
            for kind in sorted(self.repeating)
        ]
        if self._whole is not None:
            compared = sum(self._rows) * (reading_s(self.measured) or self.robot.time_step_s)
            lasting = sum(float(t.log.times_s[-1] - t.log.times_s[0]) for t in self.measured)
            lines.append(
                f"So that the search ends, it goes by {counted(len(self.parts), 'stretch', 'stretches')} of {lasting:.0f} s, "
                f"{compared:.0f} s together, each begun from the measured positions; compare takes all of it."
            )
        return lines

    def _known(self, part: int) -> Array:
        """(2, S) mean squares that calibration left in the trial of a part: of block means, and of the log of roughness."""
        return of_trial(self._unmodelled, self.parts[part].run.name, len(self.robot.sensors)) ** 2

    def _lay_out(self) -> None:
        """Segments, channels and floors of all residual values, trial after trial."""
        names: list[str] = []
        seg: list[Array] = []
        chan: list[Array] = []
        floor: list[Array] = []
        known: list[Array] = []
        time: list[Array] = []
        reading: list[Array] = []
        trial_of_segment: list[int] = []
        self.slices: list[slice] = []
        s, per = len(self.robot.sensors), self.window // self.block
        at = 0
        # How far noise moves the log of roughness beside what is too small to count, as a share of what it does alone.
        noise = self.scale.noise**2
        noisy = (noise / (noise + self._tiny) * (1.0 + TINY**2)) ** 2
        pure = 2 * 1.95 / self.window + 0.01
        for k, (number, trial) in enumerate((p.trial, p.run) for p in self.parts):
            blocks, windows = self._rows[k] // self.block, self._rows[k] // self.window
            first = len(names)
            count = max(1, windows)
            names += [f"{trial.name}@{self._begins(k, w):.1f}s" for w in range(count)]
            trial_of_segment += [number] * count
            of_block = first + np.minimum(np.arange(blocks) // per, count - 1)
            seg += [np.repeat(of_block, s), np.repeat(first + np.arange(windows), 2 * s)]
            chan += [np.tile(np.arange(s), blocks), np.tile(np.arange(s), 2 * windows)]
            middle = self._middles(k, self.block)
            time += [np.repeat(middle, s), np.repeat(self._middles(k, self.window), 2 * s)]
            reading += [np.ones(blocks * s, dtype=bool), np.zeros(2 * windows * s, dtype=bool)]
            left = self._known(k)[0] / self.deviation[k] ** 2
            share = (self.scale.noise**2 / self.block + self._begun[k]) / self.deviation[k] ** 2 + left
            rough = _ROUGH_FLOOR * self._known(k)[1] / self.grain_deviation[k] ** 2
            grain = _ROUGH_FLOOR * noisy * pure / self.grain_deviation[k] ** 2 + rough
            texture = np.stack([grain, np.zeros_like(grain)], axis=1)
            floor += [share.ravel() * _SOFT_FLOOR[self.soft], texture.ravel()]
            known += [left.ravel() * _SOFT_FLOOR[self.soft], np.stack([rough, np.zeros_like(rough)], axis=1).ravel()]
            if isinstance(trial.driver, Network):
                m = len(self.robot.drives)
                seg.append(np.repeat(of_block, m))
                chan.append(np.tile(s + np.arange(m), blocks))
                time.append(np.repeat(middle, m))
                reading.append(np.zeros(m * blocks, dtype=bool))
                floor.append(np.zeros(m * blocks))
                known.append(np.zeros(m * blocks))
            size = sum(map(len, seg)) - at
            self.slices.append(slice(at, at + size))
            at += size
        robot, computed = self.robot, self.robot.motor_names if self.looped else ()
        self.layout = Layout(
            segments=tuple(names),
            trial_of_segment=np.array(trial_of_segment),
            segment_of=np.concatenate(seg).astype(np.int64),
            channel_of=np.concatenate(chan).astype(np.int64),
            time_s=np.concatenate(time),
            reading=np.concatenate(reading).astype(bool),
            floor=np.concatenate(floor),
            known=np.concatenate(known),
            channels=(*robot.sensor_names, *(f"command_{m}" for m in computed)),
            units=(*(x.unit for x in robot.sensors), *(joint_unit(robot, m) for m in computed)),
            joint_of_channel=joints_of(robot, [*(x.target for x in robot.sensors), *computed]),
        )

    def _begins(self, part: int, window: int) -> float:
        """When a window begins, s."""
        log, row = self.parts[part].run.log, window * self.window
        return row * self.robot.time_step_s if log.filled is None else float(log.times_s[log.readings[row]])

    def _middles(self, part: int, size: int) -> Array:
        """(R // size,) middles of so many readings in a row, s."""
        own, count = self.parts[part], self._rows[part] // size
        log, step = own.run.log, self.robot.time_step_s
        if log.filled is None:
            return (np.arange(count) + 0.5) * size * step
        # What is read in every row stands for a step, of which its time is the beginning.
        half = step / 2 if self.measured[own.trial].log.filled is None else 0.0
        return block_sums(log.times_s[log.readings][:, None], size)[:, 0] / size + half

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
                sent = self._command_residuals(trial, models)
                out[:, last - sent.shape[1] : last] = sent
                last -= sent.shape[1]
            for row, d in zip(out, mine, strict=True):
                row[first:last] = self._compare(k, d)

    def _held(self, models: Sequence[Robot], part: int) -> list[Robot]:
        """The models as they are held in a part of a trial; those held alike share them, for a robot's digest is not free."""
        run = self.parts[part].run
        held = self._set_up(models, run.setup)
        return held if run.begun is None else [run.begun.later(m) for m in held]

    def _set_up(self, models: Sequence[Robot], setup: Hypothesis) -> list[Robot]:
        if not setup:
            return list(models)
        known = self._setups.setdefault(setup, {})
        for m in models:
            if id(m) not in known:
                known[id(m)] = (m, apply(m, setup))
        held = [known[id(m)][1] for m in models]
        if len(known) > 2000:
            known.clear()
        return held

    def _compare(self, part: int, predicted: Digest) -> Array:
        measured = self._data[part]
        if not predicted.finite:
            return np.full(measured.means.size + 2 * measured.rough.size, np.inf)
        shape = (measured.means.astype(float) - predicted.means) / self.deviation[part]
        grain = np.log((measured.rough + self._tiny) / self._rough(predicted)) / self.grain_deviation[part]
        compared = np.array([x.kind not in self.repeating for x in self.robot.sensors])
        texture = np.stack([grain, frozen(measured, predicted, self.window) * compared * self._moving[part]], axis=1)
        return np.concatenate([soften(shape, self.soft).ravel(), soften(texture, self.soft).ravel()])

    def _command_residuals(self, trial: MeasuredTrial, models: Sequence[Robot]) -> Array:
        spans = _spans(self.robot)
        sent = predicted_commands(trial, models)
        rows = len(trial.log) // self.block * self.block
        gap = (trial.log.commands[:, None] - sent)[:rows].reshape(-1, self.block, *sent.shape[1:]).mean(axis=1)
        values = soften(gap / (COMMAND_SHARE * spans), self.soft)
        return np.ascontiguousarray(np.moveaxis(values, 1, 0)).reshape(len(models), -1)

    def noise_floor(self) -> tuple[float, str]:
        source = self.scale.source
        return float(np.sqrt(self.floor.mean())), f"{source}, and what calibration left" if self._unmodelled else source

    def smooth(self, residual: Array) -> Array:
        """Before softening."""
        return np.asarray(self.soft * np.sinh(residual / self.soft))

    # -- views of a residual -----------------------------------------------------------------------------------------

    def blocks(self, part: int, residual: Array) -> Array:
        """(R // block, S): the part of a residual (n,) that compares means, of one part with R readings."""
        rows, s = self._rows[part] // self.block, len(self.robot.sensors)
        return residual[self.slices[part]][: rows * s].reshape(rows, s)

    def raw_blocks(self, part: int, residual: Array) -> Array:
        """The same before softening, in the units of the channels."""
        return np.asarray(self.smooth(self.blocks(part, residual)) * self.deviation[part])

    def raw_grain(self, part: int, residual: Array) -> Array:
        """(R // window, S): differences of the log of roughness, before softening."""
        rows, s = self._rows[part], len(self.robot.sensors)
        first, windows = rows // self.block * s, rows // self.window
        texture = residual[self.slices[part]][first : first + 2 * s * windows].reshape(windows, 2, s)[:, 0]
        return np.asarray(self.smooth(texture) * self.grain_deviation[part])

    def raw(self, residual: Array) -> Array:
        """(n,) in the units of the channels; NaN where the texture of a channel is compared."""
        out = np.full(len(residual), np.nan)
        for k, part in enumerate(self.slices):
            values = self.raw_blocks(k, residual).ravel()
            out[part.start : part.start + len(values)] = values
            if isinstance(self.parts[k].run.driver, Network):
                spans = COMMAND_SHARE * _spans(self.robot)
                sent = residual[part][-len(self._data[k].means) * len(spans) :].reshape(-1, len(spans))
                out[part.stop - sent.size : part.stop] = (self.smooth(sent) * spans).ravel()
        return out

    def series(self, hypothesis: Hypothesis) -> list[Series]:
        """What every channel of every trial reported, and should have reported without noise."""
        out = []
        for part, values in zip(self.parts, self.predicted(hypothesis), strict=True):
            log, read = part.run.log, part.run.log.readings
            for c, sensor in enumerate(self.robot.sensors):
                out.append(Series(part.trial, c, sensor.unit, log.times_s[read], log.sensors[read, c], values[read, c]))
        return out

    def remarks(self, hypothesis: Hypothesis) -> list[str]:
        return [*self.other_errors(hypothesis), *self.spoiled(hypothesis)]

    def spoiled(self, model: Hypothesis) -> list[str]:
        return fallen(self.robot, self.measured, self.simulated(model)) if self.robot.free_base else []

    def other_errors(self, *models: Hypothesis) -> list[str]:
        """In the units of the channels: root mean squares over all rows, by kind of sensor."""
        parts = told_in_units([self._in_units(m) for m in models])
        return [f"Root mean squares over all rows of these trials: {'; '.join(parts)}."] if parts else []

    def farther_off(self, before: Hypothesis, after: Hypothesis) -> str:
        came = set(after).symmetric_difference(before)
        if all(find(t.effect).family == "sensing" for t in came):
            # Noise that a channel has makes no prediction nearer.
            return ""
        return farther_off(self._in_units(before), self._in_units(after))

    def _in_units(self, model: Hypothesis) -> InUnits:
        return in_units(self.whole.series(model), self.robot.sensors)

    def simulated(self, hypothesis: Hypothesis) -> list[SensorLog | None]:
        believed = apply(self.robot, hypothesis)
        rollouts = [replace(rollout_of(t, apply(believed, t.setup)), pose=True) for t in self.measured]
        return list(self.evaluator.evaluate([Job(r, Whole()) for r in rollouts]))

    def predicted(self, hypothesis: Hypothesis) -> list[Array]:
        """What the channels should have reported, without noise: (T, S) by trial, or by stretch."""
        model, runs = apply(self.robot, hypothesis), [p.run for p in self.parts]
        models = [self._held([model], k)[0] for k in range(len(runs))]
        rollouts = [rollout_of(t, m) for t, m in zip(runs, models, strict=True)]
        jobs = [Job(r, ToSensors(t.early(self.robot))) for t, r in zip(runs, rollouts, strict=True)]
        true = self.evaluator.evaluate(jobs)
        return [report(m, v) for m, v in zip(models, true, strict=True)]


def _without_steps(found: Digest, values: Array, window: int) -> Digest:
    """The digest of a real log (R, S) without repeats that its sensors' steps explain."""
    return replace(
        found, repeated=np.maximum(found.repeated - by_steps(values, window), 0.0).astype(found.repeated.dtype)
    )


def _spans(robot: Robot) -> Array:
    """(M,) ranges of the driven joints."""
    return np.array([high - low for low, high in (span(robot.joint(d.joint)) for d in robot.drives)])


def joint_unit(robot: Robot, joint: str) -> str:
    return "m" if robot.joint(joint).kind == "slide" else "rad"
