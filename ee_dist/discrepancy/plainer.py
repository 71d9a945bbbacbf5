"""Richer laws that say no more than a plainer one: a spring with its rest far away is an offset.

A law of two numbers always takes a little more than one of one, and is found first for that. Whether the second is worth
anything is asked in the end, when all else that acts there is in the model.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ee_dist.discrepancy.evidence.holdout import PRIOR, Cut, HeldOut, cross_fit, held_by_slopes
from ee_dist.discrepancy.examine import Current
from ee_dist.discrepancy.pruning import AGAIN, allowed_loss
from ee_dist.discrepancy.search.candidates import Candidate
from ee_dist.discrepancy.search.fitted import Fit, Model
from ee_dist.discrepancy.search.search import Search
from ee_dist.discrepancy.search.slopes import WIDTHS
from ee_dist.discrepancy.search.valley import LARGE, follow_valley
from ee_dist.trials.log import Array


@dataclass(frozen=True, eq=False)
class Plain:
    """The model ``then`` with plainer laws; names of those that ``gone`` and of what ``came`` in their places."""

    then: Current
    gone: tuple[str, ...] = ()
    came: tuple[str, ...] = ()


def in_plain_terms(search: Search, current: Current, own: int, pool: Sequence[Candidate], cut: Cut) -> Plain:
    """The model with the plainer law in the place of each richer one, from part ``own`` on, that data held out miss no more than
    a term that is left out, one after the other."""
    gone, came, by_name = list[str](), list[str](), {c.name: c for c in pool}
    whole: Fit | None = None
    for rich in current.parts[own:]:
        plain = by_name.get(f"{rich.effect.plainer}@{rich.target}")
        if plain is None or plain.name in {c.name for c in current.parts}:
            continue
        model = Model(current.parts)
        k = model.parts.index(rich)
        start = np.concatenate([np.delete(current.u, model.places[k]), np.zeros(plain.size)])
        whole = whole or _fitted(search, model, current.u)
        fit = _fitted(search, Model((*model.parts[:k], *model.parts[k + 1 :], plain)), start)
        with_it, without = _held_out(search, whole, fit, cut)
        if without.energy - with_it.energy <= allowed_loss(search.problem, with_it.energy, cut, len(pool)):
            current, whole = Current(fit.model.parts, fit.u), fit
            gone.append(rich.name)
            came.append(plain.name)
    return Plain(current, tuple(gone), tuple(came))


def _fitted(search: Search, model: Model, u: Array) -> Fit:
    (fit,) = follow_valley(search, [(model, u)], search.everything, PRIOR, widths=(*WIDTHS[1:3], AGAIN))
    return fit


def _held_out(search: Search, whole: Fit, fit: Fit, cut: Cut) -> Sequence[HeldOut]:
    """Of many values by slopes that are known: fits anew of each turn take as long as all the rest."""
    if len(whole.u) >= LARGE:
        return held_by_slopes(search, [whole, fit], cut)
    return cross_fit(search, [(f.model, f.u) for f in (whole, fit)], cut, WIDTHS[1:])
