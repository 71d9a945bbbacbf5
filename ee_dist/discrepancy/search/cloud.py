"""Fitting where slopes mislead: CMA-ES within bounds, all candidates in step, one evaluator call a generation for all.

A simulation through sticks and slips has an error that jumps with its parameters. CMA-ES (Hansen 2016, "The CMA Evolution
Strategy: A Tutorial") follows the lie of the land at the size of its cloud instead.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ee_dist.discrepancy.problem import Mask
from ee_dist.discrepancy.search.fitted import Fit, Model
from ee_dist.discrepancy.search.search import Search
from ee_dist.trials.log import Array

POPULATION = 14
SIGMA = 0.15
"""Size of the first cloud, as a share of each parameter's bounds."""
WIDTH = 0.02
"""Finite difference for the slopes at the end, as a share of the bounds."""


def effort_of(iterations: int, effort: float = 1.0) -> tuple[int, tuple[int, ...]]:
    """(generations, seeds) for as many iterations of a fit by slopes: a full fit of four is tried from two seeds.

    ``effort`` below 1 shortens the search and tries one seed.
    """
    seeds = (1, 2) if iterations >= 4 and effort >= 1 else (1,)
    return max(1, round(10 * iterations * effort)), seeds


@dataclass(eq=False)
class _Run:
    model: Model
    strategy: Any  # a CMAEvolutionStrategy, or None where nothing is searched
    energy: float = np.inf
    u: Array | None = None
    residual: Array | None = None

    def place(self, v: Array) -> Array:
        """From the unit cube to shares of the way to the bounds."""
        low, high = self.model.lower, self.model.upper
        return low + np.clip(v[: len(low)], 0.0, 1.0) * (high - low)


Evaluate = Callable[[Sequence[tuple[_Run, Array]]], list[tuple[float, Array]]]


def follow_cloud(
    search: Search,
    starts: Sequence[tuple[Model, Array]],
    mask: Mask,
    generations: int = 50,
    seeds: Sequence[int] = (1,),
    sigma: float = SIGMA,
    prior: float = 0.0,
) -> list[Fit]:
    """The best values found for each (model, start) on the residual values of ``mask`` (n,), over all ``seeds``.

    Only trials with values in the mask are simulated, unless the search says which. ``prior`` as in slopes.py.
    """
    whole, progress = search, search.progress
    search = search.within(mask)
    groups = [[_begin(m, np.asarray(u, float), s, i, sigma) for s in seeds] for i, (m, u) in enumerate(starts)]
    flat = [run for group in groups for run in group]

    def evaluate(points: Sequence[tuple[_Run, Array]]) -> list[tuple[float, Array]]:
        found = search.residuals([s.model.hypothesis(u) for s, u in points])
        return [
            (float(r[mask] @ r[mask]) + prior * float(u @ u) if np.isfinite(r).all() else np.inf, r)
            for (_, u), r in zip(points, found, strict=True)
        ]

    first = [(s, np.asarray(u, float)) for (_, u), group in zip(starts, groups, strict=True) for s in group]
    _keep(first, evaluate(first))
    moving = [s for s in flat if s.strategy is not None]
    for generation in range(generations):
        if not moving:
            break
        asked = [(s, s.strategy.ask()) for s in moving]
        points = [(s, s.place(np.asarray(v))) for s, cloud in asked for v in cloud]
        values = evaluate(points)
        _keep(points, values)
        at = 0
        for s, cloud in asked:
            mine = [value for value, _ in values[at : at + len(cloud)]]
            worst = max((x for x in mine if np.isfinite(x)), default=1.0)
            s.strategy.tell(cloud, [x if np.isfinite(x) else 10 * worst for x in mine])
            at += len(cloud)
        progress("fitting", (generation + 1) / generations)
    best = [min(group, key=lambda s: s.energy) for group in groups]
    return _with_slopes(best, mask, evaluate, prior, whole)


def _begin(model: Model, u: Array, seed: int, index: int, sigma: float) -> _Run:
    low, high = model.lower, model.upper
    if not len(low):
        return _Run(model, None)
    rng = np.random.default_rng([seed, index])
    room = np.where(high > low, high - low, 1.0)
    options = {
        "bounds": [0, 1],
        "popsize": POPULATION,
        "seed": np.nan,
        "randn": lambda *shape: rng.standard_normal(shape),
        "verbose": -9,
    }
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import cma  # only here: with scipy.stats, which it brings, it takes a second to load

        start = np.clip((u - low) / room, 0.02, 0.98)
        # One dimension is too few for the strategy; a second one that does nothing costs nothing.
        padded = start if len(start) > 1 else np.array([start[0], 0.5])
        return _Run(model, cma.CMAEvolutionStrategy(padded, sigma, options))


def _keep(points: Sequence[tuple[_Run, Array]], values: Sequence[tuple[float, Array]]) -> None:
    for (s, u), (value, residual) in zip(points, values, strict=True):
        if value < s.energy or s.u is None:
            s.energy, s.u, s.residual = value, u, residual


def _with_slopes(best: Sequence[_Run], mask: Mask, evaluate: Evaluate, prior: float, whole: Search) -> list[Fit]:
    points, gaps = [], []
    for s in best:
        assert s.u is not None
        for k in range(len(s.u)):
            step = WIDTH * (s.model.upper[k] - s.model.lower[k])
            u = s.u.copy()
            u[k] += step if u[k] + step <= s.model.upper[k] else -step
            points.append((s, u))
            gaps.append(u[k] - s.u[k])
    found = evaluate(points) if points else []
    # What was held out was not simulated so far.
    rows = whole.residuals([s.model.hypothesis(s.u) for s in best if s.u is not None])
    out, at = [], 0
    for s, row in zip(best, rows, strict=True):
        assert s.u is not None and s.residual is not None
        columns = []
        for _ in range(len(s.u)):
            r = found[at][1]
            usable = np.isfinite(r).all() and gaps[at] != 0
            columns.append((r - s.residual)[mask] / gaps[at] if usable else np.zeros(int(mask.sum())))
            at += 1
        slopes = np.stack(columns, axis=1) if columns else np.zeros((int(mask.sum()), 0))
        out.append(Fit(s.model, s.u, s.energy - prior * float(s.u @ s.u), row, slopes, mask))
    return out
