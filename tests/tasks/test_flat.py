"""Twenty runs in one process, as a sweep makes them: memory, file handles, threads and physics clients stay as they are."""

from __future__ import annotations

import gc

import psutil
import pybullet
import pytest

RUNS, SETTLED = 20, 5
GROWTH_MB = 40.0
"""Of memory, from the fifth run to the last; a leak of one recording a run would be more."""
pytestmark = pytest.mark.slow


def held() -> tuple[int, int, int]:
    """File handles, threads and PyBullet's clients of this process."""
    process = psutil.Process()
    return process.num_fds(), process.num_threads(), sum(pybullet.isConnected(c) for c in range(256))


@pytest.mark.parametrize("engine", ["pybullet", "mujoco"])
def test_twenty_runs_leave_nothing_behind(cli, tiny, engine):
    seen, memory = [], []
    for seed in range(RUNS):
        assert cli("+scenario=8", *tiny, f"seed={seed}", f"engine={engine}", "evaluator=serial").status == 0
        gc.collect()
        seen.append(held())
        memory.append(psutil.Process().memory_info().rss / 2**20)
    for name, before, after in zip(("handles", "threads", "clients"), seen[SETTLED - 1], seen[-1], strict=True):
        assert after <= before, f"{name}: {seen}"
    assert memory[-1] - memory[SETTLED - 1] < GROWTH_MB, memory
