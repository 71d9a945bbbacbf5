"""The residual itself: what was measured of a part of a trial beside what a model predicts, in standard deviations, softened."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ee_dist.discrepancy.measured_trial import MeasuredTrial
from ee_dist.discrepancy.problem import Mask
from ee_dist.discrepancy.ways.open_loop.prediction import Digest, predicted_commands
from ee_dist.discrepancy.ways.open_loop.texture import frozen
from ee_dist.discrepancy.ways.open_loop.views import command_scale
from ee_dist.discrepancy.ways.open_loop.weights import Weights, grain_of, soften
from ee_dist.robots.model import Robot
from ee_dist.trials.log import Array


def residual_of(
    measured: Digest, predicted: Digest, weights: Weights, part: int, moving: Mask, robot: Robot, soft: float
) -> Array:
    """Of the channels that were recorded in a part: differences of means, then of texture, window by window. ``moving``
    (windows, S): where repeated readings tell of a sensor. Infinite where the model cannot be simulated."""
    own = weights.own[part]
    if not predicted.finite:
        return np.full((len(measured.means) + 2 * len(measured.rough)) * len(own), np.inf)
    shape = (measured.means.astype(float) - predicted.means) / weights.deviation[part]
    grain = grain_of(measured, weights.rough(predicted), weights.tiny) / weights.grain_deviation[part]
    compared = np.array([x.kind not in weights.repeating for x in robot.sensors])
    texture = np.stack(
        [grain * weights.smooth, frozen(measured, predicted, weights.window) * compared * moving], axis=1
    )
    return np.concatenate([soften(v[..., own], soft).ravel() for v in (shape, texture)])


def command_residuals(trial: MeasuredTrial, models: Sequence[Robot], robot: Robot, block: int, soft: float) -> Array:
    """(H, R // block * M) of each model: means over a ``block`` of rows of the commands that a network computes."""
    sent = predicted_commands(trial, models)
    rows = len(trial.log) // block * block
    gap = (trial.log.commands[:, None] - sent)[:rows].reshape(-1, block, *sent.shape[1:]).mean(axis=1)
    values = soften(gap / command_scale(robot), soft)
    return np.ascontiguousarray(np.moveaxis(values, 1, 0)).reshape(len(models), -1)
