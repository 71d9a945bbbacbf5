"""The same measurement in several processes at once, as a run with several workers loads the machine."""

from __future__ import annotations

import multiprocessing
import statistics
from collections.abc import Callable
from typing import TypeVar

Setting = TypeVar("Setting")


def at_once(measure: Callable[[Setting], dict[str, float]], setting: Setting, processes: int) -> dict[str, float]:
    """Median over ``processes`` that measure side by side; in this process if it is one."""
    if processes == 1:
        return measure(setting)
    # Spawned, not forked: a physics engine does not survive a fork.
    with multiprocessing.get_context("spawn").Pool(processes) as pool:
        found = pool.map(measure, [setting] * processes, chunksize=1)
    return {key: statistics.median(f[key] for f in found) for key in found[0]}
