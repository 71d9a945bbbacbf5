"""What of a residual belongs where: cut into its parts, and in the units of the channels, as people and other files read it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ee_dist.discrepancy.problem import Series
from ee_dist.discrepancy.ways.open_loop.prediction import Digest
from ee_dist.discrepancy.ways.open_loop.stretches import Stretch
from ee_dist.discrepancy.ways.open_loop.weights import Weights
from ee_dist.effects.effect import Beside
from ee_dist.engines.drivers import Network
from ee_dist.robots.model import Robot
from ee_dist.robots.ranges import span
from ee_dist.trials.log import Array

COMMAND_SHARE = 0.005
"""Scale of a network's commands, as a share of the joint's range: they are computed, not measured."""


@dataclass(frozen=True, eq=False)
class Views:
    """Of residuals (n,) of all ``parts``, each of which has its own of the ``slices``; ``data``: what was measured there."""

    robot: Robot
    parts: tuple[Stretch, ...]
    slices: tuple[slice, ...]
    data: tuple[Digest, ...]
    weights: Weights
    block: int
    window: int
    soft: float

    def smooth(self, residual: Array) -> Array:
        """Before softening."""
        return np.asarray(self.soft * np.sinh(residual / self.soft))

    def blocks(self, part: int, residual: Array) -> Array:
        """(R // block, S): the part of a residual (n,) that compares means, of one part with R readings; 0 of channels that were
        not recorded."""
        rows, s = self._rows(part) // self.block, len(self.weights.own[part])
        return self._spread(part, residual[self.slices[part]][: rows * s].reshape(rows, s))

    def raw_blocks(self, part: int, residual: Array) -> Array:
        """The same before softening, in the units of the channels."""
        return np.asarray(self.smooth(self.blocks(part, residual)) * self.weights.deviation[part])

    def raw_grain(self, part: int, residual: Array) -> Array:
        """(R // window, S): differences of the log of roughness, before softening."""
        rows, s = self._rows(part), len(self.weights.own[part])
        first, windows = rows // self.block * s, rows // self.window
        texture = residual[self.slices[part]][first : first + 2 * s * windows].reshape(windows, 2, s)[:, 0]
        return np.asarray(self.smooth(self._spread(part, texture)) * self.weights.grain_deviation[part])

    def _spread(self, part: int, values: Array) -> Array:
        """(..., S) of the values (..., C) of the channels that were recorded in a part."""
        out = np.zeros((len(values), len(self.robot.sensors)))
        out[:, self.weights.own[part]] = values
        return out

    def raw(self, residual: Array) -> Array:
        """(n,) in the units of the channels; NaN where the texture of a channel is compared."""
        out = np.full(len(residual), np.nan)
        for k, part in enumerate(self.slices):
            values = self.raw_blocks(k, residual)[:, self.weights.own[k]].ravel()
            out[part.start : part.start + len(values)] = values
            if isinstance(self.parts[k].run.driver, Network):
                scale = command_scale(self.robot)
                sent = residual[part][-len(self.data[k].means) * len(scale) :].reshape(-1, len(scale))
                out[part.stop - sent.size : part.stop] = (self.smooth(sent) * scale).ravel()
        return out

    def beside(self, residual: Array, channel: int) -> list[Beside]:
        """By the means of blocks."""
        found = []
        for k, part in enumerate(self.parts):
            if not np.isfinite(mine := residual[self.slices[k]]).all() or not mine.any():
                continue
            if channel not in self.weights.own[k]:
                continue
            measured = self.data[k].means[:, channel].astype(float)
            log, of_blocks = part.run.log, len(measured) * self.block
            began = log.times_s[0] - (part.run.begun.after_s if part.run.begun else 0.0)
            times = log.times_s[log.readings][:of_blocks].reshape(-1, self.block).mean(axis=1) - began
            gap = self.smooth(self.blocks(k, residual)[:, channel]) * self.weights.deviation[k][:, channel]
            found.append(Beside(times, measured, measured - gap))
        return found

    def series(self, predicted: Sequence[Array]) -> list[Series]:
        """Channel by channel, with what was ``predicted`` of each part, (T, S)."""
        out = []
        for part, values, own in zip(self.parts, predicted, self.weights.own, strict=True):
            log, read = part.run.log, part.run.log.readings
            for c in own.tolist():
                sensor = self.robot.sensors[c]
                out.append(Series(part.trial, c, sensor.unit, log.times_s[read], log.sensors[read, c], values[read, c]))
        return out

    def _rows(self, part: int) -> int:
        return len(self.parts[part].run.log.readings)


def command_scale(robot: Robot) -> Array:
    """(M,) by which a network's commands are compared at the driven joints."""
    return COMMAND_SHARE * np.array([high - low for low, high in (span(robot.joint(d.joint)) for d in robot.drives)])
