"""Records of the first format in the words of this one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ee_dist.recording.records import (
    DIAGNOSIS,
    EVOLVED,
    EVOLVING,
    HARDWARE,
    HINDSIGHT,
    PREDICTION,
    GenerationRecord,
    HypothesisRecord,
    TrialRecord,
)

Record = TrialRecord | HypothesisRecord | GenerationRecord


def upgraded(records: Sequence[Record]) -> list[Record]:
    """The records, with what they meant.

    ``final`` was said of a whole last population; here the best of it stands for what was believed, which that format
    told nowhere but behind predictions. A prediction that came after a diagnosis of its trial was hindsight.
    """
    found: list[Record] = []
    diagnosed, waiting = False, False
    for r in records:
        if isinstance(r, HypothesisRecord):
            # The file names no stage: those of a last population were marked, the bests of generations were not.
            found.append(replace(r, stage=EVOLVED, final=r.rank == 0) if r.final else replace(r, stage=EVOLVING))
        elif isinstance(r, TrialRecord):
            if r.source == PREDICTION and diagnosed and waiting:
                r = replace(r, source=HINDSIGHT)
            diagnosed, waiting = False, r.source == HARDWARE
            found.append(r)
        else:
            diagnosed = diagnosed or r.phase == DIAGNOSIS
            found.append(r)
    return found
