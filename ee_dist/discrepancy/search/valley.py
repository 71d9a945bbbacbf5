"""Fitting many values of one model at once: Levenberg-Marquardt within bounds.

Where everything is a little wrong, values stand in for one another, and a search that fits them in small groups is caught
between them. All together they have one valley, which slopes lead down. Slopes are taken of the residual before it is
softened (``Problem.smooth``) and weighed as the energy weighs it, which is how robust losses are minimised (Huber 1981,
"Robust Statistics", section 7.8).
"""

from __future__ import annotations

import numpy as np

from ee_dist.discrepancy.problem import Mask
from ee_dist.discrepancy.search.fitted import Fit, Model
from ee_dist.discrepancy.search.search import Search
from ee_dist.trials.log import Array

LARGE = 10
"""Values from which a model is fitted this way."""
ITERATIONS = 30
WIDEST, NARROWEST = 0.12, 0.006
"""Finite differences, as shares of a value's room: wide while the fit is far off, narrow in the end."""
DAMPINGS = (0.01, 0.1, 1.0, 10.0, 100.0)
"""Tried at once, relative to the one that did best before."""
GAIN = 0.005
"""Share of the energy that an iteration must take off, or else slopes are taken narrower; at the narrowest it ends."""


def follow_valley(
    search: Search,
    model: Model,
    start: Array,
    mask: Mask,
    prior: float = 0.0,
    iterations: int = ITERATIONS,
    width: float = WIDEST,
) -> Fit:
    """The best values from a start (P,) on the residual values of ``mask`` (n,). ``prior`` as in slopes.py; ``slopes`` of the
    result are those of the smooth residual, weighed."""
    whole, problem = search, search.problem
    needed = np.unique(problem.trial_of[mask]).tolist()
    search = search.among(needed if search.trials is None else [k for k in search.trials if k in set(needed)])
    u = np.clip(np.asarray(start, float), model.lower, model.upper)
    (r,) = search.residuals([model.hypothesis(u)])
    energy, damping, slopes = _cost(r, u, mask, prior), 1e-3, np.zeros((int(mask.sum()), len(u)))
    for step in range(iterations if len(u) else 0):
        if not np.isfinite(energy):
            u = 0.5 * u
            (r,) = search.residuals([model.hypothesis(u)])
            energy = _cost(r, u, mask, prior)
            continue
        slopes, weight, smooth = _slopes(search, model, u, r, width, mask)
        points = [(d, _step(slopes, weight * smooth, u, model, prior, d)) for d in damping * np.array(DAMPINGS)]
        rows = search.residuals([model.hypothesis(v) for _, v in points])
        costs = [_cost(row, v, mask, prior) for row, (_, v) in zip(rows, points, strict=True)]
        best, before = int(np.argmin(costs)), energy
        if costs[best] < energy:
            energy, damping, u, r = costs[best], max(float(points[best][0]), 1e-7), points[best][1], rows[best]
        else:
            damping = min(100.0 * damping, 1e6)
        search.progress("fitting all together", (step + 1) / iterations)
        if before - energy < GAIN * before:
            if width <= NARROWEST:
                break
            width = max(0.5 * width, NARROWEST)
        elif step % 2:
            width = max(0.7 * width, NARROWEST)
    residual = r
    if len(needed) < len(problem.trials):
        (residual,) = whole.residuals([model.hypothesis(u)])
    return Fit(model, u, energy - prior * float(u @ u), residual, slopes, mask)


def _cost(r: Array, u: Array, mask: Mask, prior: float) -> float:
    return float(r[mask] @ r[mask]) + prior * float(u @ u) if np.isfinite(r).all() else float("inf")


def _slopes(search: Search, model: Model, u: Array, r: Array, width: float, mask: Mask) -> tuple[Array, Array, Array]:
    """(n, P) weighed derivatives of the smooth residual, the weights (n,), and the smooth residual (n,), where the mask is."""
    points = []
    for k in range(len(u)):
        h = min(width, 0.3 * abs(u[k]) + 0.2 * width)
        v = u.copy()
        v[k] += h if u[k] + h <= model.upper[k] else -h
        points.append(v)
    rows = search.residuals([model.hypothesis(v) for v in points])
    problem = search.problem
    smooth = problem.smooth(r)[mask]
    weight = np.minimum(np.abs(r[mask]) / np.maximum(np.abs(smooth), 1e-12), 1.0)
    columns = [
        weight * (problem.smooth(row)[mask] - smooth) / (v[k] - u[k])
        if np.isfinite(row).all()
        else np.zeros(len(smooth))
        for k, (row, v) in enumerate(zip(rows, points, strict=True))
    ]
    return np.stack(columns, axis=1), weight, smooth


def _step(slopes: Array, residual: Array, u: Array, model: Model, prior: float, damping: float) -> Array:
    """Where a damped Gauss-Newton step leads, values that it would push out of their bounds held there."""
    normal, down = slopes.T @ slopes, -(slopes.T @ residual) - prior * u
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
