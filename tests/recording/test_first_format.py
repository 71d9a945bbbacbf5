"""Recordings of the first format are read in the words of this one."""

from __future__ import annotations

from recording_samples import LOST_LEG, sample_log

from ee_dist.effects.catalogue import Term
from ee_dist.engines.drivers import Network
from ee_dist.recording import topics
from ee_dist.recording.reader import read_run
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
from ee_dist.recording.writer import RunWriter
from ee_dist.robots.quadruped import quadruped


def test_a_last_population_and_predictions_made_afterwards(tmp_path, monkeypatch) -> None:
    """As the first format had them: a whole last population final, no stage, predictions after the diagnosis."""
    monkeypatch.setattr(topics, "FORMAT", topics.FIRST_FORMAT)
    log, driver = sample_log(0, rows=3), Network(())
    foot = (Term("part_lost", "lower_rear_left"),)
    with RunWriter(tmp_path / "old.mcap", quadruped()) as writer:
        for k, name in enumerate(("intact", "after the change", "trial 1")):
            writer.trial(TrialRecord(k, name, HARDWARE, driver, log))
            if k == 1:
                writer.generation(GenerationRecord(DIAGNOSIS, 0, 0, 0.5, 0.6, 1, 2, 2))
                writer.hypothesis(HypothesisRecord(0, 0, 0, LOST_LEG, 0.5, stage=""))
                for rank, terms in enumerate((LOST_LEG, foot)):
                    writer.hypothesis(HypothesisRecord(0, 0, rank, terms, 0.5 + rank, final=True, stage=""))
            writer.trial(TrialRecord(k, name, PREDICTION, driver, log, LOST_LEG if k else ()))
            if k == 1:
                writer.generation(GenerationRecord(REPAIR, 1, 0, 1.0, 0.5, 1, 2, 2))
    monkeypatch.undo()
    run = read_run(tmp_path / "old.mcap")
    assert run.complete
    assert [t.source for t in run.trials if t.source != HARDWARE] == [PREDICTION, HINDSIGHT, PREDICTION]
    assert [(h.rank, h.stage, h.final) for h in run.hypotheses] == [
        (0, EVOLVING, False),
        (0, EVOLVED, True),
        (1, EVOLVED, False),
    ]
