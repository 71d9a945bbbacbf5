"""Values of which the other sign does as well.

Intervals come from slopes where a value is. Of a base that is tilted about an axis along its joints only the cosine acts: the
slopes tell the size of the tilt, and nothing tells to which side."""

from __future__ import annotations

import numpy as np

from ee_dist.discrepancy.evidence.judge import TIE_ENERGY
from ee_dist.discrepancy.problem import Mask
from ee_dist.discrepancy.search.fitted import Fit
from ee_dist.discrepancy.search.search import Search


def either_sign(search: Search, fit: Fit) -> Mask:
    """(P,) values of a fit that may as well be on the other side of neutral, as far from it: simulated, nothing fitted anew."""
    u, model, out = fit.u, fit.model, np.zeros(len(fit.u), dtype=bool)
    two_sided = np.flatnonzero((u != 0) & (model.lower <= -np.abs(u)) & (model.upper >= np.abs(u)))
    if not len(two_sided):
        return out
    turned = np.repeat(u[None], len(two_sided), axis=0)
    turned[np.arange(len(two_sided)), two_sided] *= -1
    rows = search.residuals([model.hypothesis(v) for v in turned])
    noise = max(float(search.problem.floor[fit.mask].mean()), fit.energy / int(fit.mask.sum()))
    with np.errstate(invalid="ignore", over="ignore"):
        rise = (rows[:, fit.mask] ** 2).sum(axis=1) - fit.energy
    out[two_sided] = rise < TIE_ENERGY * noise
    return out
