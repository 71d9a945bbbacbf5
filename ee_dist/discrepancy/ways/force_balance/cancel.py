"""Whether a motion lets a balance of forces tell anything: where gravity and inertia cancel, as in a free swing, the drives give
little of either, and what a description has a little wrong in one of them is much of what was measured."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ee_dist.discrepancy.ways.force_balance.motion import Motion
from ee_dist.discrepancy.ways.force_balance.weight import without_weight
from ee_dist.robots.model import Robot
from ee_dist.trials.log import Array

CANCELLED = 1 / 3
"""Share of gravity and inertia below which they cancel: a tenth off in one of them is then a sixth of what is left to give."""


def left_to_give(models: Sequence[Robot], motions: Sequence[Motion], size: Array) -> float:
    """What the motions needed in all (root mean square, judged drives by their measured torque ``size`` (J,)) as a share of what
    gravity and inertia needed, each for itself: 1 where they do not cancel, or there is nothing to cancel."""
    both = weight = inertia = 0.0
    for model, motion in zip(models, motions, strict=True):
        floating = without_weight(model)
        needed, without = (motion.of_judged(motion.needed(m)[1]) / size for m in (model, floating))
        both = both + np.sum(needed**2, axis=0)
        weight, inertia = weight + np.sum((needed - without) ** 2, axis=0), inertia + np.sum(without**2, axis=0)
    whole = float(np.sum((np.sqrt(weight) + np.sqrt(inertia)) ** 2))
    return float(np.sqrt(np.sum(both) / whole)) if whole else 1.0
