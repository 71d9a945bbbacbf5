"""Controllers that lead their joints to what they are told no faster than limits of their own let them, or in a set time."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ee_dist.engines.compiled import compiled
from ee_dist.trials.log import Array

SAME = 1e-9
"""rad (m) by which two goals differ that are one: no more than rounding."""


class Goals:
    """Where the controllers of B robots with M joints have let their commands go so far. ``p`` are the drives' fields;
    ``by_position`` and ``by_speed`` say which joints (B, M) obey positions and speeds: the goal of a position sets out from where
    the joint stands, and stays with it while the drive is released.

    One that takes a set time T to each new goal moves evenly, so that it is there T after the goal changed; whenever that changes
    again it has T anew for what is left. Of commands that change at every step the goal so covers dt / T of what is left in each:
    it follows them as a first-order lag of T does."""

    def __init__(
        self, p: Mapping[str, Array], by_position: NDArray[np.bool_], by_speed: NDArray[np.bool_], dt: float
    ) -> None:
        shape = by_position.shape
        self.dt, self.by_position, self.top, self.most = dt, by_position, p["command_speed"], p["command_acceleration"]
        self.eased = np.isfinite(self.most) & by_position
        self.led = np.isfinite(self.top) & (by_position | by_speed)
        self.lasts = p["command_duration"]
        self.timed = (self.lasts > 0.0) & by_position
        self.at = np.full(shape, np.nan)
        """The goals (B, M); not a number before there are any,"""
        self.pace = np.zeros(shape)
        """and how fast they go, where their acceleration is limited, rad/s."""
        self.left = np.zeros(shape)
        self.told = np.full(shape, np.nan)
        """Of those that take a set time, what is left of it (s), and where they are to be then; not a number at first."""
        self.closed = np.ones(shape)

    @property
    def any(self) -> bool:
        """Whether any controller has a limit."""
        return bool((self.led | self.eased | self.timed).any())

    def go_on(self, goals: Array) -> None:
        """From what was before: ``goals`` (B, 4, M) as ``trials.log.State`` has them, not a number where nothing was."""
        self.at, self.told = goals[:, 0].copy(), goals[:, 3].copy()
        self.pace, self.left = np.nan_to_num(goals[:, 1]), np.nan_to_num(goals[:, 2])

    def __call__(self, wanted: Array, q: Array, enabled: Array | None) -> Array:
        """Commands (B, M) under the limits, of what is ``wanted`` of joints at ``q``."""
        found, shape = np.empty(wanted.shape), self.at.shape
        closed = self.closed if enabled is None else np.ascontiguousarray(np.broadcast_to(enabled, shape))
        _lead(
            self.by_position, self.led, self.eased, self.timed, self.top, self.most, self.lasts, self.dt,
            wanted, q, closed, self.at, self.pace, self.left, self.told, found,
        )  # fmt: skip
        return found


@compiled
def _lead(
    by_position: NDArray[np.bool_],
    led: NDArray[np.bool_],
    eased: NDArray[np.bool_],
    timed: NDArray[np.bool_],
    top: Array,
    most: Array,
    lasts: Array,
    dt: float,
    wanted: Array,
    q: Array,
    closed: Array,
    at: Array,
    pace: Array,
    left: Array,
    told: Array,
    found: Array,
) -> None:
    """Write to ``found`` the commands under the limits ``top`` (rad/s) and ``most`` (rad/s^2), or which take the time ``lasts``
    (s); ``at``, ``pace``, ``left`` and ``told`` go on. All (B, M)."""
    for i in range(found.shape[0]):
        for j in range(found.shape[1]):
            asked, goal = wanted[i, j], at[i, j]
            if math.isnan(goal) or not closed[i, j] > 0.0:
                goal = q[i, j]
                told[i, j] = math.nan
            if timed[i, j]:
                asked, left[i, j], told[i, j] = in_time(asked, goal, left[i, j], told[i, j], lasts[i, j], dt)
            if by_position[i, j]:
                there = _between(asked, goal - top[i, j] * dt, goal + top[i, j] * dt)
            else:
                there = _between(asked, -top[i, j], top[i, j])
            if eased[i, j]:
                before = pace[i, j] if closed[i, j] > 0.0 else 0.0
                # The pace from which it can still stop where it is wanted.
                far = abs(asked - goal)
                stops, reaches = math.sqrt(2.0 * most[i, j] * far), abs(there - goal) / dt
                aim = np.sign(asked - goal) * (stops if stops <= reaches else reaches)
                pace[i, j] = _between(aim, before - most[i, j] * dt, before + most[i, j] * dt)
                there = goal + pace[i, j] * dt
            at[i, j] = there
            found[i, j] = there if led[i, j] or eased[i, j] else asked


@compiled
def in_time(asked: float, goal: float, left: float, told: float, lasts: float, dt: float) -> tuple[float, float, float]:
    """(where the goal goes in this step, what is left of its time then, where it is to be then) of one that takes the time
    ``lasts`` (s) to what is ``asked`` of it, and stands at ``goal`` with ``left`` s to where it was ``told`` to go."""
    if not abs(asked - told) <= SAME:
        left, told = lasts, asked
    if left > dt:
        return goal + (asked - goal) * (dt / left), left - dt, told
    return asked, 0.0, told


@compiled
def _between(value: float, low: float, high: float) -> float:
    """Value within bounds; not a number where any of them is none."""
    if math.isnan(low) or math.isnan(high):
        return math.nan
    if value < low:
        value = low
    return high if value > high else value
