"""Scanning: the promising candidates over their whole range, before any slope is trusted.

A torque limit does nothing until the load reaches it; a residual through contacts has ridges. A dozen honest
evaluations over the range find the basin that a slope from neutral would miss.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ee_dist.discrepancy.search.candidates import Candidate
from ee_dist.discrepancy.search.refit import Refit
from ee_dist.discrepancy.search.screen import Screened
from ee_dist.discrepancy.search.search import Search
from ee_dist.trials.log import Array

LADDER = (0.03, 0.08, 0.18, 0.32, 0.48, 0.66, 0.85)
"""Shares of the range at which a single parameter is tried, to each side that promises anything."""
SCATTERED = 14
"""Points tried in the range of several parameters."""


@dataclass(frozen=True, eq=False)
class Scanned:
    """``starts``: the best points found, best first. ``energy`` of the first of them, over all residual values."""

    candidate: Candidate
    energy: float
    starts: tuple[Array, ...]


def scan(search: Search, promising: Sequence[Screened], refit: Refit = Refit()) -> list[Scanned]:  # noqa: B008
    """Each candidate's best points, in the order given, by the energy that is left once the model so far is fitted anew."""
    refit = refit.among(search)
    points = [(i, u) for i, s in enumerate(promising) for u in _points(s, i)]
    found: list[list[tuple[float, Array]]] = [[] for _ in promising]
    for part in search.batches(len(points)):
        some = points[part]
        rows = search.residuals([(promising[i].candidate.term(u),) for i, u in some])
        for (i, u), r in zip(some, rows, strict=True):
            if np.isfinite(r).all():
                left = refit(r)
                found[i].append((float(left @ left), u))
        search.progress("scanning", part.stop / len(points))
    out = []
    for s, mine in zip(promising, found, strict=True):
        mine.sort(key=lambda f: f[0])
        if mine:
            out.append(Scanned(s.candidate, mine[0][0], tuple(u for _, u in mine[:3])))
    return out


def _points(screened: Screened, index: int) -> list[Array]:
    c = screened.candidate
    if not c.size:
        return [np.zeros(0)]
    points = list(screened.starts)
    if c.size == 1:
        side = np.sign(screened.starts[0][0]) if len(screened.starts) and screened.starts[0][0] else 1.0
        sides = {side} | {np.sign(u[0]) for u in screened.starts[:2] if u[0]}
        points += [np.array([s * share]) for s in sorted(sides) for share in LADDER]
    else:
        lead = screened.starts[0] if screened.starts else c.upper * 0.3
        points += [np.clip(lead * f, c.lower, c.upper) for f in (0.5, 1.5, 2.5)]
        from scipy.stats import qmc  # only here: it takes a second to load

        spread = qmc.Sobol(c.size, seed=np.random.default_rng([index, c.size])).random(16)[:SCATTERED]
        points += [c.lower + p * (c.upper - c.lower) for p in spread]
    return [np.clip(u, c.lower, c.upper) for u in points]
