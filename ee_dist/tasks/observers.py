"""Passes what a run tells on to its recording."""

from __future__ import annotations

from collections.abc import Sequence

from ee_dist.recording.records import GenerationRecord, HypothesisRecord, TrialRecord
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
