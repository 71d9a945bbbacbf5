"""Fitting, by the means that suit the problem: following slopes, or a cloud of points where slopes mislead."""

from __future__ import annotations

from collections.abc import Sequence

from ee_dist.discrepancy.problem import Mask
from ee_dist.discrepancy.search.cloud import effort_of, follow_cloud
from ee_dist.discrepancy.search.fitted import Fit, Model
from ee_dist.discrepancy.search.search import Search
from ee_dist.discrepancy.search.slopes import WIDTHS, follow_slopes
from ee_dist.trials.log import Array

ROUGH_WIDTHS = (0.12, 0.06, 0.06, 0.03, 0.012)
"""Finite differences of the iterations where the error jumps: more of the wide ones."""
FULL = 4
"""Iterations from which a fit counts as a full one."""


def fit_all(
    search: Search,
    starts: Sequence[tuple[Model, Array]],
    mask: Mask | None = None,
    widths: Sequence[float] = WIDTHS,
    prior: float = 0.0,
    leading: Array | None = None,
) -> list[Fit]:
    """The best values of each (model, start) on the residual values of ``mask`` (n,), in the order given. ``leading``: known
    slopes of the first values (see slopes.py); a cloud needs none."""
    chosen = search.everything if mask is None else mask
    if not search.problem.rugged:
        return follow_slopes(search, starts, chosen, widths, prior, leading)
    return _rugged(search, starts, chosen, len(widths), prior)


def _rugged(
    search: Search, starts: Sequence[tuple[Model, Array]], mask: Mask, iterations: int, prior: float
) -> list[Fit]:
    """Wide slopes from a start that is good already find nearly what a cloud finds, at a quarter of its rollouts (motors
    with friction, several gains and motions). They fail where a value does nothing by itself, as in laws of several numbers:
    there a quick fit sends out a cloud too, and a full fit does everywhere."""
    fits = follow_slopes(search, starts, mask, ROUGH_WIDTHS, prior)
    generations, seeds = effort_of(iterations, search.problem.effort)
    clouded = [i for i, (m, _) in enumerate(starts) if iterations >= FULL or (m.parts and m.parts[-1].size > 1)]
    models = [(fits[i].model, fits[i].u) for i in clouded]
    for i, fit in zip(clouded, follow_cloud(search, models, mask, generations, seeds, prior=prior), strict=True):
        if _cost(fit, prior) < _cost(fits[i], prior):
            fits[i] = fit
    return fits


def _cost(fit: Fit, prior: float) -> float:
    return fit.energy + prior * float(fit.u @ fit.u)


def fit_one(
    search: Search, model: Model, starts: Sequence[Array], mask: Mask | None = None, widths: Sequence[float] = WIDTHS
) -> Fit:
    """The best fit of a model from any of the starts."""
    return min(fit_all(search, [(model, u) for u in starts], mask, widths), key=lambda f: f.energy)
