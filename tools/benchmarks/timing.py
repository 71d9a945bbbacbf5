"""Times that can be compared on a machine that others use too: wall and processor time, interleaved, medians."""

from __future__ import annotations

import os
import platform
import statistics
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Sample:
    """Seconds that one measurement took. ``cpu_s`` counts all threads of this process."""

    wall_s: float
    cpu_s: float


Measurement = Callable[[], Sample]


def timed(work: Callable[[], object]) -> Sample:
    """How long one call takes."""
    wall, cpu = time.perf_counter(), time.process_time()
    work()
    return Sample(time.perf_counter() - wall, time.process_time() - cpu)


def interleaved(measurements: Mapping[str, Measurement], repeat: int) -> dict[str, list[Sample]]:
    """``repeat`` samples of each, taken in turn (A B A B ...): what disturbs the machine disturbs all alike."""
    found: dict[str, list[Sample]] = {name: [] for name in measurements}
    for _ in range(repeat):
        for name, measure in measurements.items():
            found[name].append(measure())
    return found


def median_cpu(samples: Sequence[Sample]) -> float:
    """Median processor time, s."""
    return statistics.median(s.cpu_s for s in samples)


def median_wall(samples: Sequence[Sample]) -> float:
    """Median wall time, s."""
    return statistics.median(s.wall_s for s in samples)


def median_ratio(above: Sequence[Sample], below: Sequence[Sample], clock: str = "cpu_s") -> float:
    """Median of the ratios of samples taken next to each other."""
    return statistics.median(
        getattr(a, clock) / max(getattr(b, clock), 1e-12) for a, b in zip(above, below, strict=True)
    )


def machine() -> dict[str, Any]:
    """What a reader must know of the machine to judge the numbers."""
    load = os.getloadavg()
    return {
        "cores": os.cpu_count() or 1,
        "load_1_min": round(load[0], 2),
        "shared": load[0] > 0.5,
        "python": platform.python_version(),
        "system": platform.system(),
        "processor": platform.machine(),
    }
