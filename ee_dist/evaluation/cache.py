"""One cache in front of any evaluator, keyed by what is physically simulated and what is kept of it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ee_dist.evaluation.jobs import Evaluator, Job


class CachedEvaluator:
    """Simulates each key once. Equal jobs within one call are one simulation too."""

    def __init__(self, inner: Evaluator) -> None:
        self.inner = inner
        self.counts = inner.counts
        self._known: dict[str, Any] = {}

    def evaluate(self, jobs: Sequence[Job]) -> list[Any]:
        keys = [job.key for job in jobs]
        fresh: dict[str, Job] = {}
        for key, job in zip(keys, jobs, strict=True):
            if key not in self._known:
                fresh.setdefault(key, job)
        before = self.counts.copy()
        if fresh:
            self._known.update(zip(fresh, self.inner.evaluate(list(fresh.values())), strict=True))
        self.counts.asked = before.asked + len(jobs)
        self.counts.asked_steps = before.asked_steps + sum(j.rollout.steps for j in jobs)
        return [self._known[key] for key in keys]

    def close(self) -> None:
        self._known.clear()
        self.inner.close()


def with_cache(evaluator: Evaluator, enabled: bool) -> Evaluator:
    return CachedEvaluator(evaluator) if enabled else evaluator
