"""Tied explanations as a plan needs them: their values fitted together once more, and how well measurements settle these."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ee_dist.discrepancy.plan import Contender
from ee_dist.discrepancy.problem import Problem
from ee_dist.discrepancy.search.candidates import Candidate, known, values_of
from ee_dist.discrepancy.search.fit import fit_all
from ee_dist.discrepancy.search.fitted import Model
from ee_dist.discrepancy.search.search import Progress, Search, quiet
from ee_dist.discrepancy.search.slopes import WIDTHS, slopes_at
from ee_dist.discrepancy.search.valley import LARGE
from ee_dist.effects.catalogue import Hypothesis
from ee_dist.trials.log import Array


@dataclass(frozen=True, eq=False)
class Field:
    """The contenders in the order asked; ``left``: mean square of what the best leaves of the measurements, at least 1."""

    contenders: tuple[Contender, ...]
    left: float


def contenders(problem: Problem, explanations: Sequence[Hypothesis], progress: Progress = quiet) -> Field:
    """Explanations, each with all terms of its model, fitted to the measurements once more.

    Of models with many values only those are free in which the explanations differ; of calibrated ones too.
    """
    common = {t.name for t in explanations[0]}.intersection(*({t.name for t in h} for h in explanations[1:]))
    count = max(sum(len(t.values) for t in h) for h in explanations)
    search = Search(problem, progress=progress)
    fixed, free = [], []
    for terms in explanations:
        settled = common if problem.calibrated or count >= LARGE else frozenset[str]()
        fixed.append(tuple(t for t in terms if t.name in settled))
        free.append(tuple(t for t in terms if t.name not in settled))
    models = [Model(tuple(known(problem.robot, t) for t in terms)) for terms in free]
    starts = [values_of(m.parts, terms) for m, terms in zip(models, free, strict=True)]
    found, left = [], []
    for on, model, u in zip(map(search.on, fixed), models, starts, strict=True):
        fit = fit_all(on, [(model, u)], None, WIDTHS[2:])[0]
        left.append(float(np.mean(fit.residual**2)))
        slopes = slopes_at(on, model, fit.u)
        nearby, step = _nearby(model, fit.u)
        moved = tuple((*on.fixed, *h) for h in nearby)
        found.append(Contender((*on.fixed, *fit.hypothesis), moved, step, slopes.T @ slopes))
    return Field(tuple(found), max(1.0, left[0]))


def _nearby(model: Model, u: Array) -> tuple[tuple[Hypothesis, ...], tuple[float, ...]]:
    """The model with one value moved each, towards the inside, and by how much."""
    out, steps = [], []
    for k in range(len(u)):
        moved = u.copy()
        moved[k] += WIDTHS[2] if u[k] + WIDTHS[2] <= model.upper[k] else -WIDTHS[2]
        out.append(model.hypothesis(moved))
        steps.append(float(moved[k] - u[k]))
    return tuple(out), tuple(steps)


def with_others_for(terms: Hypothesis, old: Hypothesis, new: Hypothesis) -> Hypothesis:
    """A model in which other terms stand where the first of the ``old`` stood, and none of these."""
    gone = {t.name for t in old}
    at = [t.name in gone for t in terms].index(True)
    return (*terms[:at], *new, *(t for t in terms[at:] if t.name not in gone))


def suspected(chosen: Candidate, share: float) -> Hypothesis:
    """An effect that was not found, at a share of its range, to the side that has more of it."""
    larger = np.where(chosen.upper >= -chosen.lower, chosen.upper, chosen.lower)
    return (chosen.term(share * larger),)
