"""Many plain effects at once, where none earns its place alone: fitted together, then the least needed left out one by one.

A robot that is a little wrong everywhere hides each of its faults behind the others: what one effect takes off the residual
the next puts back. All of them together fit, and how far they can be thinned out without loss says which are there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ee_dist.discrepancy.evidence.holdout import PRIOR, Cut, HeldOut, cross_fit, unsure
from ee_dist.discrepancy.evidence.judge import WORTH, least_energy
from ee_dist.discrepancy.examine import Current
from ee_dist.discrepancy.search.candidates import Candidate
from ee_dist.discrepancy.search.fit import fit_all
from ee_dist.discrepancy.search.fitted import Model
from ee_dist.discrepancy.search.screen import Screened
from ee_dist.discrepancy.search.search import Search
from ee_dist.discrepancy.search.slopes import WIDTHS
from ee_dist.effects.groups import groups
from ee_dist.trials.log import Array

MOST_AT_ONCE = 20
"""Effects that are tried together."""
FAMILIES = ("body", "drive", "world")
"""Of these families: what is wrong with a robot a little everywhere."""
BEGIN = 0.02
"""Share of each bound to begin from: at neutral some effects have no slope."""
LEFT_OUT = 0.25
"""Share of WORTH that leaving an effect out may cost: it is one of many."""


@dataclass(frozen=True, eq=False)
class Together:
    """``parts`` with values ``u``, and the outcome on data held out."""

    parts: tuple[Candidate, ...]
    u: Array
    held: HeldOut


def together(search: Search, current: Current, own: int, screened: Sequence[Screened], cut: Cut) -> Together | None:
    """The model with as many plain effects as its data need, or None where that is not worth it. The first ``own`` parts of
    the current model stay."""
    new = plain(search, screened)
    if len(new) < 2:
        return None
    parts = (*current.parts, *new)
    model, kept_values = Model(parts), sum(c.size for c in parts[:own])
    # What was added greedily stands in for what was not: once from there, and once from a little of everything.
    greedy = np.concatenate([current.u, np.zeros(len(new))])
    afresh = np.where(np.arange(len(greedy)) < kept_values, greedy, BEGIN * model.upper)
    prior = PRIOR * unsure(search, [(model, greedy)])
    fits = fit_all(search, [(model, greedy), (model, afresh)], None, (*WIDTHS[:2], *WIDTHS), prior)
    fit = min(fits, key=lambda f: f.energy)
    free = np.concatenate([np.full(c.size, k >= own) for k, c in enumerate(parts)])
    path = thinned(fit.slopes, fit.u, np.repeat(np.arange(len(parts)), [c.size for c in parts]), free, prior)
    models = []
    for kept in path:
        values = np.concatenate([fit.u[_place(parts, k)] for k in kept] or [np.zeros(0)])
        models.append((Model(tuple(parts[k] for k in kept)), values))
    now, *held = cross_fit(search, [(Model(current.parts), current.u), *models], cut)
    energies = np.array([float((h.residual**2).sum()) for h in held])
    if not np.isfinite(energies).any():
        return None
    floor, before = float(search.problem.floor.sum()), float((now.residual**2).sum())
    best = float(np.nanmin(energies))
    each = max(
        least_energy(len(screened)) * max(1.0, best / len(search.problem.floor)), LEFT_OUT * WORTH * (best - floor)
    )
    # The fewest effects from which on leaving one out costs more than one may be worth.
    chosen = 0
    for k in range(1, len(path)):
        if energies[k] - best > each:
            break
        chosen = k
    worth = max(least_energy(len(screened)) * max(1.0, before / len(search.problem.floor)), WORTH * (before - floor))
    if not before - energies[chosen] > worth:
        return None
    model, values = models[chosen]
    final = fit_all(search, [(model, values)], None, WIDTHS[1:], prior)[0]
    return Together(model.parts, final.u, held[chosen])


def plain(search: Search, screened: Sequence[Screened]) -> list[Candidate]:
    """Effects of one number, of all joints, parts or sensors alike where there are several, that move the prediction: the
    most promising of them."""
    shared = groups(search.problem.robot)
    several = {name for names in shared.values() for name in names}
    able = [
        s
        for s in screened
        if s.candidate.effect.family in FAMILIES
        and s.candidate.size == 1
        and not s.candidate.inert
        and s.candidate.target not in several
        and s.reach > 1.0
    ]
    return [s.candidate for s in sorted(able, key=lambda s: -s.promise)[:MOST_AT_ONCE]]


def thinned(slopes: Array, u: Array, part_of: Array, free: Array, prior: float) -> list[tuple[int, ...]]:
    """Parts by number, all of them first, then without the one that costs least by the slopes (n, P) at u (P,), and so on
    (backward elimination by Wald's statistic). ``part_of`` (P,) the part of a value, ``free`` (P,) whether it may go."""
    kept = list(dict.fromkeys(part_of.tolist()))
    path = [tuple(kept)]
    while True:
        mine = np.isin(part_of, kept)
        covariance = np.linalg.inv(slopes[:, mine].T @ slopes[:, mine] + prior * np.eye(int(mine.sum())))
        costs = {}
        for k in kept:
            at = np.flatnonzero(part_of[mine] == k)
            if free[mine][at].all():
                gap = u[mine][at]
                costs[k] = float(gap @ np.linalg.solve(covariance[np.ix_(at, at)], gap))
        if not costs:
            return path
        kept = [k for k in kept if k != min(costs, key=lambda k: costs[k])]
        if not kept:
            return path
        path.append(tuple(kept))


def _place(parts: Sequence[Candidate], k: int) -> slice:
    first = sum(c.size for c in parts[:k])
    return slice(first, first + parts[k].size)
