"""How far a model's log is from the measured one: the paper's two diagnosis metrics, as reductions.

Both return the error of one trial (lower is better); a hypothesis is judged by the mean over trials.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import Protocol

import numpy as np

from ee_dist.evaluation.jobs import Reduction, Travel, array_key
from ee_dist.trials.log import Array, SensorLog


class Metric(Protocol):
    """A diagnosis metric. ``steps(full)`` is how much of a trial of ``full`` steps it needs to see."""

    @property
    def name(self) -> str: ...

    def steps(self, full: int) -> int: ...

    def against(self, measured: SensorLog) -> Reduction:
        """The error of a simulated log against this measured one."""
        ...


def rolling_mean(sensors: Array, window: int) -> Array:
    """Means over every whole window of ``window`` rows: (T, S) -> (T - window + 1, S). Equation 3 of the paper."""
    total = np.cumsum(np.concatenate([np.zeros((1, sensors.shape[1])), sensors]), axis=0)
    return (total[window:] - total[:-window]) / window


@dataclass(frozen=True)
class RollingMean:
    """Mean over sensors and window centres of |mean measured - mean simulated| within the first ``header`` steps (Eq. 2).

    The paper gives neither number. A header of 60 steps (0.6 s) ends before contacts have made different damages
    and noise alike (see docs); a window of 10 evens out single contacts and still leaves the order of events.
    """

    header: int = 60
    window: int = 10
    name: str = "rolling_mean"

    def __post_init__(self) -> None:
        if self.window < 1 or self.header < self.window:
            raise ValueError(
                f"metric: header ({self.header}) must be at least window ({self.window}), and window at least 1"
            )

    def steps(self, full: int) -> int:
        return min(self.header, full)

    def against(self, measured: SensorLog) -> Reduction:
        return _RollingMeanError(self.window, rolling_mean(measured.sensors[: self.header], self.window))


@dataclass(frozen=True, eq=False)
class _RollingMeanError:
    window: int
    means: Array

    @cached_property
    def key(self) -> str:
        return f"rolling_mean:{self.window}:{array_key(self.means)}"

    def __call__(self, log: SensorLog) -> float:
        error = float(np.abs(rolling_mean(log.sensors, self.window) - self.means).mean())
        return error if math.isfinite(error) else math.inf


@dataclass(frozen=True)
class Distance:
    """|measured - simulated| function over the whole trial: of a robot the forward distance, m (Eq. 1, the paper's control)."""

    function: Reduction = field(default_factory=Travel)
    name: str = "distance"

    def steps(self, full: int) -> int:
        return full

    def against(self, measured: SensorLog) -> Reduction:
        return _DistanceError(self.function, self.function(measured))


@dataclass(frozen=True)
class _DistanceError:
    function: Reduction
    measured: float

    @property
    def key(self) -> str:
        return f"distance:{self.function.key}:{self.measured!r}"

    def __call__(self, log: SensorLog) -> float:
        value = self.function(log)
        return abs(value - self.measured) if math.isfinite(value) else math.inf
