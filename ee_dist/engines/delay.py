"""Values as they were a while ago, for a whole batch."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ee_dist.engines.compiled import compiled
from ee_dist.trials.log import Array


class Delay:
    """What B x K values were ``delay_s`` (B, K) ago, each entry its own, on straight lines between the steps. Before the first
    step a value was always what it is then."""

    def __init__(self, delay_s: Array, time_step_s: float) -> None:
        steps = delay_s / time_step_s
        # A delay of whole steps must not become one step less and nearly a whole one by rounding.
        self.whole = np.floor(steps + 1e-9).astype(np.intp)
        self.part = np.clip(steps - self.whole, 0.0, 1.0)
        self.past: Array | None = None
        """(T, B, K): a ring, so that a step writes one row; ``newest`` is the row written last."""
        self.newest = 0

    def __call__(self, value: Array) -> Array:
        """(B, K) values as they were, from those of this step."""
        if self.past is None:
            self.past = np.repeat(value[None], int(self.whole.max()) + 2, axis=0)
        self.newest = (self.newest - 1) % len(self.past)
        self.past[self.newest] = value
        delayed = np.empty(self.part.shape)
        _read(self.past, self.newest, self.whole, self.part, delayed)
        return delayed

    def over(self, values: Array) -> Array:
        """(T, B, K) values as they were, from those of all steps from the first on."""
        at = np.arange(len(values))[:, None, None] - self.whole
        near = np.take_along_axis(values, np.maximum(at, 0), axis=0)
        far = np.take_along_axis(values, np.maximum(at - 1, 0), axis=0)
        return np.where(self.part > 0.0, near * (1 - self.part) + far * self.part, near)


@compiled
def _read(past: Array, newest: int, whole: NDArray[np.intp], part: Array, delayed: Array) -> None:
    """Write to ``delayed`` (B, K) what lies ``whole`` + ``part`` rows behind ``newest``."""
    length = past.shape[0]
    for i in range(delayed.shape[0]):
        for j in range(delayed.shape[1]):
            value = past[(newest + whole[i, j]) % length, i, j]
            if part[i, j] > 0.0:
                far = past[(newest + whole[i, j] + 1) % length, i, j]
                value = value * (1 - part[i, j]) + far * part[i, j]
            delayed[i, j] = value
