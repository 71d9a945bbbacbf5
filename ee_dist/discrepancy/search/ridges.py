"""Over the ridges between valleys, which slopes do not see.

A delay of more than a row of the log and one of less are two valleys: as the reaction moves past a reading, what a row shows
changes its slope. Where a joint sticks, it is alike. So from where a descent ended each value is moved by itself, farther than
slopes look, and what the others would make up for is reckoned from their slopes there (profile likelihood, linearised): one
simulation a move.
"""

from __future__ import annotations

import numpy as np

from ee_dist.discrepancy.problem import Mask
from ee_dist.discrepancy.search.fitted import Fit
from ee_dist.discrepancy.search.race import race
from ee_dist.discrepancy.search.rows import NOISE, over_rows
from ee_dist.discrepancy.search.screen import seen_beside
from ee_dist.discrepancy.search.search import Search
from ee_dist.discrepancy.search.slopes import slopes_at
from ee_dist.discrepancy.search.trials import telling_values
from ee_dist.discrepancy.search.valley import NARROWEST, follow_valley
from ee_dist.trials.log import Array

MOVES = (0.0125, 0.03, 0.1, 0.3)
"""How far, as shares of a value's room: the least is a quarter of a time step of a delay's."""
PROMISE = 0.05
"""Share of what is above the noise that a move must promise to take off, and the descent from there must."""
TRIED, ROUNDS = 3, 3
"""Descents at once, each from another value's best move, and how often from where one of them ended."""
HEATS = ((3, 1),)
"""Which of them goes to its end, and after how many steps, on the trial that tells most."""
WIDTH, PROBED = 0.03, 0.02
"""Finite differences of a descent, and of the slopes at its start."""


def over_ridges(search: Search, fit: Fit, prior: float = 0.0) -> Fit:
    """The fit, or a better one of the same model on the far side of a ridge."""
    floor = float(search.problem.floor[fit.mask].sum())
    for _ in range(ROUNDS):
        wanted = _wanted(search, fit.residual, fit.mask)
        if fit.energy <= NOISE * floor:
            break
        # Where one trial tells which way to go, on it alone: what it takes is judged on all of them.
        few = telling_values(search.problem, fit.residual, fit.mask)
        starts = _beyond(search.within(few), fit, few, prior)
        best = fit
        if starts:
            best = race(search, [(fit.model, u) for u in starts], fit.mask, HEATS, prior, WIDTH, few, wanted=wanted)[0]
        if not best.energy < wanted:
            best = over_rows(search, fit, wanted, prior)
        if not best.energy < wanted:
            best = _seen_anew(search, fit, wanted, prior)
        if not best.energy < wanted:
            break
        fit = best
    return fit


def _seen_anew(search: Search, fit: Fit, wanted: float, prior: float) -> Fit:
    """The fit, or one of the same model of less energy than ``wanted``, begun from what a sensor shows of an effect beside all
    else that the model has by now."""
    for c, place in zip(fit.model.parts, fit.model.places, strict=True):
        if c.effect.seen_beside is None:
            continue
        others = tuple(t for t in fit.hypothesis if t.name != c.name)
        shown = seen_beside(search.problem, c, search.on(others).base()).hint
        if shown and np.abs(fit.u[place] - shown).max() > 0:
            u = fit.u.copy()
            u[place] = shown
            (found,) = follow_valley(search, [(fit.model, u)], fit.mask, prior, widths=(NARROWEST,))
            fit = found if found.energy < wanted else fit
    return fit


def _wanted(search: Search, residual: Array, mask: Mask) -> float:
    """Energy of residual values (n,) that is worth a descent."""
    energy, floor = float((residual[mask] ** 2).sum()), float(search.problem.floor[mask].sum())
    return energy - PROMISE * max(energy - floor, 0.0)


def _beyond(search: Search, fit: Fit, mask: Mask, prior: float) -> list[Array]:
    """Values (P,) to start from, the most promising first, by the residual values of ``mask`` (n,)."""
    model, wanted = fit.model, _wanted(search, fit.residual, mask)
    lower, upper = model.lower, model.upper
    points = []
    for k in range(len(fit.u)):
        for move in (*MOVES, *(-m for m in MOVES)):
            u = fit.u.copy()
            u[k] = np.clip(u[k] + move, lower[k], upper[k])
            if abs(u[k] - fit.u[k]) > 0.5 * min(MOVES):
                points.append((k, u))
    slopes = slopes_at(search, model, fit.u, PROBED)[mask]
    best: dict[int, tuple[float, Array]] = {}
    for some in search.batches(len(points)):
        rows = search.residuals([model.hypothesis(u) for _, u in points[some]])
        for (k, u), row in zip(points[some], rows, strict=True):
            if not np.isfinite(row).all():
                continue
            rest = np.delete(slopes, k, axis=1)
            normal = rest.T @ rest + max(prior, 1e-9) * np.eye(rest.shape[1])
            step = -np.linalg.solve(normal, rest.T @ row[mask])
            left = row[mask] + rest @ step
            energy = float(left @ left)
            if energy < wanted and (k not in best or energy < best[k][0]):
                best[k] = (energy, np.clip(u + np.insert(step, k, 0.0), lower, upper))
    return [u for _, u in sorted(best.values(), key=lambda found: found[0])[:TRIED]]
