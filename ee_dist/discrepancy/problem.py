"""What the four verbs work on: measured data, a model, and the residual between them, for many hypotheses at once."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ee_dist.effects.catalogue import Hypothesis
from ee_dist.robots.model import Robot
from ee_dist.trials.log import Array

Index = NDArray[np.int64]


class Problem(Protocol):
    """Measured data against one base model.

    A residual value is (measured - predicted) / scale of its channel, so that values of all channels can be added up.
    Residuals are cut into ``segments`` (trials, or windows of one): fitting uses some, judging the others.
    """

    robot: Robot
    """The base model that hypotheses are applied to."""
    segments: tuple[str, ...]
    """Names, ``<trial>@<start>s``; neighbours in time are neighbours here."""
    segment_of: Index
    """(n,) the segment of each residual value."""
    trial_of_segment: Index
    """(segments,) the trial that each segment is a part of."""
    trials: tuple[str, ...]
    channel_of: Index
    """(n,) the channel of each residual value."""
    channels: tuple[str, ...]
    floor: Array
    """(n,) mean square of each residual value under a perfect model: what noise alone would leave."""
    error_definition: str
    """One sentence: what the error number is, with its unit."""

    def residuals(self, hypotheses: Sequence[Hypothesis], trials: Sequence[int] | None = None) -> Array:
        """(H, n): one row a hypothesis. Rows with numbers that are not finite mean a model that cannot be simulated.

        With ``trials`` only those are computed; values of the others are zero, whatever the hypothesis.
        """
        ...

    def noise_floor(self) -> tuple[float, str]:
        """The error that a perfect model would have, and whether it was measured (repeated trials) or estimated."""
        ...


def error(residuals: Array) -> float:
    """Root mean square of residual values: the one error number. Infinite where a model cannot be simulated."""
    return float(np.sqrt(np.mean(np.square(residuals)))) if np.isfinite(residuals).all() else float("inf")


def energy(residuals: Array, segment_of: Index, segments: int) -> Array:
    """(H, n) -> (H, segments): sums of squares; infinite for a model that cannot be simulated."""
    rows = np.atleast_2d(residuals)
    square = np.where(np.isfinite(rows), rows, 0.0) ** 2
    out = np.stack([np.bincount(segment_of, weights=r, minlength=segments) for r in square])
    out[~np.isfinite(rows).all(axis=1)] = np.inf
    return out
