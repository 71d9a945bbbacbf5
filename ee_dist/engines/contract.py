"""What every engine promises: many (model, driver) pairs in, as many sensor logs out, each independent of the others."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ee_dist.effects.laws import text_of_law
from ee_dist.engines.drivers import Driver
from ee_dist.trials.log import Array, SensorLog, State


class EngineError(RuntimeError):
    """A rollout that an engine cannot run, said in one line."""


@dataclass(frozen=True, eq=False)
class Rollout:
    """One run to be simulated: a model, what drives it, for how many steps (rows of the log).

    ``model`` is a Robot, or another system (``robots/system.py``) for the engine of its kind; what is of bodies below, such as
    ``pose`` and ``start``, says nothing to a system without one.

    ``seed`` feeds the noise of the sensors, if they have any. ``pose`` asks for body pose, joint positions and torques
    at every row. ``supply_v`` (steps,) is the measured supply voltage. ``enabled`` (steps,) is 0 where the drives are
    released: open circuit, no torque. ``external`` (steps, M) is a known torque on each drive's joint that is not the drive's
    (a force for a slide): a stage pushed by a measured disturbance. ``again`` are rows at which the joints are put to another
    state, that of a measured motion. What drives hold within them (delayed commands, integrals, play) goes on.
    """

    model: Any
    driver: Driver
    steps: int
    seed: int | None = None
    start: State | None = None
    supply_v: Array | None = None
    pose: bool = False
    enabled: Array | None = None
    external: Array | None = None
    again: tuple[tuple[int, State], ...] = ()

    @property
    def key(self) -> str:
        """Content address of all that decides the result, for the cache."""
        seed = self.seed if self.model.noisy else None
        parts = [self.model.digest, self.driver.key, str(self.steps), str(seed), str(self.pose)]
        for a in (self.supply_v, self.enabled, self.external, *_arrays(self.start)):
            parts.append("-" if a is None else hashlib.sha256(np.ascontiguousarray(a).tobytes()).hexdigest())
        if self.start is not None and self.start.goals is not None:
            parts.append("goals:" + hashlib.sha256(np.ascontiguousarray(self.start.goals).tobytes()).hexdigest())
        for row, state in self.again:
            values = np.concatenate([state.joints, state.speeds])
            parts.append(f"{row}:{hashlib.sha256(np.ascontiguousarray(values).tobytes()).hexdigest()}")
        # A robot names its laws. What a law of the user's own does is in their file, which may change between two runs.
        laws = {law.name for law in getattr(self.model, "laws", ())}
        parts.extend(text for name in sorted(laws) if (text := text_of_law(name)))
        return "|".join(parts)


def _arrays(start: State | None) -> tuple[Array | None, ...]:
    return () if start is None else (start.joints, start.speeds, start.base_pose, start.base_twist)


@dataclass
class Truth:
    """The true state of B bodies: joints, speeds (B, M); touch (B, touch sensors) as booleans; base pose (B, 7), twist (B, 6).

    Base pose is the frame of the root part; twist is linear then angular velocity in the frame of the floor.
    """

    joints: Array
    speeds: Array
    touch: NDArray[np.bool_] | None = None
    base_pose: Array | None = None
    base_twist: Array | None = None


class Bodies(Protocol):
    """B bodies in an engine, all at their start. The only part of a rollout that an engine writes itself."""

    gives: bool
    """Whether the engine takes ``give`` (see ``step``)."""

    def read(self, touch: bool, pose: bool, twist: bool) -> Truth: ...

    def step(self, torques: Array, force: Array | None, give: Array | None = None) -> None:
        """Advance by one time step under joint torques (B, M) and a force (B, 3) on the root part, floor frame.

        ``give`` (B, M), N.m.s/rad: torques fall by this times what the speed gains in the step, in an engine that can do that;
        others are not asked to.
        """

    def move(self, joints: Array, speeds: Array) -> None:
        """Joint positions and speeds (B, M) of all of them, from here on. Joints that they lost stay lost."""

    def put(self, row: int, state: State) -> None:
        """Joint positions and speeds of one of them, from here on. Joints that it lost stay lost."""

    def close(self) -> None:
        """The batch is over; what it held may be used again."""


class Engine(Protocol):
    """A physics engine. ``name`` and its settings are part of every cache key."""

    name: str

    def rollout(self, rollouts: Sequence[Rollout]) -> list[SensorLog]:
        """Logs in the order asked. Bit for bit the same whatever else is in the list and whatever ran before."""
        ...

    def close(self) -> None: ...


@dataclass
class Counters:
    """What an engine simulated."""

    rollouts: int = 0
    steps: int = 0
    seconds: float = 0.0
    by_part: dict[str, float] = field(default_factory=dict)
