"""Which trials a search looks at: those that can be predicted, and of these the ones that have most to explain.

Where one trial tells explanations apart by itself, most of what only chooses, and judges nothing, may be simulated on it alone.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ee_dist.discrepancy.problem import Mask, Problem
from ee_dist.trials.log import Array

CALM = 0.8
"""Share of the most predictable trial's trust from which a trial counts as calm."""
TELLING = 1000.0
"""Energy above the noise (in variances) in one trial from which candidates are screened by it alone: some thirty times what luck
promises the best of a few hundred, so that a right one, whose small probe may say a third of it, is not lost among them."""


def calm_trials(problem: Problem, base: Array) -> list[int]:
    """Trials to search on: those that can be predicted, where the residual follows a parameter smoothly. One trial in
    which a controller was in the loop is always among them: only there does wiring show. All, where the calm ones have
    nothing to explain."""
    count, trust = len(problem.trials), problem.trust
    chosen = [k for k in range(count) if trust[k] >= CALM * max(trust)]
    if problem.looped and not set(problem.looped) & set(chosen):
        chosen.append(problem.looped[0])
    own = np.isin(problem.trial_of, chosen)
    if _above_noise(problem, base, own) < 6.0 * float(np.sqrt(2.0 * problem.floor[own].sum())):
        return list(range(count))
    return sorted(chosen)


def busiest(problem: Problem, base: Array, among: Sequence[int], share: float = 0.5) -> list[int]:
    """Of some trials those with most to explain for their length, up to a share of all their values; a trial with a
    controller in the loop is always among them."""
    size = np.bincount(problem.trial_of, minlength=len(problem.trials))
    chosen: list[int] = []
    for k in by_excess(problem, base, among):
        if not chosen or size[chosen].sum() < share * size[list(among)].sum():
            chosen.append(k)
    looped = [k for k in problem.looped if k in among]
    if looped and not set(looped) & set(chosen):
        chosen.append(looped[0])
    return sorted(chosen)


def by_excess(problem: Problem, base: Array, among: Sequence[int]) -> list[int]:
    """Some trials by how much they have to explain for their length, most first."""
    count = len(problem.trials)
    size = np.bincount(problem.trial_of, minlength=count)
    excess = np.bincount(problem.trial_of, weights=base**2 - problem.floor, minlength=count)
    return sorted(among, key=lambda k: -float(excess[k]) / max(int(size[k]), 1))


def telling(problem: Problem, base: Array, among: Sequence[int]) -> int | None:
    """The trial among some that has most to explain for its length, if that is enough to tell explanations apart by it alone."""
    k = by_excess(problem, base, among)[0]
    return k if _above_noise(problem, base, problem.trial_of == k) >= TELLING else None


def telling_values(problem: Problem, residual: Array, mask: Mask) -> Mask:
    """(n,) those values of ``mask`` (n,) that are of its telling trial; all of them where none tells enough."""
    k = telling(problem, residual, np.unique(problem.trial_of[mask]).tolist())
    return mask if k is None else mask & (problem.trial_of == k)


def _above_noise(problem: Problem, base: Array, own: Mask) -> float:
    """Energy above the noise of some residual values (n,)."""
    return float((base[own] ** 2 - problem.floor[own]).sum())
