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
from ee_dist.discrepancy.search.slopes import KEPT, weighed
from ee_dist.trials.log import Array

LARGE = 10
"""Values from which a model is fitted this way."""
ITERATIONS = 30
WIDEST, NARROWEST = 0.12, 0.006
"""Finite differences, as shares of a value's room: wide while the fit is far off, narrow in the end."""
DAMPINGS = (0.01, 0.1, 1.0, 10.0, 100.0)
"""Tried at once, relative to the one that did best before."""
GAIN, NARROWER = 0.005, 0.5
"""Share of the energy that an iteration must take off, or else slopes are taken narrower by so much; at the narrowest it ends."""
SECANTS = 4
"""More steps at most between two times that slopes are taken, as long as each keeps its word: what a step showed of its own
direction is put into the slopes (Broyden's rule; Madsen, Nielsen and Tingleff 2004, "Methods for non-linear least squares
problems", section 3.5). Slopes of many values cost ten times a step."""


@dataclass(eq=False)
class _Run:
    model: Model
    u: Array
    width: float
    residual: Array
    energy: float = np.inf
    damping: float = 1e-3
    straight: Array | None = None
    """(m, P) slopes of the smooth residual (m,) where it is fitted,"""
    smooth: Array | None = None
    weights: Array | None = None
    """and the weights (m,) of its values."""
    kept: bool = False
    """Whether the last step came to what slopes foretold, and was worth it."""
    spent: float = 0.0
    """Iterations: slopes and a step are one, a step alone is what it costs beside that."""
    done: bool = False

    @property
    def slopes(self) -> Array | None:
        return None if self.straight is None or self.weights is None else self.weights[:, None] * self.straight


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
    while moving := [run for run in runs if not run.done and run.spent < iterations]:
        _from_nowhere([run for run in moving if not np.isfinite(run.energy)], search, mask, prior)
        moving = [run for run in moving if np.isfinite(run.energy)]
        _slopes(moving, search, mask)
        before = [run.energy for run in moving]
        _step_on(moving, search, mask, prior)
        for run, energy in zip(moving, before, strict=True):
            run.spent += 1.0
            if energy - run.energy < GAIN * energy:
                run.done = settled or run.width <= NARROWEST
                run.width = max(NARROWER * run.width, NARROWEST)
            else:
                run.width = max(0.85 * run.width, NARROWEST)
        for _ in range(SECANTS):
            moving = [run for run in moving if run.kept and run.spent < iterations]
            if moving:
                _step_on(moving, search, mask, prior)
            for run in moving:
                run.spent += len(DAMPINGS) / (len(DAMPINGS) + len(run.u))
        search.progress("fitting all together", min(1.0, max(run.spent for run in runs) / iterations))
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
        run.u, run.spent = 0.5 * run.u, run.spent + 1.0
    for run, r in zip(runs, search.residuals([run.model.hypothesis(run.u) for run in runs]), strict=True):
        run.residual, run.energy = r, _cost(r, run.u, mask, prior)


def _slopes(runs: Sequence[_Run], search: Search, mask: Mask) -> None:
    """Derivatives (m, P) of the smooth residual where the mask is."""
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
        run.smooth, run.weights = (values[mask] for values in weighed(search.problem, run.residual))
        columns = []
        for k in range(len(run.u)):
            row, gap = next(rows), points[at][1][k] - run.u[k]
            at += 1
            usable = np.isfinite(row).all()
            columns.append((smooth_of(row)[mask] - run.smooth) / gap if usable else np.zeros(len(run.smooth)))
        run.straight = np.stack(columns, axis=1)


def _step_on(runs: Sequence[_Run], search: Search, mask: Mask, prior: float) -> None:
    """The best of steps of several dampings, if it is better than none; what it showed is put into the slopes."""
    points = []
    for run in runs:
        normal, down = _normal(run, prior)
        points += [(run, d, _step(run, normal, down, prior, d)) for d in run.damping * np.array(DAMPINGS)]
    rows = search.residuals([run.model.hypothesis(v) for run, _, v in points])
    count = len(DAMPINGS)
    for k, run in enumerate(runs):
        mine = range(k * count, (k + 1) * count)
        costs = [_cost(rows[i], points[i][2], mask, prior) for i in mine]
        best, before = int(np.argmin(costs)), run.energy
        if costs[best] >= run.energy:
            run.damping, run.kept = min(100.0 * run.damping, 1e6), False
            continue
        _, damping, u = points[mine[best]]
        step, foretold = u - run.u, _foretold(run, u, prior)
        run.u, run.energy, run.residual, run.damping = u, costs[best], rows[mine[best]], max(float(damping), 1e-7)
        won = before - run.energy
        run.kept = won >= KEPT * (before - foretold) and won >= GAIN * before
        if run.kept:
            assert run.straight is not None and run.smooth is not None
            smooth, weights = (values[mask] for values in weighed(search.problem, run.residual))
            run.straight = run.straight + np.outer(smooth - run.smooth - run.straight @ step, step) / (step @ step)
            run.smooth, run.weights = smooth, weights


def _foretold(run: _Run, u: Array, prior: float) -> float:
    """The energy that slopes lead to expect at u."""
    assert run.straight is not None and run.smooth is not None and run.weights is not None
    bent = run.weights * (run.smooth + run.straight @ (u - run.u))
    return float(bent @ bent) + prior * float(u @ u)


def _cost(r: Array, u: Array, mask: Mask, prior: float) -> float:
    return float(r[mask] @ r[mask]) + prior * float(u @ u) if np.isfinite(r).all() else float("inf")


def _normal(run: _Run, prior: float) -> tuple[Array, Array]:
    """The normal matrix (P, P) and the way down (P,)."""
    slopes = run.slopes
    assert slopes is not None and run.smooth is not None and run.weights is not None
    return slopes.T @ slopes, -(slopes.T @ (run.weights * run.smooth)) - prior * run.u


def _step(run: _Run, normal: Array, down: Array, prior: float, damping: float) -> Array:
    """Where a damped Gauss-Newton step leads, values that it would push out of their bounds held there."""
    u, model = run.u, run.model
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
