"""Screening: a few rollouts for each candidate tell which could explain the residual at all.

Each probe shifts the prediction by some d. The residual r is best explained by a share a of that shift, a = <d, r>/<d, d>,
which takes <d, r>^2 / <d, d> off its energy: the gain that the candidate promises. For an effect of small, linear action
this is exact from a single probe; for others a probe of the right size comes close.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ee_dist.discrepancy.search.candidates import Candidate
from ee_dist.discrepancy.search.refit import Refit
from ee_dist.discrepancy.search.search import Search
from ee_dist.trials.log import Array


@dataclass(frozen=True, eq=False)
class Screened:
    """``promise``: energy that the candidate could take off the residual. ``starts``: values (u) to fit from, best
    first. ``reach``: largest change of the prediction that any probe made, as energy."""

    candidate: Candidate
    promise: float
    starts: tuple[Array, ...]
    reach: float


def screen(
    search: Search,
    pool: Sequence[Candidate],
    shares: Sequence[float] = (0.1, 0.6),
    refit: Refit = Refit(),  # noqa: B008
) -> list[Screened]:
    """Promise of each candidate on top of what the search has fixed, in the order of the pool. ``refit``: what the values of
    the model so far can make up for by themselves is no promise."""
    refit = refit.among(search)
    base = refit(search.base())
    points = [(i, u) for i, c in enumerate(pool) for u in c.probes(shares)]
    rows: list[list[tuple[Array, float, float, float]]] = [[] for _ in pool]
    total = float(base @ base)
    for part in search.batches(len(points)):
        some = points[part]
        found = search.residuals([(pool[i].term(u),) for i, u in some])
        for (i, u), r in zip(some, found, strict=True):
            if np.isfinite(r).all():
                rows[i].append((u, *_promise(base, refit(r), total, pool[i], u)))
        search.progress("screening", part.stop / len(points))
    return [_screened(c, found) for c, found in zip(pool, rows, strict=True)]


def _promise(base: Array, r: Array, total: float, candidate: Candidate, u: Array) -> tuple[float, float, float]:
    """(promise, best share of the probe, reach) of one probe."""
    d = base - r
    reach = float(d @ d)
    if reach < 1e-9:
        return 0.0, 0.0, 0.0
    a = float(d @ base) / reach
    if not len(u):
        a = 1.0
    else:
        size = float(np.abs(u).max())
        low = -1.0 if (candidate.lower[np.abs(u).argmax()] < 0 and candidate.upper[np.abs(u).argmax()] > 0) else 0.0
        a = min(max(a, low / size), 1.0 / size)
        a = min(max(a, -3.0), 3.0)
    linear = float(a * (d @ base) * 2 - a * a * reach)
    direct = total - float(r @ r)
    return max(linear, direct, 0.0), (1.0 if direct >= linear else a), reach


def _screened(candidate: Candidate, found: list[tuple[Array, float, float, float]]) -> Screened:
    if not found:
        return Screened(candidate, 0.0, (), 0.0)
    ordered = sorted(found, key=lambda f: -f[1])
    starts: list[Array] = []
    if candidate.size > 1:
        # The best point of each parameter, put together: the parameters of an effect often add up (x and y of a push).
        joint = np.zeros(candidate.size)
        for u, promise, share, _ in reversed(ordered):
            k = int(np.abs(u).argmax())
            if promise > 0:
                joint[k] = share * u[k]
        starts.append(np.clip(joint, candidate.lower, candidate.upper))
    for u, _, share, _ in ordered[:3]:
        starts.append(np.clip(share * u, candidate.lower, candidate.upper) if len(u) else u)
    return Screened(candidate, ordered[0][1], tuple(starts), max(f[3] for f in found))
