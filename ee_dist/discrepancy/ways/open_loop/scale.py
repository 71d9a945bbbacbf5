"""The scale of each channel: how large a residual has to be to say anything, and what noise alone leaves of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ee_dist.discrepancy.measured_trial import MeasuredTrial
from ee_dist.discrepancy.slow_noise import MEDIAN_OF_SQUARES, slow_noise, without_motion
from ee_dist.discrepancy.ways.open_loop.prediction import roughness
from ee_dist.robots.model import Robot
from ee_dist.trials.log import Array, SensorLog
from ee_dist.trials.noise import channel_range

RESOLUTION = 0.002
"""Share of a channel's range below which no difference counts: models are not better than that, noise or not."""
TOUCH_SCALE = 0.2
"""A touch channel jumps by 2 when a contact comes a row early: its scale must not make one such row decide everything."""


@dataclass(frozen=True, eq=False)
class Scale:
    """``noise`` and ``scale``: (S,) in the units of the channels. ``source`` says where the noise figures come from."""

    noise: Array
    scale: Array
    source: str


def channel_scale(robot: Robot, trials: Sequence[MeasuredTrial]) -> Scale:
    """The noise declared by the robot's sensors; where it declares none, measured between repeated trials, or else
    estimated from the second differences of the logs."""
    declared = np.array([s.noise for s in robot.sensors])
    spans = np.array([channel_range(robot, s) for s in robot.sensors])
    touch = np.array([s.kind == "touch" for s in robot.sensors])
    noise, source = declared, "declared by the sensors"
    if not declared.any():
        between = _between_repeats(trials)
        if between is not None:
            noise, source = between, "measured: differences between repeated trials"
        else:
            noise = np.sqrt(np.mean([_variance(t.log) for t in trials], axis=0))
            seldom = any(t.log.filled is not None for t in trials)
            source = f"estimated: {'divided' if seldom else 'second'} differences of the logs"
    scale = np.maximum(noise, RESOLUTION * spans)
    scale = np.where(touch, np.maximum(scale, TOUCH_SCALE), scale)
    return Scale(noise, scale, source)


def _variance(log: SensorLog) -> Array:
    """(S,) of the noise of what was read."""
    if log.filled is None:
        rough = np.sqrt(np.median(roughness(log.sensors), axis=0) / MEDIAN_OF_SQUARES)
        return without_motion(rough, log.times_s, log.sensors) ** 2
    return slow_noise(log.times_s[log.readings], log.sensors[log.readings]) ** 2


def _between_repeats(trials: Sequence[MeasuredTrial]) -> Array | None:
    groups: dict[str, list[Array]] = {}
    for t in trials:
        groups.setdefault(t.name, []).append(t.log.sensors)
    spread = []
    for logs in groups.values():
        if len(logs) > 1:
            rows = min(map(len, logs))
            spread.append(np.var(np.stack([g[:rows] for g in logs]), axis=0, ddof=1).mean(axis=0))
    return np.sqrt(np.mean(spread, axis=0)) if spread else None
