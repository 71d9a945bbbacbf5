"""Motions on which an improved model is worse than the one that it came from, though it is better on all together."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ee_dist.discrepancy.ladder import Improvement
from ee_dist.discrepancy.problem import Problem

CLEARLY = 1.05
"""Times the error that a trial must be worse by,"""
SURE = 2.0
"""and standard errors of its windows."""


@dataclass(frozen=True)
class Worse:
    """A trial, and its error under the model as it was and under the improved one while it was held out."""

    trial: str
    before: float
    after: float


def worse_trials(problem: Problem, found: Improvement) -> list[Worse]:
    """The worst first. One number over all motions hides that what was added suits some of them only: a load or a setting that
    is not the same in all, or an effect that is another."""
    if len(found.ladder) < 2 or len(problem.trials) < 2:
        return []
    first, last = found.ladder[0].held, found.ladder[-1].held
    of = np.asarray(problem.trial_of_segment)
    if not len(first) == len(last) == len(of):
        return []
    values = np.bincount(problem.segment_of, minlength=len(of))
    worse = []
    for k, trial in enumerate(problem.trials):
        mine = of == k
        more, size = (last - first)[mine], values[mine].sum()
        if not size or not np.isfinite(more).all():
            continue
        before, after = (float(np.sqrt(e[mine].sum() / size / problem.weight_of(k))) for e in (first, last))
        spread = float(np.std(more) * np.sqrt(len(more)))
        if after > CLEARLY * before and more.sum() > SURE * spread:
            worse.append(Worse(trial, before, after))
    return sorted(worse, key=lambda w: w.before - w.after)


def worse_text(problem: Problem, worse: list[Worse], on: str) -> str:
    """The same, for people; ``on``: what the search held out, in their words."""
    told = "; ".join(f"{w.trial} {problem.told(w.before)} -> {problem.told(w.after)}" for w in worse[:3])
    more = f" and {len(worse) - 3} more" if len(worse) > 3 else ""
    return (
        f"Worse than before on {on}: {told}{more}. The motions contradict one another: a load or a setting "
        "that is not the same in all of them, or an effect that is another."
    )
