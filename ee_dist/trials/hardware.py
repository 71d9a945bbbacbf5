"""Hardware as a protocol: it takes a driver, gives back a sensor log, and never tells what is wrong with it.

A robot that is driven step by step (``Body``) is made hardware by ``evaluation.stepped``: there the controller runs, and
no command leaves that is outside of the ``Limits``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from ee_dist.robots.model import Robot
from ee_dist.trials.log import Array, SensorLog


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
        """Obey commanded positions (M,) for one step, then read."""
        ...

    def abort(self) -> None:
        """Stop moving, now. Never raises."""
        ...


@dataclass(frozen=True)
class Limits:
    """What may be asked of a body: share of each joint's range, speed (rad/s), change of speed (rad/s^2), for slides in m.

    ``torque`` (N.m) cannot be commanded away where positions are commanded: a trial in which it is measured beyond is
    aborted.
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


class Limiter:
    """Commands of one trial, brought within the limits before they are sent. What is no number is never sent."""

    def __init__(self, robot: Robot, limits: Limits) -> None:
        joints = [robot.joint(d.joint) for d in robot.drives]
        middle = np.array([(j.lower + j.upper) / 2 for j in joints])
        half = np.array([(j.upper - j.lower) / 2 for j in joints])
        self.limits, self.step_s = limits, robot.time_step_s
        self.low, self.high = middle - half * limits.range_share, middle + half * limits.range_share
        if limits.range_share == 1.0:
            # The joints' own numbers, not their middle plus half of their distance: those differ in the last bit.
            self.low, self.high = np.array([j.lower for j in joints]), np.array([j.upper for j in joints])
        # The start pose is the zero of all joints.
        self.last, self.moved = np.zeros(len(joints)), np.zeros(len(joints))

    def __call__(self, wanted: Array) -> Array:
        """The commands (M,) that may be sent. Raises HardwareError for one that is no number."""
        if wanted.shape != self.last.shape or not np.isfinite(wanted).all():
            raise HardwareError(f"a controller asked for {np.asarray(wanted).tolist()}: not {len(self.last)} numbers")
        allowed = np.clip(wanted, self.low, self.high)
        most = self.limits.speed * self.step_s
        if math.isfinite(most):
            allowed = np.clip(allowed, self.last - most, self.last + most)
        change = self.limits.acceleration * self.step_s**2
        if math.isfinite(change):
            moved = np.clip(allowed - self.last, self.moved - change, self.moved + change)
            allowed = np.clip(self.last + moved, self.low, self.high)
        self.moved, self.last = allowed - self.last, allowed
        return allowed
