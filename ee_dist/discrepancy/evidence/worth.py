"""What an effect of a model is worth: how much of the error would be back without it, once the others have been fitted anew.

In a robot that is a little wrong everywhere the effects that were added last, and take off little, may stand in for something
that nobody listed: what hardly anything depends on is told apart from what the model stands on.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from ee_dist.discrepancy.problem import Problem
from ee_dist.discrepancy.search.fitted import Fit
from ee_dist.trials.log import Array


@dataclass(frozen=True, eq=False)
class Worth:
    """Of the parts of a fit by their ``names``, whose values are at ``places`` of u (P,). ``normal`` (P, P): products of the
    slopes; ``above``: squared error above the noise that there was to explain."""

    names: tuple[str, ...]
    places: tuple[slice, ...]
    u: Array
    normal: Array
    above: float

    def of(self, names: Collection[str]) -> float:
        """Share of ``above`` that goes with these together, by the parabola that the slopes give (Wald's statistic); NaN for what
        was not fitted, or where there was nothing to explain."""
        mine = np.concatenate(
            [np.arange(p.start, p.stop) for n, p in zip(self.names, self.places, strict=True) if n in names]
            or [np.zeros(0, dtype=int)]
        )
        if not len(mine) or not np.isfinite(self.above) or self.above <= 0:
            return float("nan")
        others = np.setdiff1d(np.arange(len(self.u)), mine)
        # What the others cannot make up for.
        own = self.normal[np.ix_(mine, mine)]
        if len(others):
            shared = self.normal[np.ix_(others, mine)]
            rest = self.normal[np.ix_(others, others)]
            own = own - shared.T @ np.linalg.pinv(rest, hermitian=True) @ shared
        return float(np.clip(self.u[mine] @ own @ self.u[mine] / self.above, 0.0, 1.0))


def worth_of(problem: Problem, fit: Fit, base: Array) -> Worth:
    """Of a fit to all data; ``base`` (n,) is the residual of the model before anything was added or fitted."""
    slopes = np.where(np.isfinite(fit.slopes), fit.slopes, 0.0)
    above = float((base**2).sum() - problem.floor.sum())
    names = tuple(c.name for c in fit.model.parts)
    return Worth(names, tuple(fit.model.places), fit.u, slopes.T @ slopes, above)
