"""Which segments are fitted and which judge: two halves that take turns, so that every segment is held out once."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ee_dist.discrepancy.problem import Problem
from ee_dist.trials.log import Array

Mask = NDArray[np.bool_]


def halves(problem: Problem) -> NDArray[np.int64]:
    """(segments,) 0 or 1. Windows of a trial alternate; where a trial is a single segment, the trials do."""
    trial = problem.trial_of_segment
    half = np.zeros(len(trial), dtype=np.int64)
    single = 0
    for k in np.unique(trial):
        members = np.flatnonzero(trial == k)
        if len(members) == 1:
            half[members] = single
            single = 1 - single
        else:
            half[members] = (np.arange(len(members)) + k) % 2
    return half


def mask_of(problem: Problem, half: int, of: NDArray[np.int64] | None = None) -> Mask:
    """(n,) residual values whose segments are in that half."""
    chosen = halves(problem) if of is None else of
    return np.asarray(chosen[problem.segment_of] == half)


def bootstrap(
    differences: Array,
    seed: int = 0,
    draws: int = 1000,
    level: float = 0.95,
    groups: NDArray[np.int64] | None = None,
) -> tuple[float, float]:
    """Interval of the sum of ``differences`` (segments,) under resampling of the segments, within each of ``groups``
    (segments,) if they are given: what shows only in some trials does not vanish because none of them was drawn."""
    d = np.asarray(differences, dtype=float)
    if not np.isfinite(d).all() or not len(d):
        return (-np.inf, np.inf)
    rng = np.random.default_rng([seed, len(d)])
    of = np.zeros(len(d), dtype=np.int64) if groups is None else groups
    sums = np.zeros(draws)
    for g in np.unique(of):
        mine = d[of == g]
        sums += mine[rng.integers(0, len(mine), (draws, len(mine)))].sum(axis=1)
    low, high = np.quantile(sums, [(1 - level) / 2, (1 + level) / 2])
    return float(low), float(high)


def per_segment(problem: Problem, residual: Array) -> Array:
    """(segments,) energy of one residual (n,)."""
    return np.bincount(problem.segment_of, weights=residual**2, minlength=len(problem.segments))


def total(values: Sequence[float] | Array) -> float:
    return float(np.sum(values))
