"""How far each step of a ladder is from the trials that were held out from all of it: told as it climbs, and never used.

What a search holds back of the trials that it fits is seen by all its choices in the end. No module of the search may import
this one (``lint-imports`` holds it to that).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ee_dist.discrepancy.problem import Problem, error
from ee_dist.effects.catalogue import Hypothesis
from ee_dist.trials.log import Array


@dataclass(frozen=True, eq=False)
class StepApart:
    """The error of the model after a step by the measure of the search, infinite where it cannot be simulated; ``energy``
    (segments, channels) the squares that it is made of, ``off`` (channels,) root mean squares in the units of the channels."""

    error: float
    energy: Array
    off: Array


def step_apart(problem: Problem, model: Hypothesis) -> StepApart:
    """Of trials that took no part in the search, with the ``model`` that a step of it came to."""
    residual = np.asarray(problem.residuals([model])[0])
    wide, size = len(problem.channels), len(problem.segments) * len(problem.channels)
    energy = np.bincount(problem.segment_of * wide + problem.channel_of, weights=residual**2, minlength=size)
    raw = problem.raw(residual)
    squares, there = np.where(np.isfinite(raw), raw, 0.0) ** 2, np.isfinite(raw)
    total, count = (np.bincount(problem.channel_of, weights=w, minlength=wide) for w in (squares, there))
    off = np.sqrt(np.divide(total, count, out=np.zeros(wide), where=count > 0))
    return StepApart(error(residual), energy.reshape(-1, wide), off)
