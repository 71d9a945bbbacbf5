"""Descents from many starts side by side, of which ever fewer go on.

What an effect does beside fifty small values shows only where these may follow it: by slopes at the model without it a motor
with a quarter of its torque was the eighteenth of all, and after three steps of a descent with it the first.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ee_dist.discrepancy.problem import Mask
from ee_dist.discrepancy.search.fitted import Fit, Model
from ee_dist.discrepancy.search.search import Search
from ee_dist.discrepancy.search.valley import ITERATIONS, WIDEST, follow_valley
from ee_dist.trials.log import Array

Heats = Sequence[tuple[int, int]]
"""Iterations of each heat, and how many go on after it."""


def race(
    search: Search,
    starts: Sequence[tuple[Model, Array]],
    mask: Mask,
    heats: Heats,
    prior: float = 0.0,
    width: float = WIDEST,
    heats_on: Mask | None = None,
    same: int = 0,
    wanted: float = np.inf,
) -> list[Fit]:
    """Fits to the residual values of ``mask`` (n,) of the last that are left of the (model, start), the best first; each heat
    ends with those of the least energy, on fewer values (``heats_on``) where these tell enough. ``same``, and ``wanted``
    for the last of them, as in valley.py."""
    fits: list[Fit] = []
    for iterations, left in heats:
        if len(starts) > left:
            own = mask if heats_on is None else heats_on
            fits = follow_valley(search, starts, own, prior, iterations, (width,), same=same, values_only=True)
            same = 0
            best = np.argsort([f.energy for f in fits], kind="stable")[:left]
            starts = [(fits[k].model, fits[k].u) for k in best]
    fits = follow_valley(search, starts, mask, prior, ITERATIONS, widths=(width,), rivals=True, wanted=wanted)
    return sorted(fits, key=lambda f: f.energy)
