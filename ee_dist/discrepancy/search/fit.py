"""Fitting, by the means that suit the problem: following slopes, or a cloud of points where slopes mislead."""

from __future__ import annotations

from collections.abc import Sequence

from ee_dist.discrepancy.problem import Mask
from ee_dist.discrepancy.search.cloud import effort_of, follow_cloud
from ee_dist.discrepancy.search.fitted import Fit, Model
from ee_dist.discrepancy.search.search import Search
from ee_dist.discrepancy.search.slopes import WIDTHS, follow_slopes
from ee_dist.trials.log import Array


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
    generations, seeds = effort_of(len(widths), search.problem.effort)
    return follow_cloud(search, starts, chosen, generations, seeds, prior=prior)


def fit_one(
    search: Search, model: Model, starts: Sequence[Array], mask: Mask | None = None, widths: Sequence[float] = WIDTHS
) -> Fit:
    """The best fit of a model from any of the starts."""
    return min(fit_all(search, [(model, u) for u in starts], mask, widths), key=lambda f: f.energy)
