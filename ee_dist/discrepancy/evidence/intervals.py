"""How sure a fitted value is: by noise where only noise is left, by the spread between trials where more is left."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri, stdtrit  # scipy.stats, which calls them, takes a second to load

from ee_dist.discrepancy.problem import Problem
from ee_dist.discrepancy.search.fitted import Fit
from ee_dist.effects.catalogue import Hypothesis
from ee_dist.trials.log import Array

AT_BOUND = 0.985
"""Share of the way to a bound from which a value counts as being at it."""
LEVEL = 0.95
FEW = 3
"""Trials from which they are the pieces that vary; with fewer, segments are."""
NOT_DETERMINED = "not determined by these data"
BOUND = "at its bound: the range is too small, or the effect is another"
NONE_LEFT = "at its bound: next to none is left of what was described"
NEUTRAL = "not told from neutral"


@dataclass(frozen=True)
class ParameterReport:
    """A fitted value of term number ``term`` with its 95 % interval, in the parameter's own unit; ``flag`` says what is
    wrong with it, if anything."""

    term: int
    name: str
    value: float
    low: float
    high: float
    flag: str


def parameters(problem: Problem, fit: Fit) -> list[ParameterReport]:
    """Every value of a fit, in the order of its terms."""
    half_u = half_widths(problem, fit)
    out, at = [], 0
    hypothesis: Hypothesis = fit.hypothesis
    for index, (c, term) in enumerate(zip(fit.model.parts, hypothesis, strict=True)):
        u, s = fit.u[at : at + c.size], half_u[at : at + c.size]
        rooms = c.rooms(u)
        for k, (name, value) in enumerate(term.values):
            half = float(s[k] * abs(rooms[k])) if np.isfinite(s[k]) else math.inf
            flag = ""
            if not np.isfinite(half) or half > max(abs(rooms[k]), 1e-12):
                flag = NOT_DETERMINED
            elif abs(u[k]) > AT_BOUND:
                flag = NONE_LEFT if u[k] < 0 and c.effect.parameters[k].on_top else BOUND
            elif abs(u[k]) < s[k]:
                flag = NEUTRAL
            out.append(ParameterReport(index, name, value, value - half, value + half, flag))
        at += c.size
    return out


def half_widths(problem: Problem, fit: Fit, level: float = LEVEL) -> Array:
    """(P,) half the interval of each u.

    The larger of two: from the noise of single values, and from the spread between pieces of evidence, trials where there
    are three or more (cluster-robust covariance, Liang and Zeger 1986), with Student's quantile for so few pieces. Infinite
    where the data say nothing.
    """
    if not len(fit.u):
        return np.zeros(0)
    normal = fit.slopes.T @ fit.slopes
    weak = np.diag(normal) < 1e-9
    inverse = np.linalg.pinv(normal + np.diag(np.where(weak, 1e-9, 0.0)))
    excess = max(1.0, fit.energy / max(1, int(fit.mask.sum()) - len(fit.u)))
    by_noise = np.sqrt(np.maximum(np.diag(inverse), 0.0) * excess) * ndtri(0.5 + level / 2)
    piece = problem.trial_of if len(problem.trials) >= FEW else problem.segment_of
    piece = np.unique(piece[fit.mask], return_inverse=True)[1]
    count = int(piece.max()) + 1
    if count < 2:
        return np.where(weak, np.inf, by_noise)
    pull = fit.slopes * fit.residual[fit.mask][:, None]
    scores = np.stack([np.bincount(piece, weights=column, minlength=count) for column in pull.T], axis=1)
    spread = inverse @ (scores.T @ scores) @ inverse * count / (count - 1)
    by_pieces = np.sqrt(np.maximum(np.diag(spread), 0.0)) * stdtrit(count - 1, 0.5 + level / 2)
    return np.where(weak, np.inf, np.maximum(by_noise, by_pieces))
