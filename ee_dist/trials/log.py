"""What comes back from a rollout or from hardware: the sensor log. And a state from which a rollout may start."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ee_dist.robots.model import Robot

Array = NDArray[Any]
"""Of float64 where nothing else is said."""
GAP = 5.0
"""Times between readings longer than this many medians are gaps."""


class LogError(ValueError):
    """A sensor log whose arrays contradict one another."""


def late(at: Array) -> NDArray[np.bool_]:
    """(K - 1,) which steps between times, or rows, (K,) are gaps."""
    steps = np.diff(at)
    return np.asarray(steps > GAP * np.median(steps)) if len(steps) else np.zeros(0, dtype=bool)


@dataclass(frozen=True, eq=False)
class SensorLog:
    """One run. Row t holds what was sensed at ``times_s[t]`` and what was commanded upon it.

    Shapes: times_s (T,), sensors (T, S), commands (T, M) in radians (metres for a slide). Where known: base_pose (T, 7)
    as x, y, z, qx, qy, qz, qw in the frame of the floor; joints (T, M) joint positions; torques (T, M) of the drives,
    NaN at those of which none are known;
    supply_v (T,); external (T, M) torques on the joints that are known and not the drives'; filled (T,) whether the sensors
    were not read in a row, so that what it holds of them lies between two readings. Arrays are read-only.
    """

    times_s: Array
    sensors: Array
    commands: Array
    sensor_names: tuple[str, ...]
    sensor_units: tuple[str, ...]
    motor_names: tuple[str, ...]
    base_pose: Array | None = None
    joints: Array | None = None
    torques: Array | None = None
    supply_v: Array | None = None
    external: Array | None = None
    filled: Array | None = None
    travel_m: float = float("nan")
    """How far the body went along +x of the floor, from the start to the last row."""

    def __post_init__(self) -> None:
        steps = len(self.times_s)
        expected = {
            "sensors": (steps, len(self.sensor_names)),
            "commands": (steps, len(self.motor_names)),
            "base_pose": (steps, 7),
            "joints": (steps, len(self.motor_names)),
            "torques": (steps, len(self.motor_names)),
            "supply_v": (steps,),
            "external": (steps, len(self.motor_names)),
            "filled": (steps,),
        }
        for name, shape in expected.items():
            value = getattr(self, name)
            if value is not None and value.shape != shape:
                raise LogError(f"sensor log: {name} has shape {value.shape}, expected {shape}")
        if len(self.sensor_units) != len(self.sensor_names):
            raise LogError("sensor log: every sensor needs a unit")
        for name in ("times_s", *expected):
            value = getattr(self, name)
            if value is not None:
                value.setflags(write=False)

    def __len__(self) -> int:
        return len(self.times_s)

    def channel(self, name: str) -> Array:
        """The (T,) series of one sensor."""
        return self.sensors[:, self.sensor_names.index(name)]

    @property
    def readings(self) -> Array:
        """(K,) the rows in which the sensors were read: all of them, or what an import did not fill in."""
        return np.arange(len(self)) if self.filled is None else np.flatnonzero(~self.filled)

    @property
    def gaps(self) -> NDArray[np.bool_]:
        """(K - 1,) whether readings were lost from one of them to the next."""
        return late(self.readings)

    @property
    def bridged(self) -> NDArray[np.bool_]:
        """(T,) rows in gaps between readings: an import drew lines there, and held commands."""
        rows, out = self.readings, np.zeros(len(self), dtype=bool)
        for k in np.flatnonzero(self.gaps):
            out[rows[k] + 1 : rows[k + 1]] = True
        return out

    @property
    def finite(self) -> bool:
        """Whether every value is a number: a model can be too stiff for its time step."""
        known = (self.sensors, self.commands, self.base_pose, self.joints)
        return all(bool(np.isfinite(values).all()) for values in known if values is not None)

    def without(self, names: Collection[str]) -> SensorLog:
        """Without some of its sensors."""
        left = [i for i, name in enumerate(self.sensor_names) if name not in names]
        return replace(
            self,
            sensors=np.ascontiguousarray(self.sensors[:, left]),
            sensor_names=tuple(self.sensor_names[i] for i in left),
            sensor_units=tuple(self.sensor_units[i] for i in left),
        )

    def head(self, steps: int) -> SensorLog:
        """The first ``steps`` rows."""
        return self.part(0, steps)

    def part(self, first: int, last: int, every: int = 1) -> SensorLog:
        """Rows first (included) to last (left out), one of ``every`` so many."""

        def cut(a: Array | None) -> Array | None:
            return None if a is None else a[first:last:every].copy()

        last = min(last, len(self))
        return replace(
            self,
            times_s=self.times_s[first:last:every].copy(),
            sensors=self.sensors[first:last:every].copy(),
            commands=self.commands[first:last:every].copy(),
            base_pose=cut(self.base_pose),
            joints=cut(self.joints),
            torques=cut(self.torques),
            supply_v=cut(self.supply_v),
            external=cut(self.external),
            filled=cut(self.filled),
            travel_m=float("nan")
            if self.base_pose is None
            else float(self.base_pose[last - 1, 0] - self.base_pose[first, 0]),
        )


@dataclass(frozen=True, eq=False)
class State:
    """Where a rollout starts. joints, speeds: (M,) in the order of the robot's drives; base: pose (7,), twist (6,); goals
    (4, M): how far controllers with limits of their own have led their goals, how fast these go, in how many seconds they arrive
    where that takes a set time, and where; they begin where the joints stand if None."""

    joints: Array
    speeds: Array
    base_pose: Array | None = None
    base_twist: Array | None = None
    goals: Array | None = None


def start_of(robot: Robot) -> Array:
    """(M,) positions at which the robot's driven joints stand when a rollout begins, rad (m)."""
    return np.array([robot.joint(d.joint).start for d in robot.drives])
