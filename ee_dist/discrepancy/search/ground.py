"""What candidates are compared on: some trials, and what the model as it is leaves there."""

from __future__ import annotations

from dataclasses import dataclass

from ee_dist.discrepancy.search.refit import Refit
from ee_dist.discrepancy.search.search import Search
from ee_dist.trials.log import Array

FAR = 4.0
"""Error over the noise floor from which a small probe speaks against no side: a leg described with rotors ten times too heavy
swings beyond its resonance, where a little more is better and so is much less."""


@dataclass(frozen=True, eq=False)
class Ground:
    """The trials of a ``search``, on top of what it has fixed; what ``refit`` leaves there of the model as it is (n,), and the
    energy of that."""

    search: Search
    refit: Refit
    base: Array
    total: float

    @classmethod
    def of(cls, search: Search, refit: Refit) -> Ground:
        refit = refit.among(search)
        base = refit(search.base())
        return cls(search, refit, base, float(base @ base))

    @property
    def far(self) -> bool:
        """Whether the model is off by so much that slopes say little."""
        return self.total > FAR**2 * float(self.search.problem.floor[self.search.everything].sum())
