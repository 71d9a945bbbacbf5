"""What drives a rollout: the paper's recurrent network, a recorded or planned command series, or a closed loop of a user's.

A driver is data. ``batched`` groups the drivers of a batch so that equal kinds are computed as one array operation;
the result of a row does not depend on the other rows of its batch (no BLAS: its sums change with the batch size).
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from ee_dist.engines.compiled import compiled
from ee_dist.robots.model import Robot
from ee_dist.robots.ranges import command_span, span
from ee_dist.robots.system import System
from ee_dist.trials.log import Array

HIDDEN = 3


def weight_count(sensors: int, motors: int, hidden: int = HIDDEN) -> int:
    """(S + 1) * H + H * H + (H + 1) * M: 68 for 8 sensors, 3 hidden neurons and 8 motors (the paper, section 3.1)."""
    return (sensors + 1) * hidden + hidden * hidden + (hidden + 1) * motors


class DriverError(ValueError):
    """A driver that does not fit the robot."""


@dataclass(frozen=True)
class Network:
    """The paper's controller by its weights, in the order: input and bias to hidden, hidden to hidden, hidden and bias to output.

    The paper calls the activation "thresholding" and keeps neuron values within [-1, 1]: here the sum is clipped to it.
    """

    weights: tuple[float, ...]

    @cached_property
    def key(self) -> str:
        return "network:" + hashlib.sha256(np.asarray(self.weights).tobytes()).hexdigest()


@dataclass(frozen=True, eq=False)
class Commands:
    """Commands (T, M) in the units of the drives, whatever the sensors say; the last row is held when the rollout is longer."""

    values: Array

    @cached_property
    def key(self) -> str:
        return "commands:" + hashlib.sha256(np.ascontiguousarray(self.values).tobytes()).hexdigest()


@dataclass(frozen=True)
class ClosedLoop:
    """A user's own controller: a picklable ``make()`` that returns a function (t_s, sensors (S,)) -> commands (M,)."""

    name: str
    make: Callable[[], Callable[[float, Array], Array]]

    @property
    def key(self) -> str:
        return f"closed_loop:{self.name}"


Driver = Network | Commands | ClosedLoop


class _Runner(Protocol):
    def step(self, step: int, t_s: float, sensors: Array) -> Array: ...


def scaling(robot: Robot) -> tuple[Array, Array]:
    """(middle, half range) of each motor's joint, both (M,): what readings of -1 and 1 of an angle mean."""
    return _middle_and_half([span(robot.joint(d.joint)) for d in robot.drives])


def command_scaling(robot: Robot) -> tuple[Array, Array]:
    """(middle, half range) of each motor's commands, both (M,): what outputs of -1 and 1 of a network mean."""
    return _middle_and_half([command_span(robot, d) for d in robot.drives])


def _middle_and_half(spans: Sequence[tuple[float, float]]) -> tuple[Array, Array]:
    limits = np.array(spans, dtype=float).reshape(-1, 2)
    return limits.mean(axis=1), (limits[:, 1] - limits[:, 0]) / 2


class _Networks:
    def __init__(
        self, robots: Sequence[System], drivers: Sequence[Network], base: Sequence[tuple[Array, Array]]
    ) -> None:
        s, m = len(robots[0].sensors), len(robots[0].drives)
        h = len(robots[0].wiring.hidden_gain) or HIDDEN
        w = np.array([d.weights for d in drivers])
        if w.shape[1] != weight_count(s, m, h):
            raise DriverError(
                f"network: {w.shape[1]} weights, expected {weight_count(s, m, h)} for {s} sensors and {m} motors"
            )
        n = len(w)
        # One matrix for sensors, hidden neurons and bias, so that a step is one product and sum.
        first, second = (s + 1) * h, (s + 1) * h + h * h
        incoming = w[:, :first].reshape(n, h, s + 1)
        recurrent = w[:, first:second].reshape(n, h, h)
        self.into_hidden = np.ascontiguousarray(np.concatenate([incoming, recurrent], axis=2))
        self.into_output = np.ascontiguousarray(w[:, second:].reshape(n, m, h + 1))
        self.gain = np.array([r.wiring.hidden_gain or (1.0,) * h for r in robots])
        source = np.array([r.wiring.source for r in robots])
        self.into_output = np.take_along_axis(self.into_output, source[:, :, None], axis=1)
        self.middle = np.array([b[0] for b in base])
        self.half = np.array([b[1] for b in base])
        self.state = np.zeros((n, s + 1 + h))
        self.state[:, s] = 1.0
        self.hidden = np.zeros((n, h + 1))
        self.hidden[:, h] = 1.0

    def step(self, step: int, t_s: float, sensors: Array) -> Array:
        out = np.empty(self.half.shape)
        _think(
            sensors, self.into_hidden, self.gain, self.into_output, self.half, self.middle, self.state, self.hidden, out
        )
        return out


@compiled
def _think(
    sensors: Array,
    into_hidden: Array,
    gain: Array,
    into_output: Array,
    half: Array,
    middle: Array,
    state: Array,
    hidden: Array,
    out: Array,
) -> None:
    """A step of n networks. ``state`` (n, S + 1 + H) is sensors, bias and hidden; ``hidden`` (n, H + 1) hidden and bias."""
    count, neurons = gain.shape
    channels = sensors.shape[1]
    for r in range(count):
        for i in range(channels):
            state[r, i] = sensors[r, i]
        for j in range(neurons):
            hidden[r, j] = _clipped(_dot(into_hidden[r, j], state[r])) * gain[r, j]
        for j in range(neurons):
            state[r, channels + 1 + j] = hidden[r, j]
        for j in range(out.shape[1]):
            out[r, j] = _clipped(_dot(into_output[r, j], hidden[r])) * half[r, j] + middle[r, j]


@compiled
def _clipped(value: float) -> float:
    """Value within [-1, 1]; not a number stays so."""
    if value > 1.0:
        return 1.0
    return -1.0 if value < -1.0 else value


@compiled
def _dot(a: Array, b: Array) -> float:
    """Sum of products in a fixed order: even and odd places apart, of each eight the last first.

    It is the order in which NumPy's einsum sums on a processor with vectors of two, and with it results stay what they
    were when einsum made them.
    """
    even, odd = 0.0, 0.0
    i, n = 0, len(a)
    while n - i >= 8:
        for k in range(i + 6, i - 1, -2):
            even += a[k] * b[k]
            odd += a[k + 1] * b[k + 1]
        i += 8
    while i < n:
        even += a[i] * b[i]
        if i + 1 < n:
            odd += a[i + 1] * b[i + 1]
        i += 2
    return even + odd


def advanced(values: Array, early_s: float, step_s: float) -> Array:
    """Values (T, M) of every ``step_s`` as they are ``early_s`` later, on lines between the steps; the last one stays."""
    if not early_s:
        return values
    at, last = np.arange(len(values)) + early_s / step_s, len(values) - 1
    # Whole steps must not become one less and nearly a whole one by rounding.
    whole = np.floor(at + 1e-9).astype(np.intp)
    part = np.clip(at - whole, 0.0, 1.0)[:, None]
    near, far = values[np.minimum(whole, last)], values[np.minimum(whole + 1, last)]
    return np.where(part > 1e-9, near * (1.0 - part) + far * part, near)


class _Series:
    def __init__(self, robots: Sequence[System], drivers: Sequence[Commands], steps: int) -> None:
        longest = max(1, steps)
        rows = []
        for robot, driver in zip(robots, drivers, strict=True):
            values = np.asarray(driver.values, dtype=float)
            if values.ndim != 2 or values.shape[1] != len(robot.drives) or not len(values):
                raise ValueError(f"commands have shape {values.shape}, expected (T, {len(robot.drives)})")
            index = np.minimum(np.arange(longest), len(values) - 1)
            given = advanced(values[index], robot.wiring.early_s, robot.time_step_s)
            rows.append(given[:, list(robot.wiring.source)])
        self.values = np.ascontiguousarray(np.stack(rows, axis=1))

    def step(self, step: int, t_s: float, sensors: Array) -> Array:
        return self.values[step]


class _Loops:
    def __init__(self, robots: Sequence[System], drivers: Sequence[ClosedLoop]) -> None:
        self.functions = [d.make() for d in drivers]
        self.source = [list(r.wiring.source) for r in robots]

    def step(self, step: int, t_s: float, sensors: Array) -> Array:
        return np.stack([f(t_s, row)[s] for f, row, s in zip(self.functions, sensors, self.source, strict=True)])


class Controllers:
    """All controllers of a batch: ``step`` takes sensors (B, S) and returns commands (B, M)."""

    def __init__(
        self, robots: Sequence[System], drivers: Sequence[Driver], scales: Sequence[tuple[Array, Array]], steps: int
    ) -> None:
        self.motors = len(robots[0].drives)
        self.groups: list[tuple[Array | slice, _Runner]] = []
        for kind in (Network, Commands, ClosedLoop):
            index = [i for i, d in enumerate(drivers) if isinstance(d, kind)]
            if not index:
                continue
            some = [robots[i] for i in index]
            mine: list[Any] = [drivers[i] for i in index]
            runner: _Runner
            if kind is Network:
                runner = _Networks(some, mine, [scales[i] for i in index])
            elif kind is Commands:
                runner = _Series(some, mine, steps)
            else:
                runner = _Loops(some, mine)
            self.groups.append((np.array(index), runner))
        if len(self.groups) == 1:
            self.groups = [(slice(None), self.groups[0][1])]

    def step(self, step: int, t_s: float, sensors: Array) -> Array:
        if len(self.groups) == 1:
            return self.groups[0][1].step(step, t_s, sensors)
        out = np.empty((len(sensors), self.motors))
        for index, runner in self.groups:
            out[index] = runner.step(step, t_s, sensors[index])
        return out
