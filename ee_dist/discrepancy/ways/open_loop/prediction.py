"""What a hypothesis predicts for a measured trial, on the commands that were recorded (open loop).

Sensors do not act back on a robot whose commands are given, so the physics of a hypothesis is simulated with clean
sensors and what its sensors would report is computed afterwards: hypotheses about sensors share one rollout.
"""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import lru_cache
from typing import Any

import numpy as np

from ee_dist.discrepancy.measured_trial import MeasuredTrial, released
from ee_dist.discrepancy.starting import start_of, starts_beside
from ee_dist.discrepancy.steps import centred
from ee_dist.engines.contract import Rollout
from ee_dist.engines.drivers import Commands, Controllers, Network, advanced, command_scaling
from ee_dist.engines.sensing import SensingPath
from ee_dist.evaluation.jobs import Evaluator, Job
from ee_dist.robots.limbs import Limb, limbs, whole
from ee_dist.robots.model import Robot, Sensor, Wiring
from ee_dist.trials.log import Array, SensorLog, State

_SENSOR_FAULTS: dict[str, Any] = {
    f.name: f.default for f in fields(Sensor) if f.name not in ("name", "kind", "target", "unit")
}


KEPT = 100
"""Commands as drives obey them that are kept, of trials and wirings."""
DRAWS = 8
"""Draws of the noise of a faulty channel, whose mean roughness is compared with the measured one."""
DRAWN = 5_000_000
"""Drawn values that are in memory together, some times over: of long logs the draws of a few models."""


def roughness(values: Array) -> Array:
    """(T, S) -> (T, S): squared second difference / 6, whose mean is the variance of white noise on a smooth signal."""
    out = np.zeros_like(values)
    if len(values) > 2:
        out[1:-1] = (values[2:] - 2.0 * values[1:-1] + values[:-2]) ** 2 / 6.0
    return out


def repeats(values: Array) -> Array:
    """(T, S) -> (T, S): 1 where a value is exactly the one before it."""
    out = np.zeros_like(values)
    out[1:] = values[1:] == values[:-1]
    return out


def block_sums(values: Array, size: int) -> Array:
    """(T, S) -> (T // size, S): sums over blocks of rows; rows beyond the last whole block are left out."""
    rows = len(values) // size
    return values[: rows * size].reshape(rows, size, values.shape[1]).sum(axis=1)


@dataclass(frozen=True, eq=False)
class Digest:
    """What is kept of a predicted log of R readings: block means (R // block, S); noise and repeats per window (R // window,
    S)."""

    means: Array
    rough: Array
    repeated: Array
    finite: bool


@dataclass(frozen=True)
class ToDigest:
    """The reduction that makes one, of the ``rows`` in which the measured sensors were read; of all where it is None. Of
    channels that are ``early`` see ``centred``."""

    block: int
    window: int
    rows: tuple[int, ...] | None = None
    early: tuple[int, ...] = ()

    @property
    def key(self) -> str:
        return f"digest:{self.block}:{self.window}{_of_read(self.rows)}{_of_early(self.early)}"

    def __call__(self, log: SensorLog) -> Digest:
        return digest(of_rows(centred(log.sensors, self.early), self.rows), self.block, self.window)


@dataclass(frozen=True)
class ToSensors:
    """The reduction that keeps the channels (T, S)."""

    early: tuple[int, ...] = ()

    @property
    def key(self) -> str:
        return f"sensors{_of_early(self.early)}"

    def __call__(self, log: SensorLog) -> Array:
        return centred(np.array(log.sensors), self.early)


@lru_cache(maxsize=1024)
def _of_read(rows: tuple[int, ...] | None) -> str:
    """Of hundreds of rows, asked for with each rollout of a stretch."""
    return "" if rows is None else f":{hashlib.sha256(repr(rows).encode()).hexdigest()}"


def _of_early(columns: Sequence[int]) -> str:
    return f":early{tuple(columns)}" if columns else ""


def rows_read(log: SensorLog) -> tuple[int, ...] | None:
    """The rows in which the sensors of a measured log were read; None where that is all of them."""
    return None if log.filled is None else tuple(log.readings.tolist())


def of_rows(values: Array, rows: Sequence[int] | None) -> Array:
    """(T, ...) -> (R, ...)."""
    return values if rows is None else values[list(rows)]


def digest(sensors: Array, block: int, window: int) -> Digest:
    """The digest of channels (T, S)."""
    # A motion that flies apart may be finite where it was computed and not where it is kept: it must not pass for one that is.
    with np.errstate(over="ignore", invalid="ignore"):
        means = (block_sums(sensors, block) / block).astype(np.float32)
        rough = (block_sums(roughness(sensors), window) / window).astype(np.float32)
        still = (block_sums(repeats(sensors), window) / window).astype(np.float32)
    return Digest(means, rough, still, all(bool(np.isfinite(v).all()) for v in (sensors, means, rough)))


@lru_cache(4096)
def _faultless(sensor: Sensor) -> Sensor:
    return replace(sensor, **_SENSOR_FAULTS)


def clean(robot: Robot) -> Robot:
    """The robot with perfect sensors and straight wiring: what is left for the engine once commands are given."""
    sensors = tuple(map(_faultless, robot.sensors))
    wiring = Wiring(tuple(range(len(robot.drives))), robot.wiring.hidden_gain)
    neutral = replace(wiring, hidden_gain=tuple(1.0 for _ in wiring.hidden_gain))
    return replace(robot, sensors=sensors, wiring=neutral)


def wired_commands(trial: MeasuredTrial, model: Robot) -> Commands:
    """What the drives obey. Planned commands pass through the model's wiring; those of a network were recorded behind it."""
    if isinstance(trial.driver, Network):
        return Commands(trial.log.commands)
    planned = trial.driver.values if isinstance(trial.driver, Commands) else trial.log.commands
    given = advanced(trial.obeyed(planned[: len(trial.log)], model), model.wiring.early_s, model.time_step_s)
    return Commands(np.ascontiguousarray(given[:, list(model.wiring.source)]))


Obeyed = tuple[Commands, Array | None]
"""What drives obey, and (T,) 0 where they were released, if they were."""


def obeyed(trial: MeasuredTrial, model: Robot) -> Obeyed:
    commands, enabled = released(wired_commands(trial, model).values)
    return Commands(commands), enabled


def rollout_of(trial: MeasuredTrial, model: Robot, bare: Robot | None = None, given: Obeyed | None = None) -> Rollout:
    """The physics of a model on the trial's own commands, with clean sensors (``bare``: the model as it is simulated, and
    ``given``: what its drives obey, if these are at hand already)."""
    commands, enabled = given or obeyed(trial, model)
    start = start_of(trial, model)
    return Rollout(
        bare or trial.simulated(clean(model)),
        commands,
        len(trial.log),
        start=start,
        supply_v=trial.log.supply_v,
        enabled=enabled,
        external=trial.log.external,
    )


class Predictor:
    """Predictions for many models at once. ``block``, ``window``: readings that a mean and a window span."""

    def __init__(
        self, trials: Sequence[MeasuredTrial], base: Robot, evaluator: Evaluator, block: int, window: int
    ) -> None:
        self.trials, self.base, self.evaluator = trials, base, evaluator
        self.block, self.window = block, window
        self.rows = [rows_read(t.log) for t in trials]
        self._obeyed: dict[tuple[int, tuple[float, ...]], Obeyed] = {}
        self._told: dict[tuple[int, tuple[int, ...]], tuple[Commands, Commands]] = {}
        """What drives of a limb obey, by what those of all of the robot do."""
        self._only_noisy = [replace(s, noise=0.0) == _faultless(s) for s in base.sensors]

    def digests(self, pairs: Sequence[tuple[int, Robot]]) -> list[Digest]:
        """Digests for (trial, model) pairs, simulated in one call."""
        changed = {id(m): self._changed(m) for _, m in pairs}
        bare: dict[tuple[int, bool | None], tuple[Robot, tuple[Limb, ...]]] = {}
        for k, model in pairs:
            which = id(model), self.trials[k].commands_held
            if which not in bare:
                robot = self.trials[k].simulated(clean(model))
                bare[which] = robot, limbs(robot)
        split = shared([(k, *bare[id(m), self.trials[k].commands_held]) for k, m in pairs])
        jobs = [
            job
            for (k, model), some in zip(pairs, split, strict=True)
            for job in self._jobs(k, model, some, bool(changed[id(model)]))
        ]
        each = iter(self.evaluator.evaluate(jobs))
        found = [joined(some, [next(each) for _ in some]) for some in split]
        out: list[Digest] = list(found)
        alike: dict[tuple[int, ...], list[int]] = {}
        for i, (k, model) in enumerate(pairs):
            if channels := changed[id(model)]:
                alike.setdefault((k, *(int(model.sensors[c].kind == "touch") for c in channels)), []).append(i)
            else:
                out[i] = self._with_declared_noise(found[i])
        for (k, *_), members in alike.items():
            size = max(1, DRAWN // (DRAWS * len(self.trials[k].log) * len(changed[id(pairs[members[0]][1])])))
            for first in range(0, len(members), size):
                some = members[first : first + size]
                faulty = [(pairs[i][1], found[i], changed[id(pairs[i][1])]) for i in some]
                for i, seen in zip(some, self._reported(k, faulty), strict=True):
                    out[i] = seen
        return out

    def _jobs(self, trial: int, model: Robot, parts: Sequence[Limb], channels: bool) -> list[Job]:
        """One of each limb, for its ``channels`` or for their digest."""
        early = self.trials[trial].early(self.base)
        all_of_it = rollout_of(self.trials[trial], model, parts[0].robot, self._given(trial, model))
        jobs = []
        for limb in parts:
            own = tuple(i for i, c in enumerate(limb.sensors) if c in early)
            reduction = ToSensors(own) if channels else ToDigest(self.block, self.window, self.rows[trial], own)
            jobs.append(Job(all_of_it if len(parts) == 1 else self._alone(limb, all_of_it), reduction))
        return jobs

    def _alone(self, limb: Limb, of: Rollout) -> Rollout:
        """The same of one limb."""
        motors, start = list(limb.motors), of.start
        assert isinstance(of.driver, Commands)
        key = id(of.driver), limb.motors
        if key not in self._told:
            # The commands of the whole are kept as well, so that their identity cannot become another's.
            self._told[key] = of.driver, Commands(np.ascontiguousarray(of.driver.values[:, motors]))
        if start is not None:
            goals = None if start.goals is None else start.goals[:, motors]
            start = State(start.joints[motors], start.speeds[motors], goals=goals)
        external = None if of.external is None else np.ascontiguousarray(of.external[:, motors])
        return replace(of, model=limb.robot, driver=self._told[key][1], start=start, external=external)

    def _given(self, trial: int, model: Robot) -> Obeyed:
        """Models of one wiring share the very array, which so goes to a worker once."""
        key = trial, (*model.wiring.source, model.wiring.early_s)
        if key not in self._obeyed:
            if len(self._obeyed) > KEPT:
                # A search tries ever other times.
                self._obeyed.clear()
                self._told.clear()
            self._obeyed[key] = obeyed(self.trials[trial], model)
        return self._obeyed[key]

    def by_start(self, trial: int, model: Robot) -> Array:
        """(R // block, S) mean squares of block means by which the noise of the speeds that a trial starts with moves them."""
        measured = self.trials[trial]
        moved = np.zeros((len(measured.log.readings) // self.block, len(self.base.sensors)))
        starts = starts_beside(measured, model)
        if not starts:
            return moved
        own = rollout_of(measured, model)
        reduction = ToDigest(self.block, self.window, self.rows[trial], measured.early(self.base))
        jobs = [Job(r, reduction) for r in (own, *(replace(own, start=s) for s in starts))]
        found: list[Digest] = list(self.evaluator.evaluate(jobs))
        if found[0].finite:
            for d in found[1:]:
                moved += (d.means.astype(float) - found[0].means) ** 2 if d.finite else 0.0
        return moved

    def _changed(self, model: Robot) -> list[int]:
        """The channels whose report takes more than adding the noise that the base model declares."""
        return [
            i
            for i, (s, declared) in enumerate(zip(model.sensors, self.base.sensors, strict=True))
            if s != declared or not self._only_noisy[i]
        ]

    def _with_declared_noise(self, found: Digest) -> Digest:
        noise = np.array([s.noise for s in self.base.sensors])
        return replace(found, rough=found.rough + noise**2, repeated=np.where(noise > 0, 0.0, found.repeated))

    def _reported(self, trial: int, members: Sequence[Faulty]) -> list[Digest]:
        """Digests of what members report, whose faulty channels are of the same kinds.

        Noise is the expected one wherever that is known: a draw of it would count against every hypothesis that has a
        faulty sensor. How a faulty channel looks under noise is the mean of some draws.
        """
        steady = reports(members)[:, :, 0]
        drawn = reports(members, [1000 * (d + 1) + trial for d in range(DRAWS)])
        out = []
        for i, (_, true, channels) in enumerate(members):
            clear = true.copy()
            clear[:, channels] = steady[i]
            rows = self.rows[trial]
            shape = self._with_declared_noise(digest(of_rows(clear, rows), self.block, self.window))
            rough, repeated = shape.rough.copy(), shape.repeated.copy()
            grain = digest(of_rows(drawn[i].reshape(len(true), -1), rows), self.block, self.window)
            rough[:, channels] = grain.rough.reshape(-1, DRAWS, len(channels)).mean(axis=1)
            repeated[:, channels] = grain.repeated.reshape(-1, DRAWS, len(channels)).mean(axis=1)
            out.append(replace(shape, rough=rough, repeated=repeated))
        return out


def shared(asked: Sequence[tuple[int, Robot, tuple[Limb, ...]]]) -> list[tuple[Limb, ...]]:
    """Of robots with their limbs, each in a trial, what is simulated by itself: limbs where another one has one of them in the
    same trial, and else all of it at once, which takes less than its limbs one after the other."""
    have = Counter((trial, limb.robot.digest) for trial, _, some in asked if len(some) > 1 for limb in some)
    return [
        some if any(have[trial, limb.robot.digest] > 1 for limb in some) else (whole(robot),)
        for trial, robot, some in asked
    ]


def joined(parts: Sequence[Limb], found: Sequence[Any]) -> Any:
    """What was kept of limbs, digests or channels, as that of all of the robot."""
    if len(parts) == 1:
        return found[0]
    order = np.argsort(np.concatenate([limb.sensors for limb in parts]))
    if not isinstance(found[0], Digest):
        return np.concatenate(found, axis=1)[:, order]
    means, rough, repeated = (
        np.concatenate([getattr(d, name) for d in found], axis=1)[:, order] for name in ("means", "rough", "repeated")
    )
    return Digest(means, rough, repeated, all(d.finite for d in found))


Faulty = tuple[Robot, Array, Sequence[int]]
"""A model, the true values of its channels (T, S), and some of its channels."""


def reports(members: Sequence[Faulty], seeds: Sequence[int] = ()) -> Array:
    """What some sensors of each member report: (B, T, D, C), one D a seed; without random errors, D = 1, if there is none.

    The members' channels are as many, of the same kinds, and their trials as long.
    """
    draws = max(1, len(seeds))
    robots = []
    for model, _, channels in members:
        sensors = tuple(model.sensors[c] for c in channels)
        if not seeds:
            sensors = tuple(replace(s, noise=0.0, dropout=0.0) for s in sensors)
        robots += [replace(model, sensors=sensors)] * draws
    seen = np.stack([true[:, list(channels)] for _, true, channels in members], axis=1)
    each: list[int | None] = [*seeds] if seeds else [None]
    path = SensingPath(robots, robots[0].time_step_s, len(seen), each * len(members))
    found = path.over(np.repeat(seen, draws, axis=1))
    return np.moveaxis(found.reshape(len(seen), len(members), draws, -1), 0, 1)


def report(model: Robot, true: Array) -> Array:
    """What the sensors report of true channels (T, S) when they make no random errors."""
    return np.asarray(reports([(model, true, range(len(model.sensors)))])[0, :, 0])


def predicted_commands(trial: MeasuredTrial, models: Sequence[Robot]) -> Array:
    """(T, B, M): what a trial's network would have commanded through the wiring of each model, given what the sensors
    did report. Exact: the network saw the very numbers in the log."""
    assert isinstance(trial.driver, Network)
    control = Controllers(models, [trial.driver] * len(models), [command_scaling(m) for m in models], len(trial.log))
    dt = models[0].time_step_s
    rows = [control.step(i, i * dt, np.repeat(s[None], len(models), axis=0)) for i, s in enumerate(trial.log.sensors)]
    return np.stack(rows)
