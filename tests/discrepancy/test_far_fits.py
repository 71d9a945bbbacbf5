"""Precise sensors: a residual that is far above the noise, and softened, is fitted out all the same, where the zeros of its
swings would hold a weighed step back."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from linear_problem import PER, ROBOT, SEGMENTS, Linear

from ee_dist.discrepancy.search.candidates import candidate
from ee_dist.discrepancy.search.fitted import Model
from ee_dist.discrepancy.search.search import Search
from ee_dist.discrepancy.search.slopes import follow_slopes
from ee_dist.discrepancy.search.valley import follow_valley
from ee_dist.effects.catalogue import Hypothesis
from ee_dist.trials.log import Array

SOFT, SIZE = 6.0, 4000.0
TRUTH = 0.4
PART = candidate(ROBOT, "viscous_friction", ROBOT.motor_names[0])


class Swings(Linear):
    """A swing whose pace is off by a share of a value, thousands of times as large as the noise; softened as in open loop."""

    def swing(self, u: float) -> Array:
        time = np.arange(SEGMENTS * PER) * 0.01
        return np.asarray(SIZE * np.sin(6.0 * time * (1.0 + 0.3 * u)))

    def __init__(self) -> None:
        super().__init__(())
        self.noise = np.random.default_rng(3).standard_normal(SEGMENTS * PER)

    def residuals(self, hypotheses: Sequence[Hypothesis], trials: Sequence[int] | None = None) -> Array:
        values = [float(PART.shares(dict(h[0].values))[0]) if h else 0.0 for h in hypotheses]
        rows = [self.noise + self.swing(TRUTH) - self.swing(u) for u in values]
        return SOFT * np.arcsinh(np.array(rows) / SOFT)

    def smooth(self, residual: Array) -> Array:
        return np.asarray(SOFT * np.sinh(residual / SOFT))


@pytest.mark.parametrize("off", [0.02, -0.02, 0.1])
@pytest.mark.parametrize("fit", [follow_slopes, follow_valley])
def test_what_is_far_above_the_noise_is_fitted_to_the_noise(fit: object, off: float) -> None:
    search = Search(Swings())
    (found,) = fit(search, [(Model((PART,)), np.array([TRUTH + off]))], search.everything)  # type: ignore[operator]
    assert found.energy < 1.2 * len(found.residual)
    assert found.u[0] == pytest.approx(TRUTH, abs=1e-5)
