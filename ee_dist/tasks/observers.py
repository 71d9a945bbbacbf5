"""Passes what a run tells on to its recording, and keeps what its beliefs went through and what was measured."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ee_dist.recording.records import EVOLVING, HARDWARE, GenerationRecord, HypothesisRecord, TrialRecord
from ee_dist.recording.writer import RunWriter
from ee_dist.recovery.observer import Observer
from ee_dist.trials.log import SensorLog


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


class Measured(Observer):
    """The trials on hardware in their order: what drove each, and its log."""

    def __init__(self) -> None:
        self.trials: list[tuple[Any, SensorLog]] = []

    def trial(self, record: TrialRecord) -> None:
        if record.source == HARDWARE:
            self.trials.append((record.driver, record.log))
