"""A problem whose answer is known, with no simulation."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ee_dist.effects.catalogue import Hypothesis
from ee_dist.robots.quadruped_lab import quadruped_lab
from ee_dist.trials.log import Array

ROBOT = quadruped_lab()
SEGMENTS, PER = 20, 40


class Linear:
    """A problem in which each (effect, joint) adds its own random pattern, in proportion to its first value."""

    def __init__(self, hidden: Hypothesis, seed: int = 0, extra: float = 0.0) -> None:
        self.robot = ROBOT
        n = SEGMENTS * PER
        self.segments = tuple(f"trial@{k}s" for k in range(SEGMENTS))
        self.segment_of = np.repeat(np.arange(SEGMENTS), PER)
        self.trial_of_segment = np.zeros(SEGMENTS, dtype=int)
        self.trials = ("trial",)
        self.channels = ("a", "b")
        self.channel_of = np.arange(n) % 2
        self.floor = np.ones(n)
        self.error_definition = "root mean square"
        rng = np.random.default_rng(seed)
        self.data = rng.standard_normal(n) + self.shift(hidden) + extra * np.sin(np.arange(n) / 25.0)

    def shift(self, hypothesis: Hypothesis) -> Array:
        total = np.zeros(SEGMENTS * PER)
        for t in hypothesis:
            key = [sum(map(ord, t.effect)), sum(map(ord, t.target)) % 9973]
            pattern = np.random.default_rng(key).standard_normal(len(total))
            total = total + 3.0 * (t.values[0][1] if t.values else 1.0) * pattern
        return total

    def residuals(self, hypotheses: Sequence[Hypothesis], trials: Sequence[int] | None = None) -> Array:
        return np.stack([self.data - self.shift(h) for h in hypotheses])

    def noise_floor(self) -> tuple[float, str]:
        return 1.0, "known"
