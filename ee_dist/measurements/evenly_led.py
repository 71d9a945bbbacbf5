"""Whether a joint is led evenly from row to row, as by drives that go on between the points they are told.

A stiff drive that holds each point goes there at once and rests: its speed, when the next row is read, is a fraction of what its
way over the rows says. One that is led evenly reads the speed of that way.
"""

from __future__ import annotations

import numpy as np

from ee_dist.measurements.signals import moves, relation
from ee_dist.trials.log import Array

SOON = 1.25
"""Rows by which joints may follow so: what is slower than that does not feel how a command comes."""
EVEN = 0.3
"""Of the change of a command from row to row, the root mean square by which that may differ from the one before."""
TOGETHER, SAME = 0.98, 0.15
"""Correlation of speeds that were read with those of the way over the rows, and by how much their ratio may differ from one."""


def evenly_led(asked: Array, seen: Array, speeds: Array, step_s: float, row_s: float) -> bool:
    """Of commands ``asked`` of a joint by lines between rows ``row_s`` apart, positions ``seen`` and ``speeds`` that were read
    (T,), every ``step_s``: whether commands change evenly, and it moves as evenly between the rows."""
    every = max(1, round(row_s / step_s))
    if len(asked) < 4 * every or not (moves(asked) and moves(seen) and moves(speeds)):
        return False
    changes = np.diff(asked[::every])
    if not _size(np.diff(changes)) <= EVEN * _size(changes):
        return False
    way = (seen[2 * every :] - seen[: -2 * every]) / (2 * every * step_s)
    found = relation(speeds[every:-every, None], way[:, None])
    return bool(found.correlation >= TOGETHER and abs(found.slope - 1.0) <= SAME)


def _size(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))
