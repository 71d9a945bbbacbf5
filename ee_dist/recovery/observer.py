"""What watches a run: recorders and progress displays. The loop tells, and never waits for an answer."""

from __future__ import annotations

from collections.abc import Sequence

from ee_dist.recording.records import GenerationRecord, HypothesisRecord, TrialRecord


class Observer:
    """Does nothing; subclasses take what they need."""

    def pass_started(self, phase: str, pass_index: int, generations: int) -> None: ...

    def generation(self, record: GenerationRecord) -> None: ...

    def hypotheses(self, records: Sequence[HypothesisRecord]) -> None: ...

    def trial(self, record: TrialRecord) -> None: ...


class Observers(Observer):
    """Tells several, in order."""

    def __init__(self, *members: Observer) -> None:
        self.members = members

    def pass_started(self, phase: str, pass_index: int, generations: int) -> None:
        for m in self.members:
            m.pass_started(phase, pass_index, generations)

    def generation(self, record: GenerationRecord) -> None:
        for m in self.members:
            m.generation(record)

    def hypotheses(self, records: Sequence[HypothesisRecord]) -> None:
        for m in self.members:
            m.hypotheses(records)

    def trial(self, record: TrialRecord) -> None:
        for m in self.members:
            m.trial(record)
