"""What noise alone would leave in a free run: mean absolute errors by the scatter of the readings."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ee_dist.discrepancy.slow_noise import MOTION, slow_noise, without_motion
from ee_dist.discrepancy.ways.free_run.pieces import Piece
from ee_dist.robots.model import Robot
from ee_dist.trials.grid import reading_step
from ee_dist.trials.log import SensorLog
from ee_dist.trials.noise import channel_range

MEAN_ABSOLUTE, MEDIAN_ABSOLUTE = math.sqrt(2 / math.pi), 0.6745
"""Of normal noise with a standard deviation of 1."""
FINEST = 2.0**-20
"""Share of a joint's range that the finest encoders tell apart: one at rest reads the same all the time, and has noise."""


def noiseless(robot: Robot) -> Robot:
    return replace(robot, sensors=tuple(replace(s, noise=0.0) for s in robot.sensors))


def noise_by_unit(
    pieces: Sequence[Piece], logs: Sequence[SensorLog], robot: Robot, columns: Sequence[Sequence[int]]
) -> dict[str, float]:
    """``_noise`` of all channels of a unit, by unit; ``columns``: the channels that were recorded in each trial. Joints that rest
    between two steps of their encoders show none of it in most pieces: what the steps of the whole ``logs`` leave open is the
    least there is."""
    every = sorted({k for some in columns for k in some})
    units = dict.fromkeys(robot.sensors[k].unit for k in every)
    found = {}
    for unit in units:
        own = [k for k in every if robot.sensors[k].unit == unit]
        # Of one unit it is a scale and no more. Beside another it decides which of them counts.
        least = FINEST * np.mean([channel_range(robot, robot.sensors[k]) for k in own]) if len(units) > 1 else 0.0
        each = [(p, [k for k in own if k in columns[p.trial]]) for p in pieces]
        noise = float(np.mean([_noise(p, some) for p, some in each if some]))
        steps = _left_open(logs, [[k for k in own if k in some] for some in columns])
        found[unit] = max(steps if noise < MOTION * steps else noise, float(least), 1e-9)
    return found


def _left_open(logs: Sequence[SensorLog], columns: Sequence[Sequence[int]]) -> float:
    """Mean absolute error that the steps of some sensors leave; of one that hardly moves in one log another shows them."""
    steps = dict.fromkeys((k for some in columns for k in some), 0.0)
    for log, some in zip(logs, columns, strict=True):
        for k in some:
            steps[k] = max(steps[k], reading_step(log.sensors[log.readings, k]))
    return float(np.mean([*steps.values()])) / math.sqrt(12) * MEAN_ABSOLUTE


def _noise(piece: Piece, columns: Sequence[int]) -> float:
    """Mean absolute error that the noise of the readings alone would leave, from second differences of the rows that are
    compared. A little of the motion is in them, as what the noise of the first state does later is in the error; no more."""
    positions = piece.measured(columns)
    if piece.log.filled is not None:
        return float(np.mean(slow_noise(piece.times_s, positions))) * MEAN_ABSOLUTE
    if len(positions) < 3:
        return 0.0
    rough = np.abs(positions[2:] - 2 * positions[1:-1] + positions[:-2])
    found = float(np.median(rough) / np.sqrt(6.0)) / MEDIAN_ABSOLUTE
    # Of the rows between, too: the finer they are, the less motion is in them.
    every = piece.log.sensors[:, list(columns)]
    return float(np.mean(without_motion(np.full(len(columns), found), piece.log.times_s, every))) * MEAN_ABSOLUTE
