"""A map of gaits, then trial and error on the body: Intelligent Trial and Error of Cully et al. (Nature 521, 2015).

The map is made before anything breaks (``gait_map``). On the changed body a Gaussian process says how far each gait of
the map would go: its mean is the map's until trials say otherwise, and what one trial says is believed of gaits near it. The
gait with the largest mean + KAPPA deviations is tried next (M-BOA). Their kernel and numbers: Matern 5/2 with rho 0.4, noise
0.001, kappa 0.05, in units of the intact robot's distance here. No simulation after the change.

Unlike theirs: it goes on for as many trials as are allowed instead of stopping at 90 % of what the map promises; no gait is
tried twice, as the body answers alike; and the trial that showed the change is an observation too.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ee_dist.effects.catalogue import Hypothesis
from ee_dist.engines.contract import Rollout
from ee_dist.evaluation.jobs import Job
from ee_dist.recovery.repair import network
from ee_dist.rivals.gait_map import Footfall, feet_of, gait_map
from ee_dist.rivals.setting import Setting, intact_controller

Array = NDArray[np.float64]

RHO = 0.4
"""Length of the kernel, in shares of time."""
NOISE = 0.001
"""Variance of what is measured."""
KAPPA = 0.05
FALLEN = -1.0
"""What a trial without a distance is taken for, as a share of the intact robot's."""


def matern(a: Array, b: Array, rho: float = RHO) -> Array:
    """(n, m) Matern 5/2 of places (n, d) and (m, d)."""
    scaled = math.sqrt(5.0) * np.linalg.norm(a[:, None, :] - b[None, :, :], axis=2) / rho
    return np.asarray((1.0 + scaled + scaled**2 / 3.0) * np.exp(-scaled), dtype=np.float64)


class Expectation:
    """A Gaussian process over places (n, d) whose mean is ``prior`` (n,) until something was measured."""

    def __init__(self, places: Array, prior: Array) -> None:
        self.places, self.prior = places, prior
        self._at = np.zeros((0, places.shape[1]))
        self._above = np.zeros(0)

    def measured(self, place: Array, prior: float, value: float) -> None:
        """``value`` was measured at ``place``, where ``prior`` had been expected."""
        self._at = np.vstack([self._at, place])
        self._above = np.append(self._above, value - prior)

    def read(self) -> tuple[Array, Array]:
        """Mean and deviation at all places."""
        if not len(self._at):
            return self.prior.copy(), np.ones(len(self.places))
        near = matern(self.places, self._at)
        known = matern(self._at, self._at) + NOISE * np.eye(len(self._at))
        mean = self.prior + near @ np.linalg.solve(known, self._above)
        variance = 1.0 - np.einsum("ij,ji->i", near, np.linalg.solve(known, near.T))
        return mean, np.sqrt(np.maximum(variance, 0.0))

    def choice(self, tried: set[int], kappa: float = KAPPA) -> int | None:
        """The place to try next, none of those tried; None where all were. Of equals the first."""
        mean, deviation = self.read()
        upper = mean + kappa * deviation
        upper[sorted(tried)] = -np.inf
        return None if len(tried) == len(upper) else int(np.argmax(upper))


def trial_and_error(setting: Setting) -> Sequence[Hypothesis]:
    robot, plan, evaluator = setting.robot, setting.plan, setting.evaluator
    first = intact_controller(setting)
    asked = (plan.compensating_trials + 1) * (
        plan.repair.population + plan.repair.generations * (plan.repair.population // 2)
    )
    found = gait_map(
        robot, first, evaluator, plan.steps, setting.allowance.map_evaluations or asked, setting.streams()[-1]
    )
    (own,) = evaluator.evaluate([Job(Rollout(robot, first, plan.steps), Footfall(feet_of(robot)))])
    unit = max(setting.value(setting.intact, first), 1e-3)
    expectation = Expectation(found.feet, found.expected / unit)

    def share(distance: float) -> float:
        return distance / unit if math.isfinite(distance) else FALLEN

    expectation.measured(own[1:], share(own[0]), share(setting.value(setting.changed, first)))
    tried: set[int] = set()
    for _ in range(setting.allowance.map_trials):
        chosen = expectation.choice(tried)
        if chosen is None:
            break
        tried.add(chosen)
        went = setting.value(setting.changed, network(found.genomes[chosen]))
        expectation.measured(found.feet[chosen], expectation.prior[chosen], share(went))
    return []
