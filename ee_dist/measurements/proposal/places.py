"""Columns whose names say nothing, shared out into blocks by what they have to do with one another."""

from __future__ import annotations

import numpy as np

from ee_dist.measurements.signals import derivative, relation
from ee_dist.trials.log import Array

MIXED = 6
"""Columns a joint up to which two orders one behind the other are looked at,"""
CLEARLY = 0.3
"""and by how much of a correlation they must hang together better than one order does."""
ROWS_APART = 0.01
"""Seconds between rows, where a mean over some rows is wanted and nobody has looked at the time yet."""
NEARLY = 12
"""Power of a correlation: 0.99 counts 0.89, and 0.9 counts 0.28."""
ALIKE = 0.5
"""Share of one another that the ratios of speed and change of position have at all joints, or it is chance."""


def hanging_together(mute: list[str], size: int, series: dict[str, Array]) -> list[list[str]]:
    """The columns in blocks of ``size``, in the order in which they have most to do with one another."""
    count = len(mute) // size
    runs = [mute[k * size : (k + 1) * size] for k in range(count)]
    if count == 1:
        return runs
    plain = [runs, [mute[k::count] for k in range(count)]]
    best = max(plain, key=lambda split: _ties(split, series))
    if count > MIXED:
        return best
    # Such as position and speed of each joint in turn, and behind them what each motor gave.
    mixed = [[*(mute[k : size * first : first] for k in range(first)), *runs[first:]] for first in range(2, count)] + [
        [*runs[:last], *(mute[size * last + k :: count - last] for k in range(count - last))]
        for last in range(1, count - 1)
    ]
    other = max(mixed, key=lambda split: _ties(split, series), default=best)
    return other if _ties(other, series) > _ties(best, series) + CLEARLY else best


def _ties(split: list[list[str]], series: dict[str, Array]) -> float:
    """How well each column of a block hangs together with the column at its place in another block."""
    total = 0.0
    for k, one in enumerate(split):
        for other in split[k + 1 :]:
            a, b = (np.stack([series[c] for c in part], axis=1) for part in (one, other))
            # Joints move alike by chance: only what is nearly the same, or nearly its change, counts.
            total += max(abs(relation(a, b).correlation), _change(a, b), _change(b, a)) ** NEARLY
    return total


def _change(a: Array, b: Array) -> float:
    """How far ``b`` (T, J) is the change of ``a`` (T, J), by one number for all joints that move."""
    found = [derivative(a[:, [k]], b[:, [k]], ROWS_APART) for k in range(a.shape[1])]
    slopes = [r.slope for r in found if r.slope]
    if not slopes or min(slopes) * max(slopes) <= 0 or min(map(abs, slopes)) < ALIKE * max(map(abs, slopes)):
        return 0.0
    return min(abs(r.correlation) for r in found if r.slope)
