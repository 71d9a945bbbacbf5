"""The noise floor of a balance of forces, and how much of it is noise beyond doubt.

What is left of forces once a filter has thinned them holds noise, and forces that change quickly along the way. Second
differences tell neither from the other, and are an upper bound. What they are of the readings themselves, row by row, is
noise: there a force has hardly changed. If it is white, a filter leaves a known part of it, and so much is noise beyond doubt.
Where the two differ by much, noise is slower than the readings (a current that was filtered), or a quick force is in it: what
every pass of a place shows again is taken off, and of the rest it is said that it may be either.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ee_dist.discrepancy.measured_trial import MeasuredTrial
from ee_dist.discrepancy.slow_noise import MEDIAN_OF_SQUARES
from ee_dist.discrepancy.ways.force_balance.balance import Balance
from ee_dist.discrepancy.ways.force_balance.motion import motor_torques
from ee_dist.discrepancy.ways.force_balance.noise import Prepared, roughness_of_noise, share_of_noise
from ee_dist.discrepancy.ways.force_balance.places import Way, share_of_no_place
from ee_dist.discrepancy.ways.open_loop.prediction import roughness
from ee_dist.measurements.sampling import decimated
from ee_dist.robots.model import Robot
from ee_dist.trials.grid import reading_step
from ee_dist.trials.log import Array

ALIKE = 2.0
"""Times what white noise of the readings leaves, up to which all of a floor is noise: readings that were brought to an even grid
by straight lines show two thirds of theirs."""


@dataclass(frozen=True, eq=False)
class Floor:
    """(J,) variances at the judged drives, as shares of the mean square of the measured force: noise is no more than ``most``,
    and no less than ``sure``; the same where the two are alike."""

    most: Array
    sure: Array


def floor_of(
    trials: Sequence[MeasuredTrial], models: Sequence[Robot], ready: Prepared, balances: Sequence[Balance]
) -> Floor:
    """What a model accounts for is no noise: the least of what the models as they are leave over, and of what the measured force
    shows and noise of the positions adds to it."""
    every, size = ready.processing.keep_every, ready.size
    step_s = float(np.median(np.diff(trials[0].log.times_s)))
    low_pass = ready.processing.filter_for(step_s)
    passed = low_pass.cutoff_hz * step_s
    added = ready.noise.first / size**2
    candidates = [([decimated(m.of_judged(m.torque), every) / size for m in ready.motions], np.zeros_like(size))]
    both = [balance(model) for model, balance in zip(models, balances, strict=True)]
    left = [b[1] / size for b in both if b is not None]
    if len(left) == len(both):
        # The noise of positions, differentiated twice, is rougher than white noise is: it is in this one, and known.
        candidates.append((left, ready.noise.first_roughness / size**2))
    white = roughness_of_noise(every, passed)
    found = np.array([np.maximum(_variance(series) - less, 0.0) / white + added for series, less in candidates])
    most, chosen = found.min(axis=0), found.argmin(axis=0)
    sure = added + _white(trials, models, ready, passed)
    for k in np.flatnonzero(most > ALIKE**2 * sure):
        series = candidates[chosen[k]][0]
        of = [(m.judged[k], m) for m in ready.motions]
        ways = [Way(m.position[:, j], m.speed[:, j], s[:, k]) for (j, m), s in zip(of, series, strict=True)]
        most[k] = (most[k] - added[k]) * share_of_no_place(ways, every, step_s, low_pass) + added[k]
    return Floor(most, np.where(most > ALIKE**2 * sure, sure, most))


def _white(trials: Sequence[MeasuredTrial], models: Sequence[Robot], ready: Prepared, passed: float) -> Array:
    """(J,) what thinning leaves of the noise from one reading to the next, and of the steps in which readings come."""
    cut = ready.processing.settled
    read = [motor_torques(t.log, model) for t, model in zip(trials, models, strict=True)]
    rows = [cut(m.of_judged(r)) for m, r in zip(ready.motions, read, strict=True) if r is not None]
    steps = np.mean([[reading_step(column) ** 2 / 12 for column in r.T] for r in rows], axis=0)
    noise = np.maximum(_variance(rows), steps)
    return np.asarray(noise * share_of_noise(ready.processing.keep_every, passed) / ready.size**2)


def _variance(series: Sequence[Array]) -> Array:
    """(J,) of white noise on something smooth, over trials of (T, J)."""
    return np.mean([np.median(roughness(s), axis=0) for s in series], axis=0) / MEDIAN_OF_SQUARES
