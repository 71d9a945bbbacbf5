"""What a problem is searched for: every effect that can show in its way of comparing."""

from __future__ import annotations

from collections.abc import Sequence

from ee_dist.discrepancy.problem import Problem
from ee_dist.discrepancy.search.candidates import Candidate, candidates


def pool_of(problem: Problem, without: Sequence[str] = (), only: Sequence[str] = ()) -> list[Candidate]:
    """Candidates at all places and groups, less those left out. Raises EffectError for names that do not exist."""
    found = candidates(problem.robot, without, only or None, problem.families)
    return [c for c in found if (c.size or problem.switches) and problem.shows(c.effect.name, c.target)]
