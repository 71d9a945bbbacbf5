"""What controllers know of the past when a window begins.

One with a limit of speed or acceleration, or a set time to each goal, leads its joint to a goal that moves no faster. Where the
goal is follows from all commands before, and not from where the joint is: at 4.5 rad/s a joint that lags by 50 ms is 0.2 rad
behind it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ee_dist.engines.compiled import compiled
from ee_dist.engines.goals import in_time
from ee_dist.robots.model import Drive, Robot
from ee_dist.trials.log import Array


def limited(drive: Drive) -> bool:
    """Whether its controller leads its joint to goals within limits of its own."""
    return drive.command != "torque" and bool(
        np.isfinite(drive.command_speed) or np.isfinite(drive.command_acceleration) or drive.command_duration > 0
    )


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
        """(4, M) of the model's controllers of positions before row ``begin``, as ``trials.log.State`` has it."""
        rows, drives = self.begin, model.drives
        times = np.arange(rows) * self.step_s
        wanted = np.stack(
            [
                np.interp(times + model.wiring.early_s - d.delay_s, times, self.commands[:rows, k]) * d.command_gain
                for k, d in enumerate(drives)
            ],
            axis=1,
        )
        enabled = np.ones(rows) if self.enabled is None else np.asarray(self.enabled[:rows], float)
        top = np.array([d.command_speed for d in drives])
        most = np.array([d.command_acceleration for d in drives])
        lasts = np.array([d.command_duration for d in drives])
        return np.asarray(
            _led(wanted, np.ascontiguousarray(self.joints[:rows]), enabled, top, most, lasts, self.step_s)
        )


@compiled
def _led(wanted: Array, joints: Array, enabled: Array, top: Array, most: Array, lasts: Array, step_s: float) -> Array:
    """As the controllers themselves do (engines/drive.py), a row of the log at a time."""
    goals = np.zeros((4, wanted.shape[1]))
    goals[0], goals[3] = joints[0], np.nan
    for t in range(wanted.shape[0]):
        for m in range(wanted.shape[1]):
            on = enabled[t] > 0
            at = goals[0, m] if on else joints[t, m]
            asked = wanted[t, m]
            if lasts[m] > 0.0:
                told = goals[3, m] if on else np.nan
                asked, goals[2, m], goals[3, m] = in_time(asked, at, goals[2, m], told, lasts[m], step_s)
            there = min(max(asked, at - top[m] * step_s), at + top[m] * step_s)
            if np.isfinite(most[m]):
                before, gap = goals[1, m] if on else 0.0, asked - at
                aim = np.sign(gap) * min(np.sqrt(2.0 * most[m] * abs(gap)), abs(there - at) / step_s)
                goals[1, m] = min(max(aim, before - most[m] * step_s), before + most[m] * step_s)
                there = at + goals[1, m] * step_s
            goals[0, m] = there
    return goals
