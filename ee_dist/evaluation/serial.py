"""The reference evaluator: this process, one engine."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ee_dist.engines.contract import Engine
from ee_dist.evaluation.jobs import Counts, Job

MOST_AT_ONCE = 1_500_000
"""Robot-steps whose logs are in memory together, some hundred MB: long rollouts go in smaller chunks, with the same results."""


def run_jobs(engine: Engine, jobs: Sequence[Job], chunk: int) -> list[Any]:
    """Results of the jobs, simulated ``chunk`` at a time."""
    chunk = max(1, min(chunk, MOST_AT_ONCE // max((j.rollout.steps for j in jobs), default=1)))
    results: list[Any] = []
    for k in range(0, len(jobs), chunk):
        some = jobs[k : k + chunk]
        logs = engine.rollout([j.rollout for j in some])
        results.extend(j.reduction(log) for j, log in zip(some, logs, strict=True))
    return results


class SerialEvaluator:
    """Implements ``ee_dist.evaluation.jobs.Evaluator``."""

    def __init__(self, engine: Engine, chunk: int = 256) -> None:
        if chunk < 1:
            raise ValueError(f"evaluator: chunk must be 1 or more, not {chunk}")
        self.engine, self.chunk = engine, chunk
        self.counts = Counts()

    def evaluate(self, jobs: Sequence[Job]) -> list[Any]:
        self.counts.add(jobs)
        return run_jobs(self.engine, jobs, self.chunk)

    def close(self) -> None:
        self.engine.close()
