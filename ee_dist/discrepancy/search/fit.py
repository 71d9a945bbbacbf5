"""Fitting, by the means that suit the model: following slopes, or down the valley of many values."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ee_dist.discrepancy.problem import Mask
from ee_dist.discrepancy.search.fitted import Fit, Model
from ee_dist.discrepancy.search.search import Search
from ee_dist.discrepancy.search.slopes import WIDTHS, Leading, follow_slopes
from ee_dist.discrepancy.search.valley import ITERATIONS, LARGE, follow_valley
from ee_dist.trials.log import Array

SHORT = 8
"""Iterations of a fit of many values from a start that is good already."""


def fit_all(
    search: Search,
    starts: Sequence[tuple[Model, Array]],
    mask: Mask | None = None,
    widths: Sequence[float] = WIDTHS,
    prior: float = 0.0,
    leading: Leading = None,
    short: int = SHORT,
) -> list[Fit]:
    """The best values of each (model, start) on the residual values of ``mask`` (n,), in the order given. ``leading``: known
    slopes (see slopes.py). Models of many values are fitted by valley.py, from a good start in ``short`` iterations."""
    chosen = search.everything if mask is None else mask
    large = [i for i, (_, u) in enumerate(starts) if leading is None and len(u) >= LARGE]
    if large:
        small = [i for i in range(len(starts)) if i not in large]
        found = dict(zip(small, fit_all(search, [starts[i] for i in small], mask, widths, prior), strict=True))
        far = len(widths) > 2
        count = ITERATIONS if far else short
        fits = follow_valley(search, [starts[i] for i in large], chosen, prior, count, widths[:1], settled=not far)
        found |= dict(zip(large, fits, strict=True))
        return [found[i] for i in range(len(starts))]
    return follow_slopes(search, starts, chosen, widths, prior, leading)


def fit_one(
    search: Search,
    model: Model,
    starts: Sequence[Array],
    mask: Mask | None = None,
    widths: Sequence[float] = WIDTHS,
    prior: float = 0.0,
) -> Fit:
    """The best fit of a model from any of the starts, and from what the measurements show of its values by themselves, to which
    no slope leads back."""
    seen = [s for u in starts if not np.array_equal(s := model.as_seen(u), u)]
    fits = fit_all(search, [(model, u) for u in (*starts, *seen)], mask, widths, prior)
    return min(fits, key=lambda f: f.energy + prior * float(f.u @ f.u))
