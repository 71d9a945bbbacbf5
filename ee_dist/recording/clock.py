"""The clock of a run: where trials and generations stand on the time line of a viewer.

A run searches for minutes between trials of seconds, and the same seed must give the same bytes, so log times do not
come from the clock on the wall. Each trial has an interval of its own, one second after what came before; a prediction
shares the interval of the hardware trial of the same index; a generation takes ten milliseconds.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ee_dist.trials.log import Array

SECOND_NS = 1_000_000_000
GAP_NS = SECOND_NS
GENERATION_NS = 10_000_000
_LONGEST_S = 1e6


class RunClock:
    """Nanoseconds since the start of the run."""

    def __init__(self) -> None:
        self.now_ns = 0
        self._starts: dict[int, int] = {}

    def trial(self, index: int, length_ns: int) -> int:
        """Start of the interval of trial ``index``, which is at least ``length_ns`` long."""
        if index not in self._starts:
            self._starts[index] = self.now_ns + GAP_NS if self.now_ns else 0
        start = self._starts[index]
        self.now_ns = max(self.now_ns, start + length_ns)
        return start

    def generation(self) -> int:
        """Time of the next generation."""
        self.now_ns += GENERATION_NS
        return self.now_ns


def offsets_ns(times_s: Array) -> NDArray[np.int64]:
    """Whole nanoseconds (T,) since the first row, for log times only: the rows themselves keep ``times_s`` exactly.

    A time that is no number counts as the first row's, and none is earlier than it.
    """
    if not len(times_s):
        return np.zeros(0, dtype=np.int64)
    with np.errstate(invalid="ignore", over="ignore"):
        since = np.nan_to_num(times_s - times_s[0], nan=0.0)
    whole: NDArray[np.int64] = np.rint(np.clip(since, 0.0, _LONGEST_S) * SECOND_NS).astype(np.int64)
    return whole
