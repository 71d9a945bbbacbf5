"""The values that a fit found, an effect's beside each other: many small ones are read by kind, not in a list."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ee_dist.discrepancy.evidence.intervals import ParameterReport
from ee_dist.discrepancy.words import is_share, plain, quantity
from ee_dist.effects.catalogue import CATALOGUE, Hypothesis, Term
from ee_dist.effects.groups import members_of
from ee_dist.robots.model import Robot

FINE = 1e-4
"""Share of a value below which its interval is told as it is: nobody reads seven digits."""


@dataclass(frozen=True)
class Kind:
    """One quantity of one effect at each of its places, in one unit (empty where it has none). ``neutral``: where it does
    nothing."""

    effect: str
    quantity: str
    unit: str
    neutral: float
    at: tuple[tuple[str, ParameterReport], ...]

    @property
    def name(self) -> str:
        """``coulomb friction, torque (N.m)``."""
        of = f", {self.quantity}" if self.quantity else ""
        return f"{self.effect}{of}{f' ({self.unit})' if self.unit else ''}"


def kinds_of(terms: Hypothesis, reports: Sequence[ParameterReport], robot: Robot) -> list[Kind]:
    """Every value in its kind, in the order in which the kinds are met."""
    found: dict[tuple[str, str, str, float], list[tuple[str, ParameterReport]]] = {}
    for p in reports:
        term = terms[p.term]
        effect = CATALOGUE[term.effect]
        unit = effect.unit(p.name, robot, term.target)
        share = is_share(term.effect, p.name)
        if share:
            p = replace(p, value=100 * p.value, low=100 * p.low, high=100 * p.high)
        shown = "%" if share else "" if unit in ("1", "channel") else unit
        key = (plain(term.effect), quantity(term, p.name, robot), shown, effect.neutral_values()[p.name])
        found.setdefault(key, []).append((plain(term.target) + _in_all(term, p.name, terms, robot), p))
    return [Kind(*key, tuple(at)) for key, at in found.items()]


def _in_all(term: Term, name: str, terms: Hypothesis, robot: Robot) -> str:
    """How much there is at a joint that has more or less beside what all share: nobody adds that up, or multiplies it, and less
    of it is no friction that drives."""
    effect = CATALOGUE[term.effect]
    others = [
        t
        for t in terms
        if t.effect == term.effect and term.target in members_of(robot, t.target, effect.targets(robot))
    ]
    parameter, values = effect.parameter(name), [dict(t.values)[name] for t in (term, *others)]
    if not others or not (parameter.on_top or parameter.by_ratio):
        return ""
    whole = math.prod(values) if parameter.by_ratio else sum(values)
    return f", {whole:.3g} in all, beside what is shared"


UNEVEN = 0.1
"""Share of half an interval that its middle may be off the value for it to be told as a plus and minus."""


def within(p: ParameterReport) -> str:
    """``0.2032 ± 0.0031``, with as many digits as the interval leaves, and in a word what is wrong with it; an
    interval that a bound cuts is told by its ends: ``218 (-90 to 300)``."""
    half, flag = (p.high - p.low) / 2, "; ".join(dict.fromkeys(f.partition(":")[0] for f in p.flag.split("; ")))
    if not np.isfinite(half):
        return f"{p.value:.3g} ({flag})" if flag else f"{p.value:.3g}"
    if half <= 0:
        return f"{p.value:.4g}"
    # One that a bound cuts at nothing would seem to go below it.
    if p.low == 0.0 or abs(p.value - (p.low + p.high) / 2) > UNEVEN * half:
        cut = f"{p.value:.3g} ({p.low:.3g} to {p.high:.3g})"
        return f"{cut[:-1]}; {flag})" if flag else cut
    digits = max(1 - math.floor(math.log10(half)), 0)  # two of the interval
    fine = half < FINE * abs(p.value)
    shown = f"{p.value:.4g} ± {half:.1g}" if fine else f"{round(p.value, digits) + 0.0:.{digits}f} ± {half:.{digits}f}"
    return f"{shown} ({flag})" if flag else shown
