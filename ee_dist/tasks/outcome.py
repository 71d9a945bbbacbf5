"""How well a recovery went, scored against the truth after the search is over."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ee_dist.effects.catalogue import Hypothesis

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
