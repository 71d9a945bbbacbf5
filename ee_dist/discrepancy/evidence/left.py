"""Whether anything is left in a residual beyond noise, and where it sits: the test behind every verdict."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy  # which loads its parts when they are used; scipy.stats, which calls these functions, takes a second

from ee_dist.discrepancy.problem import Problem
from ee_dist.trials.log import Array

LIMIT = 5.0
"""Standard deviations beyond which a group of values (of some hundred) is not noise: one false alarm in 10^4 runs."""
VARIES = 1.0
"""By how much of itself what calibration left may vary from one robot to the next, as one standard deviation."""
SETTLED = 1.3
"""Error over the noise floor up to which no more than noise is left where no curve stands out."""
MANY = 1000
"""Standard deviations beyond which a number says no more."""


@dataclass(frozen=True)
class Leftover:
    """A place where more is left than noise. ``z``: by how many standard deviations; ``excess``: energy above noise;
    ``trend``: whether it drifts slowly (True) or scatters (False). ``index`` of the trial: repeats have one name, and are told
    with their ``number`` in the log where ``repeated``."""

    trial: str
    channel: str
    z: float
    excess: float
    trend: bool
    index: int = 0
    repeated: bool = False
    number: int = 0

    def __str__(self) -> str:
        shape = "slow" if self.trend else "quick"
        trial = f"{self.number or self.index + 1}. {self.trial}" if self.repeated else self.trial
        far = f"{self.z:.0f}" if self.z < MANY else f"more than {MANY}"
        return f"{self.channel} during {trial} ({shape}, {far} standard deviations above noise)"


def leftovers(problem: Problem, residual: Array, limit: float = LIMIT) -> list[Leftover]:
    """Groups (trial and channel) whose residual is not noise, the worst first.

    Two tests a group: its energy against the floor (chi squared), and the energy of its segment means, which finds what
    is small but does not change sign.
    """
    segments, channels = len(problem.segments), len(problem.channels)
    cell = problem.segment_of * channels + problem.channel_of
    size = segments * channels
    shape = (segments, channels)
    n = np.bincount(cell, minlength=size).reshape(shape).astype(float)
    e = np.bincount(cell, weights=residual**2, minlength=size).reshape(shape)
    f = np.bincount(cell, weights=problem.floor, minlength=size).reshape(shape)
    s = np.bincount(cell, weights=residual, minlength=size).reshape(shape)
    b = np.bincount(cell, weights=problem.layout.known, minlength=size).reshape(shape)
    granted = problem.events
    found = []
    for k, trial in enumerate(problem.trials):
        mine = problem.trial_of_segment == k
        count, energy, floor = n[mine].sum(0), e[mine].sum(0), f[mine].sum(0)
        slow = np.divide(s[mine] ** 2, n[mine], out=np.zeros_like(s[mine]), where=n[mine] > 0)
        bias = b[mine].sum(0)
        mean_floor = np.divide(f[mine] - b[mine], n[mine], out=np.zeros_like(s[mine]), where=n[mine] > 0)
        for c in np.flatnonzero(count):
            # Granted where the scale of a channel is wider than its noise.
            events = float(granted[k, c]) if floor[c] < 0.3 * count[c] else 0.0
            varies = VARIES * bias[c]
            if problem.layout.by_segment:
                varies = math.sqrt(2.0 * float((b[mine][:, c] ** 2).sum()))
            quick_z = (energy[c] - floor[c]) / (math.sqrt(2.0 * max(floor[c], 1.0)) + events + varies)
            windows = float((n[mine][:, c] > 0).sum())
            sd = math.sqrt(2.0) * math.sqrt(max(float((mean_floor[:, c] ** 2).sum()), 1.0)) + events
            sd += varies
            slow_z = (slow[:, c].sum() - mean_floor[:, c].sum() - bias[c]) / sd if windows else 0.0
            if max(quick_z, slow_z) <= limit:
                continue
            # A sum of few squares is far from normal: two windows exceed six of its standard deviations once in 500 times.
            quick_z = min(quick_z, _rarity(energy[c], floor[c] / count[c], count[c]))
            slow_z = min(slow_z, _rarity(slow[:, c].sum(), mean_floor[:, c].sum() / max(windows, 1.0), windows))
            z = max(quick_z, slow_z)
            if z > limit:
                excess, trend = float(energy[c] - floor[c]), bool(slow_z >= quick_z)
                repeated = problem.trials.count(trial) > 1
                found.append(
                    Leftover(trial, problem.channels[c], float(z), excess, trend, k, repeated, problem.numbers[k])
                )
    return sorted(found, key=lambda g: -g.z)


def may_be_noise(problem: Problem, residual: Array) -> list[str]:
    """Channels in which more is left than is noise beyond doubt, and no more than may be: the floor is only an upper bound there.
    Those in which it is furthest off come first."""
    count = len(problem.channels)
    energy, floor, sure = (
        np.bincount(problem.channel_of, weights=w, minlength=count) for w in (residual**2, problem.floor, problem.sure)
    )
    unsure = np.flatnonzero((sure < floor) & (energy > SETTLED**2 * sure))
    return [problem.channels[c] for c in sorted(unsure, key=lambda c: float(sure[c] / floor[c]))]


def _rarity(total: float, each: float, count: float) -> float:
    """How rare a sum of ``count`` squares of noise of mean ``each`` is: the normal deviate that is as rare."""
    if each <= 0 or count < 1:
        return math.inf
    return -float(scipy.special.ndtri(scipy.special.chdtrc(count, total / each)))


def settled(left: Sequence[Leftover], error: float, floor: float) -> bool:
    """Whether no more than noise is left: no curve stands out, nor all of them together."""
    return not left and error <= SETTLED * floor
