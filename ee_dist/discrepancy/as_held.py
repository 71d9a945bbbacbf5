"""Whether drives held their commands from row to row, where nobody said it.

Drives of a robot do; somebody's simulation may have taken each command in one step of it, half a row earlier. What a model leaves
tells the two apart where it is right but for little. A model that is far off tells nothing: one that lags leaves less of
commands that come too early, whatever was done with them.
"""

from __future__ import annotations

import math

import numpy as np

from ee_dist.discrepancy.problem import Problem
from ee_dist.trials.log import Array

TELLS = 1.5
"""Times the energy under one reading that a curve has under the other, to say anything of the two."""
NEARLY = 10.0
"""Times the energy of noise up to which the robot as it is described is nearly right."""


def times_the_noise(problem: Problem) -> Array | None:
    """(curves,) energy that the robot as it is described leaves of each curve (a channel in a trial) over that of noise, at least
    1; None where it cannot be simulated."""
    r = problem.residuals([()])[0]
    if not np.isfinite(r).all():
        return None
    curve = problem.trial_of * len(problem.channels) + problem.channel_of
    energy, noise = np.bincount(curve, weights=r**2), np.bincount(curve, weights=problem.floor)
    there = noise > 0
    return np.asarray(np.maximum(energy[there] / noise[there], 1.0))


def taken_in_steps(steps: Array | None, held: Array | None) -> bool:
    """Whether commands were taken in one step each, of what either reading leaves: curve by curve, each with one voice, for where
    much is wrong at a joint it says little of this; and only where that leaves next to nothing of those that tell."""
    if steps is None or held is None:
        return steps is not None
    if not np.log(steps).sum() < np.log(held).sum():
        return False
    telling = np.abs(np.log(steps / held)) > math.log(TELLS)
    return bool(telling.any()) and float(np.median(steps[telling])) <= NEARLY
