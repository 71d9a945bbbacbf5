"""In how many simulated cases a verdict that looked like this one was right.

What an effect takes off held-out data says how well it explains them, not whether its name is right: a twin that nobody
listed explains them as well. How often it is right was counted, on robots of which the truth is known, and follows three
signs by logistic regression (Cox 1958, "The regression analysis of binary sequences").
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import astuple, dataclass

from ee_dist.discrepancy.evidence.judge import TIE_ENERGY, contains
from ee_dist.discrepancy.evidence.rule import least_energy
from ee_dist.discrepancy.explain import EFFECT, NOTHING_MISSING, UNEXPLAINED, Explanation

COUNTED_WAY = "open_loop"
"""The way of comparing of all cases that were counted; of the others nobody knows."""
FEWEST = 10
"""Cases of a verdict from which a rate says anything."""
MOST = 3.0
"""Powers of ten from where a sign says no more."""


@dataclass(frozen=True)
class Signs:
    """What can be seen of an effect that was found. ``evidence``: log10 of the energy that it takes off held-out data, over
    what the best of as many useless ones may take by luck; ``ahead``: log10 of how far the next best that is not tied with it
    falls behind, over where a tie ends (the most, where there is none); ``rest``: 1 where more than noise is left, else 0."""

    evidence: float
    ahead: float
    rest: float


@dataclass(frozen=True)
class Rule:
    """Log odds of an effect being right: ``constant`` and ``weights`` of the signs; ``misfit``: the largest error over the
    noise floor among the cases in which one was found; ``counted``: of the other verdicts, how many cases ended in each and
    in how many it was right."""

    constant: float
    weights: Signs
    misfit: float
    counted: Mapping[str, tuple[int, int]]


RULE = Rule(0.848, Signs(0.449, 0.44, -1.174), 13.6, {NOTHING_MISSING: (56, 53), UNEXPLAINED: (13, 10)})
"""By ``tools/reliability.py``; the commands, and how well it foretells cases that it was not fitted to, are in docs/trust.md."""


def signs_of(found: Explanation) -> Signs | None:
    """None where no effect was found."""
    best = found.best
    if best is None:
        return None
    taken = best.gain * float(found.base @ found.base)
    luck = best.dispersion * least_energy(found.tried, max(1, best.proposal.size))
    others = [
        float(j.held.sum())
        for j in found.candidates
        if j is not best and j.name not in best.tied_with and not contains(j, best)
    ]
    behind = min(others) - float(best.held.sum()) if others else math.inf
    rest = 1.0 if found.left else 0.0
    return Signs(_power(taken / luck, 0.0), _power(behind / (TIE_ENERGY * best.dispersion), -1.0), rest)


def _power(ratio: float, least: float) -> float:
    """log10 within what says anything."""
    return min(max(math.log10(max(ratio, 1e-12)), least), MOST) if math.isfinite(ratio) else MOST


def misfit_of(found: Explanation) -> float:
    """Error over the noise floor, with the effect that was found."""
    error = found.refitted_error if found.best is None else found.best.error_heldout
    return error / found.noise_floor if found.noise_floor > 0 else math.inf


def confidence(way: str, found: Explanation, rule: Rule = RULE) -> float | None:
    """Share of simulated cases that looked like this one in which the verdict was right (an effect: it, or one that is told as
    tied with it, was hidden); None where too few looked like it to tell. ``way`` is that of comparing."""
    if way != COUNTED_WAY:
        return None
    signs = signs_of(found)
    if found.verdict == EFFECT and signs is not None:
        return foretold(signs, rule) if misfit_of(found) <= rule.misfit else None
    cases, right = rule.counted.get(found.verdict, (0, 0))
    return (right + 1) / (cases + 2) if cases >= FEWEST else None


def foretold(signs: Signs, rule: Rule = RULE) -> float:
    """Probability that an effect with these signs is right."""
    odds = rule.constant + sum(w * s for w, s in zip(astuple(rule.weights), astuple(signs), strict=True))
    return 1.0 / (1.0 + math.exp(-odds))
