"""Judging: what each fitted candidate is worth on data that it was not fitted to, and which cannot be told apart."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ee_dist.discrepancy.candidates import Candidate
from ee_dist.discrepancy.fit import Fit, Model
from ee_dist.discrepancy.folds import bootstrap, per_segment
from ee_dist.discrepancy.problem import Problem
from ee_dist.effects.catalogue import Hypothesis
from ee_dist.trials.log import Array

LEAST_SHARE = 0.002
"""Share of the starting energy that an effect must take off held-out data to be worth a term."""
LOST_SHARE = 0.3
"""An interval that reaches zero counts against an effect only where it makes some segments worse by this share of its
gain: an effect that shows in one window of twenty, and harms none, is no less true for that."""
CAUTION = 2.0
"""By how much more an effect must gain than one did on an untouched robot: there the model's own error happened to look
like an effect, and on the next robot noise adds to it."""
TIE_ENERGY = 9.0
"""Two explanations closer than this (3 standard deviations, squared) on held-out data are not told apart."""


@dataclass(eq=False)
class Judged:
    """One candidate after the fit. Errors are root mean squares of residual values; ``gain`` and ``interval`` are shares
    of the held-out energy that it takes off; ``held`` is the held-out energy of each segment."""

    model: Model
    hypothesis: Hypothesis
    u: Array
    spread: Array
    error_fit: float
    error_heldout: float
    gain: float
    interval: tuple[float, float]
    earned: bool
    held: Array
    residual: Array
    slopes: Array
    rank: int = 0
    tied_with: list[str] = field(default_factory=list)
    why_not: str = ""

    @property
    def candidate(self) -> Candidate:
        return self.model.parts[-1]

    @property
    def name(self) -> str:
        return " + ".join(c.name for c in self.model.parts)


def least_energy(tried: int, parameters: int = 1) -> float:
    """Energy that the best of ``tried`` useless candidates may take off by luck, with a margin: the largest of that many
    chi-squared values with one degree of freedom is about 2 ln(tried), and every further parameter adds to it."""
    return 2.0 * math.log(max(tried, 2)) + 8.0 + 2.0 * parameters


def needed(problem: Problem, tried: int, parameters: int = 1) -> float:
    """Energy that an effect must take off held-out data: more than luck, and clearly more than the most promising effect
    took where nothing was wrong (``gained`` of a calibrated problem)."""
    return least_energy(tried, parameters) + CAUTION * float(getattr(problem, "gained", 0.0))


def judge(problem: Problem, base: Array, fits: Sequence[Fit], halves: Array, tried: int) -> Judged:
    """``fits`` are two of one model: fitted on half 0 and on half 1 of the segments. ``base`` (n,) is the residual of
    the model without it. Each judges the half that it has not seen."""
    first, second = fits
    e0, eb = per_segment(problem, first.residual), per_segment(problem, second.residual)
    held = np.where(halves == 1, e0, eb)
    seen = np.where(halves == 0, e0, eb)
    before = per_segment(problem, base)
    total, n = float(before.sum()), len(base)
    gained = before - held
    low, high = bootstrap(gained, groups=problem.trial_of_segment)
    gain = float(gained.sum())
    enough = needed(problem, tried, max(1, len(first.u)))
    why = ""
    if not np.isfinite(gain) or gain < enough:
        why = "its gain on held-out data is no more than luck"
    elif low <= 0 and lost(gained) > LOST_SHARE * gain:
        why = "its gain on held-out data may be zero"
    elif gain < LEAST_SHARE * total:
        why = f"it explains less than {LEAST_SHARE:.1%} of the residual"
    best = first if first.energy / max(1, first.mask.sum()) <= second.energy / max(1, second.mask.sum()) else second
    return Judged(
        model=best.model,
        hypothesis=best.hypothesis,
        u=(first.u + second.u) / 2 if len(first.u) and np.abs(first.u - second.u).max() < 0.05 else best.u,
        spread=np.minimum(first.spread(), second.spread()) / math.sqrt(2.0),
        error_fit=math.sqrt(max(float(seen.sum()), 0.0) / n),
        error_heldout=math.sqrt(max(float(held.sum()), 0.0) / n),
        gain=gain / total if total else 0.0,
        interval=(low / total, high / total) if total else (0.0, 0.0),
        earned=not why,
        held=held,
        residual=np.where(halves[problem.segment_of] == 1, first.residual, second.residual),
        slopes=best.slopes,
        why_not=why,
    )


def lost(gained: Array) -> float:
    """Energy that held-out segments lose where the effect makes them worse."""
    return float(-np.minimum(gained, 0.0).sum())


def ranked(found: Sequence[Judged]) -> list[Judged]:
    """Best held-out energy first; ties with the best are named."""
    ordered = sorted(found, key=lambda j: float(j.held.sum()))
    for k, j in enumerate(ordered):
        j.rank = k + 1
        j.tied_with = []
    for a, one in enumerate(ordered):
        for other in ordered[a + 1 :]:
            if one.earned and other.earned and tied(one, other):
                one.tied_with.append(other.name)
                other.tied_with.append(one.name)
    return ordered


def tied(one: Judged, other: Judged) -> bool:
    """Whether held-out data cannot tell which is better: the difference is small, or its interval holds zero."""
    gap = other.held - one.held
    if not np.isfinite(gap).all():
        return False
    low, high = bootstrap(gap, seed=1)
    return abs(float(gap.sum())) < TIE_ENERGY or low <= 0 <= high
