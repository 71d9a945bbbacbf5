"""Curves thinned for drawing: what is drawn of a stretch keeps its peaks; a stretch short enough is drawn row by row."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ee_dist.trials.log import Array
from ee_dist.viewing.curves import Overlay, rows_of, thinned

POINTS = 1600
"""Rows of a curve that are drawn at once: about one for each pixel of a wide screen."""


@dataclass(frozen=True, eq=False)
class Drawn:
    """``exact``: every row of the stretch is there."""

    curve: Overlay
    exact: bool


def stretch(curve: Overlay, begin_s: float | None = None, end_s: float | None = None, points: int = POINTS) -> Drawn:
    """The rows from ``begin_s`` to ``end_s`` (all, where None) and one beyond each end, at most about ``points`` of them."""
    rows: Array | slice = slice(None)
    if begin_s is not None and end_s is not None:
        first = max(int(np.searchsorted(curve.times_s, begin_s)) - 1, 0)
        last = min(int(np.searchsorted(curve.times_s, end_s, side="right")) + 1, len(curve.times_s))
        rows = slice(first, max(last, first + 2))
    part = rows_of(curve, rows)
    return Drawn(thinned(part, points), len(part.times_s) <= points)
