"""Fitting many values of one model at once: Levenberg-Marquardt within bounds.

Where everything is a little wrong, values stand in for one another, and a search that fits them in small groups is caught
between them. All together they have one valley, which slopes lead down. Slopes are taken of the residual before it is
softened (``Problem.smooth``) and weighed as the energy weighs it, which is how robust losses are minimised (Huber 1981,
"Robust Statistics", section 7.8).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ee_dist.discrepancy.problem import Mask
from ee_dist.discrepancy.search.fitted import Fit, Model
from ee_dist.discrepancy.search.search import Search
from ee_dist.discrepancy.search.slopes import NEAR, weighed
from ee_dist.trials.log import Array

LARGE = 10
"""Values from which a model is fitted this way."""
ITERATIONS = 30
WIDEST, NARROWEST = 0.12, 0.006
"""Finite differences, as shares of a value's room: wide while the fit is far off, narrow in the end."""
DAMPINGS = (0.01, 0.1, 1.0, 10.0, 100.0)
"""Tried at once, relative to the one that did best before;"""
PLAIN = (0.1, 1.0, 10.0)
"""those of plain least squares, where more is left than slopes as they are weighed can be trusted with (``slopes.NEAR``)."""
GAIN = 0.005
"""Share of the energy that an iteration must take off, or else slopes are taken narrower; at the narrowest it ends."""


@dataclass(eq=False)
class _Run:
    model: Model
    u: Array
    width: float
    residual: Array
    energy: float = np.inf
    damping: float = 1e-3
    plain_damping: float = 1e-3
    slopes: Array | None = None
    weighed: Array | None = None
    """The smooth residual where it is fitted, weighed,"""
    weights: Array | None = None
    """and by what."""
    done: bool = False


def follow_valley(
    search: Search,
    starts: Sequence[tuple[Model, Array]],
    mask: Mask,
    prior: float = 0.0,
    iterations: int = ITERATIONS,
    widths: Sequence[float] = (WIDEST,),
    settled: bool = False,
) -> list[Fit]:
    """The best values of each (model, start) on the residual values of ``mask`` (n,), in the order given, all in step: the best
    of a descent from each of ``widths``, of which the last steps follow ever narrower slopes, unless the start is ``settled``
    in a valley already. ``prior`` as in slopes.py; ``slopes`` of the results are those of the smooth residual, weighed."""
    whole, search = search, search.within(mask)
    points = [np.clip(np.asarray(u, float), m.lower, m.upper) for m, u in starts]
    rows = search.residuals([m.hypothesis(u) for (m, _), u in zip(starts, points, strict=True)])
    runs = [
        _Run(m, u, width, r, _cost(r, u, mask, prior), done=not len(u))
        for (m, _), u, r in zip(starts, points, rows, strict=True)
        for width in widths
    ]
    for step in range(iterations):
        moving = [run for run in runs if not run.done]
        if not moving:
            break
        _from_nowhere([run for run in moving if not np.isfinite(run.energy)], search, mask, prior)
        moving = [run for run in moving if np.isfinite(run.energy)]
        _slopes(moving, search, mask)
        _steps(moving, search, mask, prior, step, NARROWEST if not settled else np.inf)
        search.progress("fitting all together", (step + 1) / iterations)
    best = [min(runs[k : k + len(widths)], key=lambda r: r.energy) for k in range(0, len(runs), len(widths))]
    rows = np.array([run.residual for run in best])
    if search is not whole:
        rows = whole.residuals([run.model.hypothesis(run.u) for run in best])
    empty = int(mask.sum())
    return [
        Fit(
            run.model,
            run.u,
            run.energy - prior * float(run.u @ run.u),
            row,
            np.zeros((empty, len(run.u))) if run.slopes is None else run.slopes,
            mask,
        )
        for run, row in zip(best, rows, strict=True)
    ]


def _from_nowhere(runs: Sequence[_Run], search: Search, mask: Mask, prior: float) -> None:
    """No slope where nothing can be simulated: nearer to neutral."""
    for run in runs:
        run.u = 0.5 * run.u
    for run, r in zip(runs, search.residuals([run.model.hypothesis(run.u) for run in runs]), strict=True):
        run.residual, run.energy = r, _cost(r, run.u, mask, prior)


def _slopes(runs: Sequence[_Run], search: Search, mask: Mask) -> None:
    """Weighed derivatives (n, P) of the smooth residual where the mask is."""
    points = []
    for run in runs:
        for k in range(len(run.u)):
            h = min(run.width, 0.3 * abs(run.u[k]) + 0.2 * run.width)
            v = run.u.copy()
            v[k] += h if run.u[k] + h <= run.model.upper[k] else -h
            points.append((run, v))
    rows = iter(search.residuals([run.model.hypothesis(v) for run, v in points]))
    smooth_of, at = search.problem.smooth, 0
    for run in runs:
        smooth, weight = (values[mask] for values in weighed(search.problem, run.residual))
        columns = []
        for k in range(len(run.u)):
            row, gap = next(rows), points[at][1][k] - run.u[k]
            at += 1
            usable = np.isfinite(row).all()
            columns.append(weight * (smooth_of(row)[mask] - smooth) / gap if usable else np.zeros(len(smooth)))
        run.slopes, run.weighed, run.weights = np.stack(columns, axis=1), weight * smooth, np.maximum(weight, 1e-12)


def _steps(runs: Sequence[_Run], search: Search, mask: Mask, prior: float, step: int, last: float) -> None:
    """``last``: width from which a step that takes next to nothing ends the descent."""
    far = NEAR * float(search.problem.floor[mask].sum())
    tries = [[(plain, d) for plain, d in _tries(run) if not plain or run.energy > far] for run in runs]
    points = [[_step(run, prior, d, plain) for plain, d in mine] for run, mine in zip(runs, tries, strict=True)]
    rows = iter(
        search.residuals([run.model.hypothesis(v) for run, some in zip(runs, points, strict=True) for v in some])
    )
    for run, mine, some in zip(runs, tries, points, strict=True):
        found = [next(rows) for _ in mine]
        costs = [_cost(r, v, mask, prior) for r, v in zip(found, some, strict=True)]
        best, before = int(np.argmin(costs)), run.energy
        if costs[best] < run.energy:
            plain, damping = mine[best]
            run.energy, run.u, run.residual = costs[best], some[best], found[best]
            if plain:
                run.plain_damping = max(damping, 1e-7)
            else:
                run.damping = max(damping, 1e-7)
        else:
            run.damping = min(100.0 * run.damping, 1e6)
            run.plain_damping = min(100.0 * run.plain_damping, 1e6)
        if before - run.energy < GAIN * before:
            run.done = run.width <= last
            run.width = max(0.5 * run.width, NARROWEST)
        elif step % 2:
            run.width = max(0.7 * run.width, NARROWEST)


def _tries(run: _Run) -> list[tuple[bool, float]]:
    """Dampings, and whether of plain least squares."""
    return [(False, run.damping * d) for d in DAMPINGS] + [(True, run.plain_damping * d) for d in PLAIN]


def _cost(r: Array, u: Array, mask: Mask, prior: float) -> float:
    return float(r[mask] @ r[mask]) + prior * float(u @ u) if np.isfinite(r).all() else float("inf")


def _step(run: _Run, prior: float, damping: float, plain: bool) -> Array:
    """Where a damped Gauss-Newton step leads, values that it would push out of their bounds held there. ``plain``: by least
    squares of the smooth residual as it is."""
    assert run.slopes is not None and run.weighed is not None and run.weights is not None
    u, model = run.u, run.model
    slopes, values = run.slopes, run.weighed
    if plain:
        slopes, values = slopes / run.weights[:, None], values / run.weights
    normal, down = slopes.T @ slopes, -(slopes.T @ values) - prior * u
    scale = np.diag(normal)
    scale = np.maximum(scale, 1e-6 * max(float(scale.max()), 1e-12))
    system = normal + prior * np.eye(len(u)) + damping * np.diag(scale)
    free = np.ones(len(u), dtype=bool)
    point = u
    for _ in range(4):
        step = np.zeros(len(u))
        if free.any():
            step[free] = np.linalg.solve(system[np.ix_(free, free)], down[free])
        point = np.clip(u + step, model.lower, model.upper)
        out = ((u + step < model.lower) & (u <= model.lower)) | ((u + step > model.upper) & (u >= model.upper))
        if not (out & free).any():
            break
        free &= ~out
    return point
