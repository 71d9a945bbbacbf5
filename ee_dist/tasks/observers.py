"""Passes what a run tells on to its recording, and keeps what its beliefs went through."""

from __future__ import annotations

from collections.abc import Sequence

from ee_dist.recording.records import EVOLVING, GenerationRecord, HypothesisRecord, TrialRecord
from ee_dist.recording.writer import RunWriter
from ee_dist.recovery.observer import Observer


class Recorder(Observer):
    """Writes every trial, hypothesis and generation."""

    def __init__(self, writer: RunWriter) -> None:
        self.writer = writer

    def generation(self, record: GenerationRecord) -> None:
        self.writer.generation(record)

    def hypotheses(self, records: Sequence[HypothesisRecord]) -> None:
        self.writer.hypotheses(records)

    def trial(self, record: TrialRecord) -> None:
        self.writer.trial(record)


class Beliefs(Observer):
    """The error of each diagnosis by stage: ``[{"evolved": ..., "polished": ..., "pruned": ...}, ..]``, those that were run."""

    def __init__(self) -> None:
        self.stages: list[dict[str, float]] = []

    def hypotheses(self, records: Sequence[HypothesisRecord]) -> None:
        for r in records:
            if r.stage == EVOLVING or r.rank:
                continue
            if r.pass_index == len(self.stages):
                self.stages.append({})
            self.stages[r.pass_index][r.stage] = r.error
