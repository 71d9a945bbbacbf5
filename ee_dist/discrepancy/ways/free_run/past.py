"""What controllers know of the past when a window begins.

One with a velocity limit leads its joint to a goal that moves no faster. Where the goal is follows from all commands before, and
not from where the joint is: at 4.5 rad/s a joint that lags by 50 ms is 0.2 rad behind it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ee_dist.engines.compiled import compiled
from ee_dist.robots.model import Robot
from ee_dist.trials.log import Array


@dataclass(frozen=True, eq=False)
class Past:
    """Of a trial: its ``commands`` (T, M) as controllers take them, ``enabled`` (T,) 0 where drives are released, measured
    ``joints`` (T, M) every ``step_s``; a window begins at row ``begin``."""

    commands: Array
    enabled: Array | None
    joints: Array
    step_s: float
    begin: int

    def goals(self, model: Robot) -> Array:
        """(M,) goals of the model's controllers of positions before row ``begin``."""
        rows, drives = self.begin, model.drives
        times = np.arange(rows) * self.step_s
        wanted = np.stack(
            [
                np.interp(times - d.delay_s, times, self.commands[:rows, k]) * d.command_gain
                for k, d in enumerate(drives)
            ],
            axis=1,
        )
        enabled = np.ones(rows) if self.enabled is None else np.asarray(self.enabled[:rows], float)
        top = np.array([d.command_speed for d in drives]) * self.step_s
        return np.asarray(_led(wanted, np.ascontiguousarray(self.joints[:rows]), enabled, top))


@compiled
def _led(wanted: Array, joints: Array, enabled: Array, most: Array) -> Array:
    goal = joints[0].copy()
    for t in range(len(wanted)):
        for m in range(len(most)):
            at = goal[m] if enabled[t] > 0 else joints[t, m]
            goal[m] = min(max(wanted[t, m], at - most[m]), at + most[m])
    return goal
