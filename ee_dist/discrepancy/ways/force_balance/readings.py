"""Measured torques beside a motion that was read at another time: through a filter of their own, by another bus or clock."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.interpolate import CubicSpline

from ee_dist.robots.instruments import MOTOR_TORQUE
from ee_dist.robots.model import Robot
from ee_dist.trials.log import Array


@dataclass(frozen=True, eq=False)
class Readings:
    """Filtered torques (T, M) of a whole record, a row each ``step_s`` s, of which a balance drops ``drop_rows`` at either end;
    ``by_sensors``: whether sensors of the robot read them, which may have delays of their own."""

    torque: Array
    drop_rows: int
    step_s: float
    by_sensors: bool = False
    curves: dict[int, CubicSpline] = field(default_factory=dict)

    def late_s(self, robot: Robot) -> Array:
        """(M,) s by which a model's torques were read later than its positions; below zero: sooner."""
        late = np.array([d.torque_read_late_s for d in robot.drives])
        if self.by_sensors:
            own = {s.target: s.delay_s for s in robot.sensors if s.kind == MOTOR_TORQUE}
            late += [own.get(d.joint, 0.0) for d in robot.drives]
        return late

    def of_motion(self, joints: Sequence[int], late_s: Array) -> Array:
        """(T - 2 drop_rows, J) torques of some joints that were read ``late_s`` (J,) after the rows of the motion.

        Between rows the torque goes on by a cubic curve: straight lines dampen noise there and at no row, so that any fraction of
        a row would look better than none. The rows that were dropped are there for those at the ends; beyond the record, which
        a delay longer than these reaches, its last reading holds, so that no row is left out for some delays and not for others.
        """
        last = len(self.torque) - 1
        rows = np.arange(self.drop_rows, last + 1 - self.drop_rows)
        out = self.torque[rows][:, list(joints)]
        for column, (k, late) in enumerate(zip(joints, late_s.tolist(), strict=True)):
            if late:
                if k not in self.curves:
                    self.curves[k] = CubicSpline(np.arange(last + 1), self.torque[:, k])
                out[:, column] = self.curves[k](np.clip(rows + late / self.step_s, 0, last))
        return out


def at_readings(left: Array, times_s: Array, late_s: Array) -> Array:
    """(T, J) what is left of torques, by the ``times_s`` (T,) of the motion, at those at which torques ``late_s`` (J,) late were
    read; before the first of them, and after the last, it stays."""
    shifted = (np.interp(times_s - late, times_s, rest) for rest, late in zip(left.T, late_s, strict=True))
    return np.stack(list(shifted), axis=1) if late_s.any() else left
