"""How a system does what it does, in a few numbers: what tells one kind of gait from another, whatever it is worth."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ee_dist.evaluation.jobs import Reduction
from ee_dist.recovery.gait import BACK_SHARE, back_share
from ee_dist.robots.model import Robot
from ee_dist.robots.system import System
from ee_dist.trials.log import Array, SensorLog


@dataclass(frozen=True)
class Behaviour:
    """(2 + D,) of a log: the value of ``function``, whether it counts (1 or 0), and the place in [0, 1] on D axes.

    An axis is the mean of a sensor over the trial, which runs from ``low`` to ``high``: for a touch sensor the share of time
    that its foot is on the floor, by which Cully, Clune, Tarapore and Mouret (2015) told the gaits of a hexapod apart.
    """

    function: Reduction
    channels: tuple[int, ...]
    low: float
    high: float

    @property
    def key(self) -> str:
        return f"behaviour:{self.function.key}:{self.channels}:{self.low!r}:{self.high!r}"

    def __call__(self, log: SensorLog) -> Array:
        value = float(self.function(log))
        means = log.sensors[:, list(self.channels)].mean(axis=0)
        place = np.clip((means - self.low) / (self.high - self.low), 0.0, 1.0)
        return np.array([value, float(math.isfinite(value) and self.counts(log)), *place], dtype=np.float64)

    def counts(self, log: SensorLog) -> bool:
        """Whether it is an honest way of doing it, as far as that is quickly seen."""
        return True


class Gait(Behaviour):
    """That of a robot, which must not go on its back. The whole rule (``gait.py``) takes as long as a simulation, and is asked
    of those few alone that are to be chosen."""

    def counts(self, log: SensorLog) -> bool:
        return log.base_pose is None or back_share(log.base_pose) <= BACK_SHARE


def gait_of(robot: Robot, function: Reduction) -> Behaviour:
    """By the feet on the floor; by all its sensors where a robot feels no floor."""
    touch = tuple(k for k, s in enumerate(robot.sensors) if s.kind == "touch")
    return Gait(function, touch or tuple(range(len(robot.sensors))), -1.0, 1.0)


def levels_of(system: System, function: Reduction) -> Behaviour:
    """By the mean level of each channel that is reported, of levels from 0 to 1."""
    return Behaviour(function, tuple(range(len(system.sensors))), 0.0, 1.0)
