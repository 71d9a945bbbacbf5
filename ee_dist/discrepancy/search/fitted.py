"""What is fitted, and what comes of it: a model with free values, and the values that suit the measurements best."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ee_dist.discrepancy.problem import Mask
from ee_dist.discrepancy.search.candidates import Candidate
from ee_dist.effects.catalogue import Hypothesis
from ee_dist.trials.log import Array


@dataclass(frozen=True, eq=False)
class Model:
    """Candidates whose values are free, in order."""

    parts: tuple[Candidate, ...]

    @property
    def lower(self) -> Array:
        return np.concatenate([c.lower for c in self.parts] or [np.zeros(0)])

    @property
    def upper(self) -> Array:
        return np.concatenate([c.upper for c in self.parts] or [np.zeros(0)])

    @property
    def places(self) -> list[slice]:
        """Where the values of each part are."""
        edges = np.concatenate([[0], np.cumsum([c.size for c in self.parts])]).astype(int)
        return [slice(int(a), int(b)) for a, b in pairwise(edges)]

    def as_seen(self, u: Array) -> Array:
        """(P,) values with what the measurements show of some by themselves."""
        out = np.array(u, dtype=float)
        for c, place in zip(self.parts, self.places, strict=True):
            if c.hint:
                out[place] = c.hint
        return out

    def hypothesis(self, u: Array) -> Hypothesis:
        terms, at = [], 0
        for c in self.parts:
            terms.append(c.term(u[at : at + c.size]))
            at += c.size
        return tuple(terms)


@dataclass(frozen=True, eq=False)
class Fit:
    """``energy``: sum of squares of the residual values that were fitted. ``slopes`` (n, P): the last derivatives."""

    model: Model
    u: Array
    energy: float
    residual: Array
    slopes: Array
    mask: Mask

    @property
    def hypothesis(self) -> Hypothesis:
        return self.model.hypothesis(self.u)
