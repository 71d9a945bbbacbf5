"""The problem of a whole simulated robot: predictions on the recorded commands, compared channel by channel.

A residual value is the mean over a block of rows of (measured - predicted), in units of that mean's noise, softened
beyond six of them so that one missed contact does not outweigh a minute of agreement. Two values a window and channel
compare how noisy and how frozen the channel is, which is all that a noisy or dropping sensor changes.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ee_dist.discrepancy.measured import MeasuredTrial
from ee_dist.discrepancy.prediction import Digest, Predictor, digest, predicted_commands
from ee_dist.discrepancy.scale import channel_scale
from ee_dist.effects.catalogue import Hypothesis, apply
from ee_dist.engines.drivers import Network
from ee_dist.evaluation.jobs import Evaluator
from ee_dist.robots.model import Robot
from ee_dist.trials.log import Array

SOFT = 6.0
"""Residuals beyond this many standard deviations count by their logarithm."""
COMMAND_SHARE = 0.005
"""Scale of a network's commands, as a share of the joint's range: they are computed, not measured."""
_SOFT_FLOOR = 0.974
"""Mean square of SOFT * asinh(x / SOFT) for standard normal x."""
_ROUGH_FLOOR = 0.93
"""Mean square of the comparison of roughness, for white noise."""


def soften(values: Array) -> Array:
    """Nearly the identity up to SOFT, logarithmic beyond."""
    return SOFT * np.arcsinh(values / SOFT)


class OpenLoop:
    """Implements ``ee_dist.discrepancy.problem.Problem``.

    ``block`` rows are averaged into a value, ``window`` rows (a multiple) are a segment. ``unmodelled`` (S,) widens the
    scales by what a calibrated model is known to leave.
    """

    def __init__(
        self,
        trials: Sequence[MeasuredTrial],
        robot: Robot,
        evaluator: Evaluator,
        block: int = 4,
        window: int = 60,
        unmodelled: Array | None = None,
    ) -> None:
        self.robot, self.measured, self.evaluator = robot, tuple(trials), evaluator
        self.block, self.window = block, window
        self.scale = channel_scale(robot, trials, unmodelled)
        self.predictor = Predictor(self.measured, robot, evaluator, block, window)
        self.trials = tuple(t.name for t in trials)
        self.looped = tuple(k for k, t in enumerate(trials) if isinstance(t.driver, Network))
        self.channels = (*robot.sensor_names, *(f"command_{m}" for m in robot.motor_names))
        self._data = [digest(t.log.sensors, block, window) for t in trials]
        self._lay_out()
        self.error_definition = (
            "root mean square over channels and time of the residual in standard deviations of its noise "
            f"(means over {block * robot.time_step_s:g} s, softened beyond {SOFT:g}); 1 is a perfect model"
        )

    def _lay_out(self) -> None:
        """Segments, channels and floors of all residual values, trial after trial."""
        names: list[str] = []
        seg: list[Array] = []
        chan: list[Array] = []
        floor: list[Array] = []
        trial_of_segment: list[int] = []
        self.slices: list[slice] = []
        s, per = len(self.robot.sensors), self.window // self.block
        dt, at = self.robot.time_step_s, 0
        self.start_s: list[float] = []
        tiny = (self.scale.noise / self.scale.scale) ** 2
        texture = np.concatenate([_ROUGH_FLOOR * tiny, np.zeros(s)])
        for k, trial in enumerate(self.measured):
            blocks, windows = len(trial.log) // self.block, len(trial.log) // self.window
            first = len(names)
            count = max(1, windows)
            names += [f"{trial.name}@{w * self.window * dt:.1f}s" for w in range(count)]
            trial_of_segment += [k] * count
            of_block = first + np.minimum(np.arange(blocks) // per, count - 1)
            seg += [np.repeat(of_block, s), np.repeat(first + np.arange(windows), 2 * s)]
            chan += [np.tile(np.arange(s), blocks), np.tile(np.arange(s), 2 * windows)]
            floor += [np.tile(tiny * _SOFT_FLOOR, blocks), np.tile(texture, windows)]
            if isinstance(trial.driver, Network):
                m = len(self.robot.drives)
                seg.append(np.repeat(of_block, m))
                chan.append(np.tile(s + np.arange(m), blocks))
                floor.append(np.zeros(m * blocks))
            size = sum(map(len, seg)) - at
            self.slices.append(slice(at, at + size))
            at += size
        self.segments = tuple(names)
        self.trial_of_segment = np.array(trial_of_segment)
        self.segment_of = np.concatenate(seg).astype(np.int64)
        self.channel_of = np.concatenate(chan).astype(np.int64)
        self.floor = np.concatenate(floor)

    def residuals(self, hypotheses: Sequence[Hypothesis], trials: Sequence[int] | None = None) -> Array:
        """(H, n), as the contract says. Raises EffectError for a hypothesis that does not fit the robot."""
        models = [apply(self.robot, h) for h in hypotheses]
        chosen = list(range(len(self.measured))) if trials is None else list(trials)
        pairs = [(k, apply(m, self.measured[k].setup)) for k in chosen for m in models]
        digests = self.predictor.digests(pairs)
        out = np.zeros((len(models), len(self.segment_of)))
        for place, k in enumerate(chosen):
            mine = digests[place * len(models) : (place + 1) * len(models)]
            parts = [np.stack([self._compare(self._data[k], d) for d in mine])]
            trial = self.measured[k]
            if isinstance(trial.driver, Network):
                parts.append(self._command_residuals(trial, models))
            out[:, self.slices[k]] = np.concatenate(parts, axis=1)
        return out

    def _compare(self, measured: Digest, predicted: Digest) -> Array:
        if not predicted.finite:
            return np.full(measured.means.size + 2 * measured.rough.size, np.inf)
        shape = (measured.means.astype(float) - predicted.means) / self.scale.scale * np.sqrt(self.block)
        w, tiny = self.window, (0.25 * self.scale.scale) ** 2
        grain = np.log((measured.rough + tiny) / (predicted.rough + tiny)) / np.sqrt(2 * 1.95 / w + 0.01)
        p = 0.5 * (predicted.repeated + 1 / w)
        frozen = (measured.repeated - predicted.repeated) / np.sqrt(np.maximum(p * (1 - p), 1 / w) / w + 0.0004)
        texture = np.stack([grain, frozen], axis=1)
        return np.concatenate([soften(shape).ravel(), soften(texture).ravel()])

    def _command_residuals(self, trial: MeasuredTrial, models: Sequence[Robot]) -> Array:
        spans = np.array([self.robot.joint(d.joint).upper - self.robot.joint(d.joint).lower for d in self.robot.drives])
        sent = predicted_commands(trial, models)
        rows = len(trial.log) // self.block * self.block
        gap = (trial.log.commands[:, None] - sent)[:rows].reshape(-1, self.block, *sent.shape[1:]).mean(axis=1)
        values = soften(gap / (COMMAND_SHARE * spans))
        return np.ascontiguousarray(np.moveaxis(values, 1, 0)).reshape(len(models), -1)

    def noise_floor(self) -> tuple[float, str]:
        return float(np.sqrt(self.floor.mean())), self.scale.source

    # -- views of a residual -----------------------------------------------------------------------------------------

    def blocks(self, trial: int, residual: Array) -> Array:
        """(T // block, S): the part of a residual (n,) that compares means, of one trial."""
        rows, s = len(self.measured[trial].log) // self.block, len(self.robot.sensors)
        return residual[self.slices[trial]][: rows * s].reshape(rows, s)

    def raw_blocks(self, trial: int, residual: Array) -> Array:
        """The same before softening: in standard deviations."""
        return np.asarray(SOFT * np.sinh(self.blocks(trial, residual) / SOFT))

    def block_floor(self, channel: int) -> float:
        """Mean square that noise leaves of a value of ``blocks``."""
        return float((self.scale.noise[channel] / self.scale.scale[channel]) ** 2 * _SOFT_FLOOR)

    def command_scale(self, channel: str) -> float:
        """What a residual of 1 is for ``command_<motor>``, rad (m)."""
        joint = self.robot.joint(channel.removeprefix("command_"))
        return COMMAND_SHARE * (joint.upper - joint.lower)
