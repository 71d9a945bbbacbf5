"""The beginning of trials, for what only looks where to go: of long ones it tells that as well, in a fraction of the time."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ee_dist.discrepancy.search.fitted import Model
from ee_dist.discrepancy.search.ground import Ground
from ee_dist.discrepancy.search.refit import Refit
from ee_dist.discrepancy.search.search import Search
from ee_dist.discrepancy.search.slopes import slopes_at
from ee_dist.discrepancy.search.trials import telling
from ee_dist.effects.catalogue import Hypothesis
from ee_dist.trials.log import Array

BEGINNING_S, BUSY = 8.0, 0.5
"""How much of each trial is looked at first, and what it must have to explain for its length, as a share of what the whole
has."""
COUNTS = 0.02
"""Share of what all channels have to explain from which each of them must, where candidates of all of them are chosen."""


def briefly(search: Search, residual: Array, hypothesis: Hypothesis) -> Search:
    """The search on the beginning of its trials; itself where that is no shorter, or has less to explain than the rest of what
    the model of ``hypothesis`` leaves: the ``residual`` (n,)."""
    return _beginning(search, residual, hypothesis)[0]


def _beginning(search: Search, residual: Array, hypothesis: Hypothesis) -> tuple[Search, Array]:
    """The same, with what the model leaves of it."""
    brief = replace(search, problem=search.problem.beginning(BEGINNING_S))
    if brief.problem is search.problem or not brief.everything.any():
        return search, residual
    first = brief.on(hypothesis).base()
    begun, usual = (float(a.sum() / n.sum()) for a, n in (_above(brief, first), _above(search, residual)))
    return (brief, first) if begun >= BUSY * usual else (search, residual)


@dataclass(frozen=True, eq=False)
class InBrief:
    """What candidates are chosen on: a ``search`` that has not fixed the model so far, the ``slopes`` (n, P) of its
    values, and what it leaves."""

    search: Search
    slopes: Array | None
    ground: Ground


def in_brief(search: Search, model: Model, u: Array, residual: Array, refit: Refit) -> InBrief:
    """Of one trial that tells explanations apart, for the model so far, of which the values' slopes are known (``refit``) and
    that leaves the ``residual`` (n,)."""
    found, slopes = _tells_in_brief(search, residual, model.hypothesis(u)), refit.slopes
    if found is not search and len(u):
        slopes = slopes_at(found, model, u)
    return InBrief(found, slopes, Ground.of(found.on(model.hypothesis(u)), Refit(slopes)))


def _tells_in_brief(search: Search, residual: Array, hypothesis: Hypothesis) -> Search:
    """The same where the beginning of one trial tells explanations apart by itself too, and no channel that has much to explain
    is at rest there."""
    brief, first = _beginning(search, residual, hypothesis)
    if brief is search or brief.problem.channels != search.problem.channels:
        return search
    if telling(brief.problem, first, np.unique(brief.problem.trial_of[brief.everything]).tolist()) is None:
        return search
    (begun, few), (usual, many) = _above(brief, first), _above(search, residual)
    much = usual > COUNTS * usual.clip(0.0).sum()
    return brief if (begun * many >= BUSY * usual * few)[much].all() else search


def _above(search: Search, residual: Array) -> tuple[Array, Array]:
    """Energy above the noise of each channel, and how many values it has: (C,) each."""
    problem, own = search.problem, search.everything
    channel, count = problem.channel_of[own], len(problem.channels)
    return (
        np.bincount(channel, weights=residual[own] ** 2 - problem.floor[own], minlength=count),
        np.bincount(channel, minlength=count).astype(float),
    )
