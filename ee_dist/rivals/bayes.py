"""Bayesian inference over faults that were specified beforehand, after Baydar and Saitou (2001).

Their method keeps a list of expected faults with a probability each, and updates it by what the sensors say. Here the list
holds no fault, every single one of the paper's six situations at stated sizes and places, and every pair of these, all
equally probable at first. What a fault predicts is simulated once for each trial. The likelihood is of the
same numbers as the loop's metric: means of each sensor over windows of the header. Each deviates by a Laplace distribution of
scale ``NOISE``, windows that do not overlap are independent. So the logarithm of a likelihood is the loop's error,
negative and in units of the noise, times the number of windows and sensors; the noise decides how sure one is, and
not which fault is the most probable. Repair passes are the loop's, on the most probable fault.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from ee_dist.effects.catalogue import Hypothesis, Term, term
from ee_dist.effects.targets import carried_parts, floor, motors, parts, sensors, stopped_joints
from ee_dist.engines.drivers import Network
from ee_dist.recovery.diagnosis import Judge
from ee_dist.recovery.kinds import subject_of
from ee_dist.rivals.loop import loop
from ee_dist.rivals.setting import Setting
from ee_dist.robots.model import Robot
from ee_dist.trials.log import SensorLog

SIZES = (0.25, 0.5, 0.75, 1.0)
"""Losses of motors, sensors and ranges of joints. The faults of the paper's Table 1, all of 50 %, are on the list."""
SIZES_BESIDE = (0.2, 0.4, 0.6, 0.8)
"""A list made by somebody who did not know these: the nearest is 10 % of the full range off."""
HEAVIER, HEAVIER_BESIDE = (1.0, 1.5, 2.0), (1.25, 1.75)
TILTS_DEG, TILTS_BESIDE_DEG = (10.0, 20.0, 30.0), (12.5, 25.0)
NOISE = 0.05
"""Scale of what a sensor's mean deviates by; sensors say from -1 (0 of touch) to 1."""


def faults(robot: Robot, beside: bool = False, pairs: bool = True) -> list[Hypothesis]:
    """The list: nothing first, then single faults, then pairs. ``beside``: of sizes that the paper's faults do not have."""
    sizes, heavier, tilts = (SIZES_BESIDE, HEAVIER_BESIDE, TILTS_BESIDE_DEG) if beside else (SIZES, HEAVIER, TILTS_DEG)
    single: list[Term] = [term("part_lost", p) for p in carried_parts(robot)]
    single += [term("part_mass", p, change=c) for p in parts(robot) for c in heavier]
    for name, places in (("motor_weak", motors), ("sensor_failing", sensors), ("joint_jam", stopped_joints)):
        single += [term(name, p, loss=s) for p in places(robot) for s in sizes]
    single += [term("floor_tilt", p, sideways_deg=s * t) for p in floor(robot) for t in tilts for s in (1.0, -1.0)]
    normal = subject_of(robot).normal
    said = [(), *((t,) for t in single), *(combinations(single, 2) if pairs else ())]
    return list(dict.fromkeys(normal(list(terms), robot) for terms in said))


class Posterior:
    """Probabilities of hypotheses, equal at first."""

    def __init__(self, count: int) -> None:
        self._logs = np.zeros(count)

    def update(self, errors: NDArray[np.float64], windows: int, noise: float = NOISE) -> None:
        """By one trial: mean deviation of each hypothesis over ``windows`` independent means."""
        self._logs -= windows * errors / noise

    @property
    def best(self) -> int:
        """The most probable; of equals the first, which says least."""
        return int(np.argmax(self._logs))

    @property
    def probabilities(self) -> NDArray[np.float64]:
        weights = np.exp(self._logs - self._logs.max())
        return np.asarray(weights / weights.sum(), dtype=np.float64)


class Inference:
    """The loop's diagnosis by Bayes' rule: after each trial the posterior over all trials so far."""

    def __init__(self, setting: Setting, listed: Sequence[Hypothesis]) -> None:
        self.setting, self.listed = setting, listed
        self.posterior = Posterior(len(listed))
        metric = setting.metric
        self.windows = len(setting.robot.sensors) * (metric.header // metric.window)

    def __call__(
        self, trials: Sequence[tuple[Network, SensorLog]], k: int, stream: np.random.SeedSequence
    ) -> tuple[Hypothesis, float]:
        judge = Judge(self.setting.robot, trials[-1:], self.setting.metric, self.setting.evaluator)
        errors = judge.errors(self.listed)
        self.posterior.update(errors, self.windows)
        best = self.posterior.best
        return self.listed[best], float(errors[best])


def bayes(setting: Setting, beside: bool = False) -> Sequence[Hypothesis]:
    listed = faults(setting.robot, beside, setting.allowance.pairs)
    return loop(setting, Inference(setting, listed))


def bayes_beside(setting: Setting) -> Sequence[Hypothesis]:
    """The same where no size on the list is right."""
    return bayes(setting, beside=True)
