"""What every stage of a search shares, bound once: the problem, what the model has already, on which trials, who watches."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from ee_dist.discrepancy.problem import Mask, Problem
from ee_dist.effects.catalogue import Hypothesis
from ee_dist.trials.log import Array


class Progress(Protocol):
    """Told what is being done, the share of it that is done in [0, 1], and the error of the best that was found on the way, of
    the data that it is fitted to."""

    def __call__(self, what: str, share: float, error: float | None = None) -> None: ...


BATCH = 240
"""Hypotheses that are asked for in one call while many are probed, at most,"""
VALUES = 8_000_000
"""and residual values that they may have together: of long logs a call takes seconds and 64 MB with few of them."""
FIRST = 20
"""How much smaller the first of them is where they are of long logs."""


def quiet(what: str, share: float, error: float | None = None) -> None:
    """Progress that nobody watches."""


def least_error(energies: Sequence[float], values: int) -> float | None:
    """The least error by the energies of so many residual values; None where nothing can be simulated."""
    least = min(energies, default=np.inf)
    return float(np.sqrt(least / values)) if np.isfinite(least) and values else None


def within(doing: str, progress: Progress) -> Progress:
    """Progress of the steps of something that is being done: ``doing: step``."""

    def told(what: str, share: float, error: float | None = None) -> None:
        progress(f"{doing}: {what}", share, error)

    return told


@dataclass(frozen=True)
class Search:
    """``fixed``: terms that every hypothesis has, with values that are not searched; ``trials``: those that are
    simulated (None: all), ``pieces``: what of these, where a way can simulate less than whole trials (None: all of it);
    residual values of the rest are zero."""

    problem: Problem
    fixed: Hypothesis = ()
    trials: tuple[int, ...] | None = None
    pieces: tuple[int, ...] | None = None
    progress: Progress = quiet

    def residuals(self, hypotheses: Sequence[Hypothesis]) -> Array:
        """(H, n) of the fixed terms followed by each hypothesis; none are simulated where none are asked for."""
        if not hypotheses:
            return np.zeros((0, len(self.problem.segment_of)))
        models = [(*self.fixed, *h) for h in hypotheses]
        if self.pieces is not None:
            return self.problem.residuals_of_pieces(models, self.pieces)
        return self.problem.residuals(models, self.trials)

    @property
    def batch(self) -> int:
        """How many hypotheses are asked for in one call, by the memory that they take."""
        return max(1, min(BATCH, VALUES // max(1, len(self.problem.segment_of))))

    def batches(self, count: int) -> Iterator[slice]:
        """``count`` hypotheses in the batches that they are asked for in. Where logs are long, so that memory bounds them, the
        first are smaller: who waits is told soon how long."""
        size = max(1, self.batch // FIRST) if self.batch < BATCH else self.batch
        at = 0
        while at < count:
            yield slice(at, min(at + size, count))
            at, size = at + size, min(2 * size, self.batch)

    def doing(self, what: str) -> Search:
        """The same, of which it is said what for."""
        return replace(self, progress=within(what, self.progress))

    def base(self) -> Array:
        """(n,) with the fixed terms alone."""
        return np.asarray(self.residuals([()])[0])

    def on(self, terms: Hypothesis) -> Search:
        """The same on top of more fixed terms."""
        return replace(self, fixed=(*self.fixed, *terms))

    def among(self, trials: Sequence[int] | None) -> Search:
        return replace(self, trials=None if trials is None else tuple(trials), pieces=None)

    def within(self, mask: Mask) -> Search:
        """The same on the pieces of trials that some residual values (n,) are of; itself where these are all that it has."""
        piece_of = self.problem.piece_of
        mine, few = np.unique(piece_of[self.everything]), np.unique(piece_of[mask & self.everything])
        if len(few) == len(mine):
            return self
        of = tuple(np.unique(self.problem.trial_of[mask & self.everything]).tolist())
        whole = np.unique(piece_of[np.isin(self.problem.trial_of, of)])
        return replace(self, trials=of, pieces=None if len(whole) == len(few) else tuple(few.tolist()))

    @property
    def everything(self) -> Mask:
        """(n,): the values that are simulated. The zeros of the others would pass for evidence."""
        if self.pieces is not None:
            return np.isin(self.problem.piece_of, self.pieces)
        if self.trials is None:
            return np.ones(len(self.problem.segment_of), dtype=bool)
        return np.isin(self.problem.trial_of, self.trials)
