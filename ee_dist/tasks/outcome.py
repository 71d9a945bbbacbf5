"""How well a recovery went, scored against the truth after the search is over."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ee_dist.effects.catalogue import Hypothesis
from ee_dist.recording.records import DIAGNOSIS, REPAIR, GenerationRecord, HypothesisRecord, TrialRecord
from ee_dist.recovery.observer import Observer

RESTORED = 0.9
"""Function counts as restored at this share of the intact distance."""


@dataclass(frozen=True)
class Score:
    """``recovered_fraction``: best compensating trial over the intact distance. ``found``: which true terms the last
    hypothesis names, by effect and place; ``invented``: which it names that are not true."""

    recovered_fraction: float
    restored: bool
    found: int
    true: int
    invented: int

    @property
    def right(self) -> bool:
        """Every true effect named at its place, and nothing else."""
        return self.found == self.true and self.invented == 0


def score(intact_m: float, trials_m: Sequence[float], believed: Hypothesis, truth: Hypothesis) -> Score:
    """Compare with the truth, distances in metres."""
    named, real = _places(believed), _places(truth)
    fraction = max(trials_m) / intact_m if intact_m > 0 else float("nan")
    return Score(fraction, fraction >= RESTORED, len(named & real), len(real), len(named - real))


def _places(hypothesis: Hypothesis) -> set[tuple[str, str]]:
    return {(t.effect, t.target) for t in hypothesis}


class ResultDigest(Observer):
    """Digest of all that a run found: logs, controllers, hypotheses and curves, but not how they were computed.

    Keeps the best of each generation on the way: ``fitness`` and ``dominants`` of the passes, repair and diagnosis.
    """

    def __init__(self) -> None:
        self._sum = hashlib.sha256()
        self.fitness: list[list[float]] = []
        self.dominants: dict[str, list[list[int]]] = {REPAIR: [], DIAGNOSIS: []}

    def pass_started(self, phase: str, pass_index: int, generations: int) -> None:
        self.dominants[phase].append([])
        if phase == REPAIR:
            self.fitness.append([])

    def generation(self, record: GenerationRecord) -> None:
        self.dominants[record.phase][-1].append(record.dominants)
        if record.phase == REPAIR:
            self.fitness[-1].append(record.best)
        self._add(record.phase, record.pass_index, record.generation, record.best, record.mean, record.dominants)

    def hypotheses(self, records: Sequence[HypothesisRecord]) -> None:
        for r in records:
            self._add(r.pass_index, r.generation, r.rank, r.terms, r.error, r.final)

    def trial(self, record: TrialRecord) -> None:
        self._add(record.index, record.source, record.driver.key, record.log.travel_m, record.believed)
        log = record.log
        for values in (log.times_s, log.sensors, log.commands, log.base_pose, log.joints, log.torques):
            if values is not None:
                self._sum.update(np.ascontiguousarray(values).tobytes())

    def _add(self, *values: object) -> None:
        self._sum.update(repr(values).encode())

    @property
    def hex(self) -> str:
        return self._sum.hexdigest()
