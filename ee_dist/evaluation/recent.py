"""The last logs kept whole, so that another look at the same motion is no new simulation.

A cache remembers what was asked of a log, and grows with every question. Here the question may change from one to the
next (the curve of a channel, then the error of a trial), and memory stays bounded: for a person who moves a slider.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Sequence
from typing import Any

from ee_dist.evaluation.jobs import Evaluator, Job, Whole
from ee_dist.trials.log import SensorLog

MOST_BYTES = 256 * 2**20


class RecentEvaluator:
    """Simulates what is not among the last logs. Same results as ``inner`` gives. ``most``: bytes of logs that are kept."""

    def __init__(self, inner: Evaluator, most: int = MOST_BYTES) -> None:
        self.inner, self.most = inner, most
        self.counts = inner.counts
        self._logs: OrderedDict[str, SensorLog] = OrderedDict()
        self._held = 0

    def evaluate(self, jobs: Sequence[Job]) -> list[Any]:
        keys = [job.rollout.key for job in jobs]
        fresh: dict[str, Job] = {}
        for key, job in zip(keys, jobs, strict=True):
            if key not in self._logs:
                fresh.setdefault(key, Job(job.rollout, Whole()))
        before = self.counts.copy()
        simulated = dict(zip(fresh, self.inner.evaluate(list(fresh.values())), strict=True)) if fresh else {}
        self.counts.asked_since(before, jobs)
        found = [
            job.reduction(simulated[key] if key in simulated else self._logs[key])
            for key, job in zip(keys, jobs, strict=True)
        ]
        for key in keys:
            if key not in simulated:
                self._logs.move_to_end(key)
        for key, log in simulated.items():
            self._logs[key] = log
            self._held += size_of(log)
        while self._held > self.most:
            self._held -= size_of(self._logs.popitem(last=False)[1])
        return found

    def close(self) -> None:
        self._logs.clear()
        self._held = 0
        self.inner.close()


def size_of(log: SensorLog) -> int:
    """Bytes of a log's arrays."""
    parts = (log.times_s, log.sensors, log.commands, log.base_pose, log.joints, log.torques, log.supply_v, log.external)
    return sum(a.nbytes for a in parts if a is not None)
