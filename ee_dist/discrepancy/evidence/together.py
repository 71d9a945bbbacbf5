"""Values that only hold together with others.

Intervals come from slopes over finite steps. Along a ridge that is bent, as where mass, rotor and torque are all larger by one
factor, each such step leaves the ridge, and slopes tell a value that the data do not. So each is moved, the others follow, and
what that leaves is simulated, as far as it stays flat: the profile likelihood (Pawitan 2001, "In All Likelihood", 3.4)."""

from __future__ import annotations

import numpy as np

from ee_dist.discrepancy.evidence.intervals import half_widths
from ee_dist.discrepancy.search.fitted import Fit
from ee_dist.discrepancy.search.search import Search
from ee_dist.discrepancy.search.slopes import weighed
from ee_dist.trials.log import Array

FEW = 16
"""Values up to which they are looked at one by one: of more a robot that is wrong everywhere has, each of which says little."""
APART = 2.0
"""How many half intervals a value is moved by first; then by twice as much each time,"""
TIMES = 4
"""as often."""
FOLLOWED = 4
"""Steps by which the others follow (the chord method: Newton's with slopes that stay)."""
DOING = "how far values go together"
FLAT = 0.1
"""Share of what slopes foretell that a profile may rise by and be called flat."""


def flat_widths(search: Search, fit: Fit) -> Array:
    """(P,) how far each value of a fit can go while the others make up for it, beyond what its interval says; zero where slopes
    tell it rightly."""
    out = np.zeros(len(fit.u))
    if not 1 < len(fit.u) <= FEW or not fit.mask.any():
        return out
    half, normal = half_widths(search.problem, fit), fit.slopes.T @ fit.slopes
    damp = 1e-9 * np.trace(normal) / len(fit.u)
    whole = np.linalg.pinv(normal + damp * np.eye(len(fit.u)))
    going = [(k, side) for k in range(len(fit.u)) if np.isfinite(half[k]) and 0 < half[k] < 1 for side in (1.0, -1.0)]
    begin = dict.fromkeys(going, fit.u)
    for n in range(TIMES):
        search.progress(DOING, n / TIMES)
        goals = {(k, side): fit.u[k] + side * APART * 2.0**n * half[k] for k, side in going}
        able = [one for one in going if fit.model.lower[one[0]] <= goals[one] <= fit.model.upper[one[0]]]
        reached = _followed(search, fit, normal, {one: (goals[one], begin[one]) for one in able})
        going = []
        for (k, side), (u, energy) in reached.items():
            foretold = (u[k] - fit.u[k]) ** 2 / max(float(whole[k, k]), 1e-300)
            if energy - fit.energy < FLAT * foretold:
                out[k] = max(out[k], abs(u[k] - fit.u[k]))
                # The next way begins along the one that was flat so far.
                begin[(k, side)] = np.clip(2.0 * u - fit.u, fit.model.lower, fit.model.upper)
                going.append((k, side))
        if not going:
            break
    return out


def _followed(
    search: Search, fit: Fit, normal: Array, wanted: dict[tuple[int, float], tuple[float, Array]]
) -> dict[tuple[int, float], tuple[Array, float]]:
    """Of each value (number, side) that goes to its goal, beginning from others, the best that is simulated on the way on which
    the others follow: all values and the energy."""
    now: dict[tuple[int, float], Array] = {}
    for (k, side), (goal, begin) in wanted.items():
        rest = [i for i in range(len(fit.u)) if i != k]
        u = begin.copy()
        u[rest] -= _solved(normal, rest, normal[rest, k] * (goal - u[k]))
        u[k] = goal
        now[(k, side)] = np.clip(u, fit.model.lower, fit.model.upper)
    best: dict[tuple[int, float], tuple[Array, float]] = {}
    for _ in range(FOLLOWED):
        rows = search.residuals([fit.model.hypothesis(u) for u in now.values()])
        for (one, u), r in zip(list(now.items()), rows, strict=True):
            energy = float(r[fit.mask] @ r[fit.mask])
            if not np.isfinite(energy):
                continue
            if one not in best or energy < best[one][1]:
                best[one] = (u, energy)
            smooth, weights = weighed(search.problem, r)
            rest = [i for i in range(len(u)) if i != one[0]]
            pull = fit.slopes[:, rest].T @ (weights * smooth)[fit.mask]
            then = u.copy()
            then[rest] -= _solved(normal, rest, pull)
            now[one] = np.clip(then, fit.model.lower, fit.model.upper)
    return best


def _solved(normal: Array, rest: list[int], pull: Array) -> Array:
    own = normal[np.ix_(rest, rest)]
    damp = 1e-6 * np.trace(own) / max(1, len(rest)) + 1e-12
    return np.asarray(np.linalg.solve(own + damp * np.eye(len(rest)), pull))
