"""The digest of a run of the loop: of all that it found, and of nothing about how that was computed or told."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence

import numpy as np

from ee_dist.recording.records import (
    DIAGNOSIS,
    EVOLVED,
    EVOLVING,
    HARDWARE,
    HINDSIGHT,
    PREDICTION,
    REPAIR,
    GenerationRecord,
    HypothesisRecord,
    TrialRecord,
)
from ee_dist.recovery.observer import Observer


class ResultDigest(Observer):
    """Digest of logs, controllers, evolved hypotheses and curves.

    The digest of a trial is that of the hardware and of one model beside it: in hindsight where there was a diagnosis
    after it, else the prediction. Beliefs are in it as the models behind these. Later beliefs, polished or pruned, are
    thus told only once, and a digest does not change with the number of stages that are recorded.

    Keeps the best of each generation on the way: ``fitness`` of the repair passes, and ``dominants`` of the passes of each phase.
    """

    def __init__(self) -> None:
        self._sum = hashlib.sha256()
        self._awaiting: TrialRecord | None = None
        self.fitness: list[list[float]] = []
        self.dominants: dict[str, list[list[int]]] = {REPAIR: [], DIAGNOSIS: []}

    def pass_started(self, phase: str, pass_index: int, generations: int) -> None:
        self.dominants.setdefault(phase, []).append([])
        if phase == REPAIR:
            self.fitness.append([])

    def generation(self, record: GenerationRecord) -> None:
        self.dominants[record.phase][-1].append(record.dominants)
        if record.phase == REPAIR:
            self.fitness[-1].append(record.best)
        self._add(record.phase, record.pass_index, record.generation, record.best, record.mean, record.dominants)

    def hypotheses(self, records: Sequence[HypothesisRecord]) -> None:
        for r in records:
            if r.stage in (EVOLVING, EVOLVED) and not r.final:
                self._add(r.pass_index, r.generation, r.rank, r.terms, r.error, r.stage == EVOLVED)

    def trial(self, record: TrialRecord) -> None:
        if record.source == PREDICTION:
            self._settle()
            self._awaiting = record
        elif record.source == HINDSIGHT:
            self._awaiting = None
            self._take(record)
        else:
            self._take(record)

    def _settle(self) -> None:
        """Take the prediction of a trial on which no diagnosis followed."""
        if self._awaiting is not None:
            self._take(self._awaiting)
            self._awaiting = None

    def _take(self, record: TrialRecord) -> None:
        source = HARDWARE if record.source == HARDWARE else PREDICTION
        self._add(record.index, source, record.driver.key, record.log.travel_m, record.believed)
        log = record.log
        for values in (log.times_s, log.sensors, log.commands, log.base_pose, log.joints, log.torques):
            if values is not None:
                self._sum.update(np.ascontiguousarray(values).tobytes())

    def _add(self, *values: object) -> None:
        self._sum.update(repr(values).encode())

    @property
    def hex(self) -> str:
        """Of the run so far; asked at its end."""
        self._settle()
        return self._sum.hexdigest()
