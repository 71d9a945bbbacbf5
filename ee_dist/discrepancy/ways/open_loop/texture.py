"""How often channels repeat their last reading: what tells a sensor that drops out from one that is late."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ee_dist.discrepancy.ways.open_loop.prediction import Digest
from ee_dist.robots.model import Robot
from ee_dist.trials.log import Array

REPEATING = frozenset({"sensor_dropout", "sensor_quantisation"})
"""Effects that are told from others by how often a channel repeats a reading."""
ODD = 3.0
"""Standard deviations by which a channel repeats readings more often than the model's, to be odd."""
MOST, ENOUGH = 2 / 3, 3
"""Share of the channels of a kind that are odd, and channels that there must be, for it to be how these sensors are (coarse
steps, rows that were filled in) and not what is wrong with one."""


def frozen(measured: Digest, predicted: Digest, window: int) -> Array:
    """(windows, S): by how many standard deviations channels repeat readings more often than predicted."""
    p = 0.5 * (predicted.repeated + 1 / window)
    spread = np.sqrt(np.maximum(p * (1 - p), 1 / window) / window + 0.0004)
    return np.asarray((measured.repeated - predicted.repeated) / spread)


def repeating(robot: Robot, pairs: Iterable[tuple[Digest, Digest]], window: int) -> frozenset[str]:
    """Kinds of sensors most of which repeat readings as the model's do not, from (measured, predicted) of each trial."""
    squares = [
        np.mean(np.maximum(frozen(m, p, window), 0.0) ** 2, axis=0) for m, p in pairs if p.finite and len(p.repeated)
    ]
    if not squares:
        return frozenset()
    odd = np.mean(squares, axis=0) > ODD**2
    kinds = np.array([s.kind for s in robot.sensors])
    return frozenset(
        kind
        for kind in dict.fromkeys(kinds.tolist())
        if kind != "touch" and (kinds == kind).sum() >= ENOUGH and odd[kinds == kind].mean() >= MOST
    )
