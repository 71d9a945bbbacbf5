"""What fitting a model's own values anew would take off a residual, without fitting: the part along their slopes.

A new effect that mimics what the model has already promises nothing, and one that earlier values have stood in for
promises more than it seems (the theorem of Frisch, Waugh and Lovell).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ee_dist.discrepancy.search.search import Search
from ee_dist.trials.log import Array


@dataclass(frozen=True, eq=False)
class Refit:
    """``slopes`` (n, P) of the model's own values; None: it has none, or they stay."""

    slopes: Array | None = None
    basis: Array | None = None

    def among(self, search: Search) -> Refit:
        """For residuals of the trials that a search simulates, zero elsewhere."""
        if self.slopes is None or not self.slopes.shape[1]:
            return Refit()
        seen = self.slopes
        if search.trials is not None:
            seen = np.where(np.isin(search.problem.trial_of, search.trials)[:, None], seen, 0.0)
        q, r = np.linalg.qr(seen)
        size = np.abs(np.diag(r))
        return Refit(self.slopes, q[:, size > 1e-9 * max(float(size.max()), 1e-12)])

    def __call__(self, residual: Array) -> Array:
        """(n,) what is left of a residual."""
        return residual if self.basis is None else residual - self.basis @ (self.basis.T @ residual)
