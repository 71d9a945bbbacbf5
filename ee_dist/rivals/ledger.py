"""What a rival costs by itself, whoever simulated the same before."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ee_dist.evaluation.jobs import Counts, Evaluator, Job


class Ledger:
    """An evaluator that counts each thing simulated once for the rival that it is made for, and asks ``inner`` for all.

    Rivals share what was simulated: the intact robot's controllers are evolved once. Each is charged as if it were alone.
    """

    def __init__(self, inner: Evaluator) -> None:
        self.inner = inner
        self.counts = Counts()
        self._charged: set[str] = set()

    def evaluate(self, jobs: Sequence[Job]) -> list[Any]:
        for job in jobs:
            self.counts.asked += 1
            self.counts.asked_steps += job.rollout.steps
            if job.key not in self._charged:
                self._charged.add(job.key)
                self.counts.simulated += 1
                self.counts.steps += job.rollout.steps
        return self.inner.evaluate(jobs)

    def close(self) -> None:
        """What is inside belongs to others too."""
