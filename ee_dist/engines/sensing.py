"""The sensing path: from true values to what the channels report, for a whole batch at once and the same for every engine.

    true value -> missed touch -> gain, bias -> delay -> noise -> dropout -> quantisation -> stuck

Random draws come from the rollout's own seed, one stream a row, so that they do not depend on the batch.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields

import numpy as np

from ee_dist.engines.delay import Delay
from ee_dist.engines.per_robot import per_robot
from ee_dist.robots.instruments import torque_delays
from ee_dist.robots.model import Robot, Sensor
from ee_dist.robots.system import System
from ee_dist.trials.log import Array

TOUCHING, LIFTED = 1.0, -1.0


class SensingPath:
    """State and arithmetic of the S channels of B robots."""

    def __init__(self, robots: Sequence[System], time_step_s: float, steps: int, seeds: Sequence[int | None]) -> None:
        names = [f.name for f in fields(Sensor) if isinstance(f.default, float)]
        rows = per_robot(robots, lambda r: np.array([[getattr(s, n) for n in names] for s in r.sensors], dtype=float))
        table = np.array(rows).reshape(len(robots), len(robots[0].sensors), len(names))
        shape = table.shape[:2]
        self.p = {n: np.ascontiguousarray(table[:, :, i]) for i, n in enumerate(names)}
        neutral = {f.name: f.default for f in fields(Sensor)}
        late = per_robot(robots, lambda r: torque_delays(r) if isinstance(r, Robot) else (0.0,) * len(r.sensors))
        self.p["delay_s"] = self.p["delay_s"] + np.array(late).reshape(shape)
        self.uses = {n: bool(np.any(self.p[n] != neutral[n])) for n in names}
        self.plain = not any(self.uses.values())
        self.kinds = [s.kind for s in robots[0].sensors]
        self.touch = np.array([k == "touch" for k in self.kinds])
        if self.uses["missed_touch"]:
            self.pressed_s = np.zeros(shape)
        self.stuck_at: Array = np.zeros(shape)
        self.dt = time_step_s
        self.delay = Delay(self.p["delay_s"], time_step_s)
        if self.uses["noise"] or self.uses["dropout"]:
            self.normal = np.zeros((steps, *shape))
            self.uniform = np.ones((steps, *shape))
            for i, seed in enumerate(seeds):
                if seed is None and not (self.p["noise"][i].any() or self.p["dropout"][i].any()):
                    continue
                rng = np.random.default_rng(0 if seed is None else seed)
                self.normal[:, i] = rng.standard_normal((steps, shape[1]))
                self.uniform[:, i] = rng.random((steps, shape[1]))
            self.held: Array | None = None

    def step(self, step: int, true: Array) -> Array:
        """Reported values (B, S) at this step from true ones."""
        if self.plain:
            return true
        p, value = self.p, true
        if self.uses["missed_touch"]:
            value = self._late_touch(value)
        value = self._scaled(value)
        if self.uses["delay_s"]:
            value = self.delay(value)
        if self.uses["noise"]:
            value = self._noisy(value, self.normal[step])
        if self.uses["dropout"]:
            if self.held is not None:
                value = np.where(self.uniform[step] < p["dropout"], self.held, value)
            self.held = value
        if self.uses["quantum"]:
            value = self._in_steps(value)
        if self.uses["stuck"]:
            # The value at which the channel sticks is the last that it reported while it still moved freely.
            waiting = step * self.dt < p["stuck_from_s"] - 1e-9
            if step == 0:
                self.stuck_at = value
            self.stuck_at = np.where(waiting, value, self.stuck_at)
            value = self._stuck(value, self.stuck_at, waiting)
        return value

    def over(self, true: Array) -> Array:
        """Reported values (T, B, S) of all steps at once, from true ones: what ``step`` gives, to the last bit."""
        if self.plain:
            return true
        p, value, steps = self.p, true, np.arange(len(true))[:, None, None]
        if self.uses["missed_touch"]:
            value = np.stack([self._late_touch(v) for v in value])
        value = self._scaled(value)
        if self.uses["delay_s"]:
            value = self.delay.over(value)
        if self.uses["noise"]:
            value = self._noisy(value, self.normal[: len(true)])
        if self.uses["dropout"]:
            fresh = ~(self.uniform[: len(true)] < p["dropout"])
            fresh[0] = True
            held = np.maximum.accumulate(np.where(fresh, steps, 0), axis=0)
            value = np.take_along_axis(value, held, axis=0)
        if self.uses["quantum"]:
            value = self._in_steps(value)
        if self.uses["stuck"]:
            waiting = steps * self.dt < p["stuck_from_s"] - 1e-9
            last = np.maximum(waiting.sum(axis=0) - 1, 0)
            value = self._stuck(value, np.take_along_axis(value, last[None], axis=0), waiting)
        return value

    def _late_touch(self, value: Array) -> Array:
        """A worn switch closes only after it was pressed for a while."""
        down = self.touch & (value > 0)
        self.pressed_s = np.where(down, self.pressed_s + self.dt, 0.0)
        return np.where(down & (self.pressed_s <= self.p["missed_touch"] + 1e-9), LIFTED, value)

    def _scaled(self, value: Array) -> Array:
        p = self.p
        if self.uses["gain"]:
            value = value * p["gain"]
        if self.uses["bias"]:
            value = np.where(p["bias"] != 0, value + p["bias"], value)
        return value

    def _noisy(self, value: Array, normal: Array) -> Array:
        return np.where(self.p["noise"] != 0, value + self.p["noise"] * normal, value)

    def _in_steps(self, value: Array) -> Array:
        q = np.where(self.p["quantum"] > 0, self.p["quantum"], 1.0)
        return np.where(self.p["quantum"] > 0, np.round(value / q) * q, value)

    def _stuck(self, value: Array, stuck_at: Array, waiting: Array) -> Array:
        slow = stuck_at + (1.0 - self.p["stuck"]) * (value - stuck_at)
        return np.where((self.p["stuck"] > 0) & ~waiting, slow, value)
