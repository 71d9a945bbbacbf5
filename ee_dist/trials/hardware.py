"""Hardware as a protocol: it takes a driver, gives back a sensor log, and never tells what is wrong with it.

A robot that is driven step by step (``Body``) is made hardware by ``evaluation.stepped``: there the controller runs, and
no command leaves that is outside of the ``Limits``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from ee_dist.robots.model import Drive, Robot
from ee_dist.robots.ranges import command_span
from ee_dist.trials.log import Array, SensorLog

NEAR = 1e-9
"""How far a start may lie outside of what may be commanded, by rounding; rad (m)."""


class HardwareError(RuntimeError):
    """Hardware that did not answer, or answered what cannot be; one line. ``log`` is what was measured until then."""

    def __init__(self, text: str, log: SensorLog | None = None) -> None:
        super().__init__(text)
        self.log = log


class Hardware(Protocol):
    """A robot to be tried: a simulated physical robot, or a user's own class around a real one.

    Where it has ``skip()``, that is called for each trial that a run which is resumed has made already.
    """

    def trial(self, driver: Any, steps: int) -> SensorLog:
        """Run once, from rest at the start pose, and return what was measured. Raises HardwareError."""
        ...


@dataclass(frozen=True)
class Reading:
    """What a body says at a step: sensors (S,); at the end of a trial ``rest`` holds what else was measured, by the names
    of ``SensorLog`` (base_pose, joints, torques, supply_v, travel_m). Torques (M,) of a step where they are measured."""

    sensors: Array | None = None
    torques: Array | None = None
    rest: dict[str, Any] | None = None


class Body(Protocol):
    """A robot driven step by step. Every call answers within its own timeout or raises HardwareError."""

    def begin(self, trial: int, steps: int, step_s: float) -> Reading:
        """Go to the start pose and read the sensors. ``trial`` counts from 0, with those before a resume."""
        ...

    def step(self, commands: Array) -> Reading:
        """Obey commands (M,), in the units of the drives, for one step, then read."""
        ...

    def abort(self) -> None:
        """Stop moving, now. Never raises."""
        ...


@dataclass(frozen=True)
class Limits:
    """What may be asked of a body: share of each joint's range, speed (rad/s), change of speed (rad/s^2), for slides in m.

    Of drives that obey speeds or torques it is the share of the speed or torque that they can be told. ``torque`` (N.m) cannot
    be commanded away where positions are commanded: a trial in which it is measured beyond is aborted.
    """

    range_share: float = 1.0
    speed: float = math.inf
    acceleration: float = math.inf
    torque: float = math.inf

    def __post_init__(self) -> None:
        if not 0.0 < self.range_share <= 1.0:
            raise ValueError(f"range_share={self.range_share}: must be above 0 and at most 1")
        for name in ("speed", "acceleration", "torque"):
            if not getattr(self, name) > 0.0:
                raise ValueError(f"{name}={getattr(self, name)}: must be above 0")

    @property
    def moves(self) -> bool:
        """Whether a body may be told something else than its controller asked for."""
        return self.range_share < 1.0 or math.isfinite(self.speed) or math.isfinite(self.acceleration)


class Limiter:
    """Commands of one trial, brought within the limits before they are sent. What is no number is never sent.

    A drive that obeys speeds or torques has the limits of these in place of its joint's range. Raises HardwareError where the
    robot's start is outside of what may be commanded, and for a limit that no command can keep.
    """

    def __init__(self, robot: Robot, limits: Limits) -> None:
        self.limits = limits
        kinds = [d.command for d in robot.drives]
        bounds = np.array([_bounds(robot, d, limits) for d in robot.drives]).reshape(-1, 2)
        self.low, self.high = bounds[:, 0], bounds[:, 1]
        step_s = robot.time_step_s
        per_step = {"position": limits.speed * step_s, "speed": limits.acceleration * step_s}
        self.most = np.array([per_step.get(k, math.inf) for k in kinds])
        self.change = np.array([limits.acceleration * step_s**2 if k == "position" else math.inf for k in kinds])
        self.last = np.array([robot.joint(d.joint).start if d.command == "position" else 0.0 for d in robot.drives])
        self.moved = np.zeros(len(kinds))
        for drive, start, low, high in zip(robot.drives, self.last, self.low, self.high, strict=True):
            if not low - NEAR <= start <= high + NEAR:
                raise HardwareError(
                    f"hardware.range_share={limits.range_share:g}: {drive.joint} starts at {start:.4g}, outside of {low:.4g} to "
                    f"{high:.4g} that may be commanded: its first command would be a jump"
                )

    def __call__(self, wanted: Array) -> Array:
        """The commands (M,) that may be sent. Raises HardwareError for one that is no number."""
        if wanted.shape != self.last.shape or not np.isfinite(wanted).all():
            raise HardwareError(f"a controller asked for {np.asarray(wanted).tolist()}: not {len(self.last)} numbers")
        allowed = np.clip(wanted, self.low, self.high)
        allowed = np.clip(allowed, self.last - self.most, self.last + self.most)
        held = np.isfinite(self.change)
        if held.any():
            up, down = _stopping(self.high - self.last, self.change), _stopping(self.last - self.low, self.change)
            moved = np.clip(allowed - self.last, -down, up)
            moved = np.clip(moved, self.moved - self.change, self.moved + self.change)
            allowed = np.where(held, np.clip(self.last + moved, self.low, self.high), allowed)
        if not np.isfinite(allowed).all():
            raise HardwareError(
                f"the limits leave {allowed.tolist()} of what was asked for: not {len(self.last)} numbers"
            )
        self.moved, self.last = allowed - self.last, allowed
        return allowed


def _bounds(robot: Robot, drive: Drive, limits: Limits) -> tuple[float, float]:
    """(lowest, highest) command of a drive, in its own unit. Raises HardwareError for a limit that no command can keep."""
    joint = robot.joint(drive.joint)
    if drive.command == "position" and math.isfinite(joint.upper - joint.lower):
        low, high = joint.lower, joint.upper
    else:
        low, high = command_span(robot, drive)
    if limits.range_share != 1.0:
        # Else the joint's own numbers, not their middle plus half of their distance: those differ in the last bit.
        middle, half = (low + high) / 2, (high - low) / 2
        low, high = middle - half * limits.range_share, middle + half * limits.range_share
    if drive.command == "torque":
        for name in ("speed", "acceleration"):
            if math.isfinite(getattr(limits, name)):
                raise HardwareError(
                    f"hardware.{name}={getattr(limits, name):g}: {drive.joint} obeys torques, and no torque keeps to it; "
                    "leave it to the robot, and limit hardware.torque"
                )
    most = {"speed": limits.speed, "torque": limits.torque}.get(drive.command, math.inf)
    return max(low, -most), min(high, most)


def _stopping(way: Array, change: Array) -> Array:
    """The longest step from which one can still come to rest within ``way``, each step shorter by ``change`` at most: in
    steps what the speed sqrt(2 a way) is in time."""
    way = np.maximum(way, 0.0)
    n = np.floor((np.sqrt(1 + 8 * way / change) - 1) / 2)
    return (way + np.where(n > 0, change, 0.0) * n * (n + 1) / 2) / (n + 1)
