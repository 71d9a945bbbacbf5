"""Fitting, by the means that suit the problem: following slopes, or a cloud of points where slopes mislead."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ee_dist.discrepancy.problem import Mask
from ee_dist.discrepancy.search.cloud import effort_of, follow_cloud
from ee_dist.discrepancy.search.fitted import Fit, Model
from ee_dist.discrepancy.search.search import Search
from ee_dist.discrepancy.search.slopes import WIDTHS, follow_slopes
from ee_dist.discrepancy.search.valley import ITERATIONS, LARGE, follow_valley
from ee_dist.trials.log import Array

ROUGH_WIDTHS = (0.12, 0.06, 0.06, 0.03, 0.012)
"""Finite differences of the iterations where the error jumps: more of the wide ones."""

FEW_JOINTS = 2
"""Joints up to which one that sticks decides the whole error; with more of them slopes are right on average, and a cloud takes
hours."""
SHORT = 8
"""Iterations of a fit of many values from a start that is good already."""


def fit_all(
    search: Search,
    starts: Sequence[tuple[Model, Array]],
    mask: Mask | None = None,
    widths: Sequence[float] = WIDTHS,
    prior: float = 0.0,
    leading: Array | None = None,
) -> list[Fit]:
    """The best values of each (model, start) on the residual values of ``mask`` (n,), in the order given. ``leading``: known
    slopes of the first values (see slopes.py); where the error is rugged none are of use. Models of many values are
    fitted by valley.py."""
    chosen = search.everything if mask is None else mask
    large = [i for i, (_, u) in enumerate(starts) if leading is None and len(u) >= LARGE and not sticky(search)]
    if large:
        small = [i for i in range(len(starts)) if i not in large]
        found = dict(zip(small, fit_all(search, [starts[i] for i in small], mask, widths, prior), strict=True))
        far = len(widths) > 2
        count = ITERATIONS if far else SHORT
        fits = follow_valley(search, [starts[i] for i in large], chosen, prior, count, widths[:1], settled=not far)
        found |= dict(zip(large, fits, strict=True))
        return [found[i] for i in range(len(starts))]
    if not search.problem.rugged:
        return follow_slopes(search, starts, chosen, widths, prior, leading)
    return _rugged(search, starts, chosen, len(widths), prior)


def sticky(search: Search) -> bool:
    """Whether single sticks and slips decide the error, so that slopes mislead: on a robot of few joints, in a rugged problem."""
    return search.problem.rugged and len(search.problem.robot.drives) <= FEW_JOINTS


def _rugged(
    search: Search, starts: Sequence[tuple[Model, Array]], mask: Mask, iterations: int, prior: float
) -> list[Fit]:
    """Slopes from the start and from half way to neutral; then, for a robot of few joints, a cloud from where the better of
    them ended: slopes go far for few rollouts, and stop at the first ridge."""
    halves = [(m, 0.5 * np.asarray(u, float)) for m, u in starts]
    few = sticky(search)
    count = ITERATIONS if iterations > 2 else SHORT
    if few:
        found = follow_slopes(search, [*starts, *halves], mask, ROUGH_WIDTHS, prior)
    else:
        found = follow_valley(search, [*starts, *halves], mask, prior, count)
    pairs = zip(found[: len(starts)], found[len(starts) :], strict=True)
    best = [min(pair, key=lambda f: _cost(f, prior)) for pair in pairs]
    if not few:
        return best
    generations, seeds = effort_of(iterations, search.problem.effort)
    clouds = follow_cloud(search, [(f.model, f.u) for f in best], mask, generations, seeds, prior=prior)
    return [min(pair, key=lambda f: _cost(f, prior)) for pair in zip(best, clouds, strict=True)]


def rough(
    search: Search, starts: Sequence[tuple[Model, Array]], widths: Sequence[float], leading: Array | None
) -> list[Fit]:
    """Quick fits of all data that only choose what is fitted well: by slopes, and by a cloud too for laws of several numbers
    where the error is rugged: a number that does nothing by itself has no slope."""
    everything = search.everything
    if not search.problem.rugged:
        return follow_slopes(search, starts, everything, widths, leading=leading)
    if not sticky(search):
        return follow_valley(search, starts, everything, iterations=SHORT)
    fits = follow_slopes(search, starts, everything, ROUGH_WIDTHS)
    several = [i for i, (m, _) in enumerate(starts) if m.parts and m.parts[-1].size > 1]
    generations, seeds = effort_of(len(widths), search.problem.effort)
    for i, fit in zip(
        several,
        follow_cloud(search, [(fits[i].model, fits[i].u) for i in several], everything, generations, seeds),
        strict=True,
    ):
        fits[i] = min(fits[i], fit, key=lambda f: f.energy)
    return fits


def _cost(fit: Fit, prior: float) -> float:
    return fit.energy + prior * float(fit.u @ fit.u)


def fit_one(
    search: Search, model: Model, starts: Sequence[Array], mask: Mask | None = None, widths: Sequence[float] = WIDTHS
) -> Fit:
    """The best fit of a model from any of the starts."""
    return min(fit_all(search, [(model, u) for u in starts], mask, widths), key=lambda f: f.energy)
