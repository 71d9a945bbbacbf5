"""What a hypothesis predicts for a measured trial, on the commands that were recorded (open loop).

Sensors do not act back on a robot whose commands are given, so the physics of a hypothesis is simulated with clean
sensors and what its sensors would report is computed afterwards: hypotheses about sensors share one rollout.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from ee_dist.discrepancy.measured import MeasuredTrial, released, start_of
from ee_dist.engines.contract import Rollout
from ee_dist.engines.drivers import Commands, Controllers, Network, scaling
from ee_dist.engines.sensing import SensingPath
from ee_dist.evaluation.jobs import Evaluator, Job
from ee_dist.robots.model import Robot, Sensor, Wiring
from ee_dist.trials.log import Array, SensorLog

_SENSOR_FAULTS: dict[str, Any] = {
    f.name: f.default for f in fields(Sensor) if f.name not in ("name", "kind", "target", "unit")
}


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
    """What is kept of a predicted log: block means (T // block, S); noise and repeats per window (T // window, S)."""

    means: Array
    rough: Array
    repeated: Array
    finite: bool


@dataclass(frozen=True)
class ToDigest:
    """The reduction that makes one."""

    block: int
    window: int

    @property
    def key(self) -> str:
        return f"digest:{self.block}:{self.window}"

    def __call__(self, log: SensorLog) -> Digest:
        return digest(log.sensors, self.block, self.window)


@dataclass(frozen=True)
class ToSensors:
    """The reduction that keeps the channels (T, S)."""

    key: str = "sensors"

    def __call__(self, log: SensorLog) -> Array:
        return np.array(log.sensors)


def digest(sensors: Array, block: int, window: int) -> Digest:
    """The digest of channels (T, S)."""
    return Digest(
        (block_sums(sensors, block) / block).astype(np.float32),
        (block_sums(roughness(sensors), window) / window).astype(np.float32),
        (block_sums(repeats(sensors), window) / window).astype(np.float32),
        bool(np.isfinite(sensors).all()),
    )


def clean(robot: Robot) -> Robot:
    """The robot with perfect sensors and straight wiring: what is left for the engine once commands are given."""
    sensors = tuple(replace(s, **_SENSOR_FAULTS) for s in robot.sensors)
    wiring = Wiring(tuple(range(len(robot.drives))), robot.wiring.hidden_gain)
    neutral = replace(wiring, hidden_gain=tuple(1.0 for _ in wiring.hidden_gain))
    return replace(robot, sensors=sensors, wiring=neutral)


def wired_commands(trial: MeasuredTrial, model: Robot) -> Commands:
    """What the drives obey. Planned commands pass through the model's wiring; those of a network were recorded behind it."""
    if isinstance(trial.driver, Network):
        return Commands(trial.log.commands)
    planned = trial.driver.values if isinstance(trial.driver, Commands) else trial.log.commands
    return Commands(np.ascontiguousarray(planned[: len(trial.log)][:, list(model.wiring.source)]))


def rollout_of(trial: MeasuredTrial, model: Robot, bare: Robot | None = None) -> Rollout:
    """The physics of a model on the trial's own commands, with clean sensors (``bare``, if it is at hand already)."""
    commands, enabled = released(wired_commands(trial, model).values)
    start = start_of(trial.log, model)
    return Rollout(
        bare or clean(model),
        Commands(commands),
        len(trial.log),
        start=start,
        supply_v=trial.log.supply_v,
        enabled=enabled,
    )


class Predictor:
    """Predictions for many models at once. ``block``, ``window``: rows a mean and a window span."""

    def __init__(
        self, trials: Sequence[MeasuredTrial], base: Robot, evaluator: Evaluator, block: int, window: int
    ) -> None:
        self.trials, self.base, self.evaluator = trials, base, evaluator
        self.block, self.window = block, window

    def digests(self, pairs: Sequence[tuple[int, Robot]]) -> list[Digest]:
        """Digests for (trial, model) pairs, simulated in one call."""
        as_declared = {id(m): self._as_declared(m) for _, m in pairs}
        plain = [as_declared[id(model)] for _, model in pairs]
        jobs = []
        bare: dict[int, Robot] = {}
        for (k, model), simple in zip(pairs, plain, strict=True):
            if id(model) not in bare:
                bare[id(model)] = clean(model)
            reduction = ToDigest(self.block, self.window) if simple else ToSensors()
            jobs.append(Job(rollout_of(self.trials[k], model, bare[id(model)]), reduction))
        found = self.evaluator.evaluate(jobs)
        out: list[Digest] = list(found)
        by_trial: dict[int, list[int]] = {}
        for i, ((k, _), simple) in enumerate(zip(pairs, plain, strict=True)):
            if not simple:
                by_trial.setdefault(k, []).append(i)
            else:
                out[i] = self._with_declared_noise(found[i])
        for k, members in by_trial.items():
            reported = report([pairs[i][1] for i in members], np.stack([found[i] for i in members], axis=1), k)
            for column, i in enumerate(members):
                clear, noisy = reported[0][:, column], reported[1][:, column]
                shape, grain = digest(clear, self.block, self.window), digest(noisy, self.block, self.window)
                out[i] = replace(shape, rough=grain.rough, repeated=grain.repeated)
        return out

    def _as_declared(self, model: Robot) -> bool:
        """Whether the model's sensors are perfect but for the noise that the base model declares."""
        if model.sensors != self.base.sensors:
            return False
        return all(replace(s, noise=0.0) == replace(s, **_SENSOR_FAULTS) for s in model.sensors)

    def _with_declared_noise(self, found: Digest) -> Digest:
        noise = np.array([s.noise for s in self.base.sensors])
        return replace(found, rough=found.rough + noise**2, repeated=np.where(noise > 0, 0.0, found.repeated))


def report(models: Sequence[Robot], true: Array, seed: int) -> tuple[Array, Array]:
    """What the sensors of B models report of true channels (T, B, S): without random errors, and with them."""
    quiet = [replace(m, sensors=tuple(replace(s, noise=0.0, dropout=0.0) for s in m.sensors)) for m in models]
    dt, steps = models[0].time_step_s, len(true)
    out = []
    for robots in (quiet, list(models)):
        path = SensingPath(robots, dt, steps, [1000 + seed] * len(robots))
        out.append(np.stack([path.step(i, true[i]) for i in range(steps)]))
    return out[0], out[1]


def predicted_commands(trial: MeasuredTrial, models: Sequence[Robot]) -> Array:
    """(T, B, M): what a trial's network would have commanded through the wiring of each model, given what the sensors
    did report. Exact: the network saw the very numbers in the log."""
    assert isinstance(trial.driver, Network)
    control = Controllers(models, [trial.driver] * len(models), [scaling(m) for m in models], len(trial.log))
    dt = models[0].time_step_s
    rows = [control.step(i, i * dt, np.repeat(s[None], len(models), axis=0)) for i, s in enumerate(trial.log.sensors)]
    return np.stack(rows)
