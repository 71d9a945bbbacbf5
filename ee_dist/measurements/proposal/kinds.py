"""Files of several formats side by side: where those of one say all that is asked for, the others are left out."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from ee_dist.measurements.errors import MeasurementError
from ee_dist.measurements.proposal.files import proposal_for
from ee_dist.measurements.proposal.model import Hints, Proposal
from ee_dist.measurements.readers import kind_of
from ee_dist.robots.model import Robot


def proposal_of_kinds(files: Sequence[Path], robot: Robot, hints: Hints) -> tuple[Proposal, list[Path]]:
    """The proposal for files, and which of them it is for: all, or, where that leaves something open, those of the first format
    that leaves nothing, which the mapping then names. Raises MeasurementError."""
    kinds = [kind for kind, _ in Counter(map(kind_of, files)).most_common()]
    problem: MeasurementError | None = None
    every: Proposal | None = None
    try:
        every = proposal_for(files, robot, hints)
    except MeasurementError as error:
        problem = error
    if len(kinds) > 1 and (every is None or every.questions):
        for kind in kinds:
            own = [f for f in files if kind_of(f) == kind]
            found = _whole(own, robot, hints)
            if found is not None:
                left = [f.name for f in files if f not in own]
                more = f" and {len(left) - 1} more" if len(left) > 1 else ""
                found.notes.insert(0, f"{left[0]}{more} left out: the files of format {kind} say all that is asked for")
                found.head = {"format": kind} | found.head
                return found, own
    if every is None:
        assert problem is not None
        raise problem
    return every, list(files)


def _whole(files: Sequence[Path], robot: Robot, hints: Hints) -> Proposal | None:
    """The proposal for files of one format, if it leaves nothing open."""
    try:
        found = proposal_for(files, robot, hints)
    except MeasurementError:
        return None
    return None if found.questions else found
