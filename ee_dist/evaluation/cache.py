"""One cache in front of any evaluator, keyed by what is physically simulated and what is kept of it."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

from ee_dist.evaluation.gathered import ask
from ee_dist.evaluation.jobs import Evaluator, Job

MOST_BYTES = 512 * 2**20
"""Bytes of results that are kept. Numbers take none to speak of; what is kept of logs of minutes does, and the oldest goes."""


class CachedEvaluator:
    """Simulates each key once, as long as its result is kept. Equal jobs within one call are one simulation always. ``most``:
    bytes of arrays that are kept; what went is simulated again, with the same result. Searches that go side by side ask in one
    call."""

    def __init__(self, inner: Evaluator, most: int = MOST_BYTES) -> None:
        self.inner, self.most = inner, most
        self.counts = inner.counts
        self._known: dict[str, Any] = {}
        self._sizes: OrderedDict[str, int] = OrderedDict()
        """Of what takes room, oldest first: among hundreds of thousands of results nobody looks for the oldest each time."""
        self._held = 0

    def evaluate(self, jobs: Sequence[Job]) -> list[Any]:
        return ask(self._evaluate, jobs)

    def _evaluate(self, jobs: Sequence[Job]) -> list[Any]:
        keys = [job.key for job in jobs]
        fresh: dict[str, Job] = {}
        for key, job in zip(keys, jobs, strict=True):
            if key not in self._known:
                fresh.setdefault(key, job)
        before = self.counts.copy()
        if fresh:
            found = dict(zip(fresh, self.inner.evaluate(list(fresh.values())), strict=True))
            self._known.update(found)
            sizes = {key: size for key, result in found.items() if (size := size_of(result))}
            self._sizes.update(sizes)
            self._held += sum(sizes.values())
        self.counts.asked_since(before, jobs)
        results = [self._known[key] for key in keys]
        self._forget()
        return results

    def _forget(self) -> None:
        """The oldest results that take room, until the rest fits."""
        while self._held > self.most:
            oldest, size = self._sizes.popitem(last=False)
            self._held -= size
            del self._known[oldest]

    def close(self) -> None:
        self._known.clear()
        self._sizes.clear()
        self._held = 0
        self.inner.close()


def size_of(result: Any) -> int:
    """Bytes of the arrays in a result: one, or the fields of a record."""
    if isinstance(result, np.ndarray):
        return result.nbytes
    if is_dataclass(result) and not isinstance(result, type):
        return sum(v.nbytes for f in fields(result) if isinstance(v := getattr(result, f.name), np.ndarray))
    return 0


def with_cache(evaluator: Evaluator, enabled: bool) -> Evaluator:
    return CachedEvaluator(evaluator) if enabled else evaluator
