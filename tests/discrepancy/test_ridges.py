"""A valley that slopes lead down, and a deeper one behind a ridge."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from linear_problem import PER, ROBOT, SEGMENTS, Linear

from ee_dist.discrepancy.search.candidates import candidate
from ee_dist.discrepancy.search.fitted import Fit, Model
from ee_dist.discrepancy.search.ridges import over_ridges
from ee_dist.discrepancy.search.search import Search
from ee_dist.discrepancy.search.valley import follow_valley
from ee_dist.effects.catalogue import Hypothesis
from ee_dist.trials.log import Array

PARTS = tuple(candidate(ROBOT, name, ROBOT.motor_names[0]) for name in ("viscous_friction", "coulomb_friction"))
TRUTH = np.array([0.4, 0.3])
SIZE = 5.0


class Paces(Linear):
    """A swing whose pace one value sets, so that a swing more or less is a valley of its own, and whose size the other sets."""

    def __init__(self) -> None:
        super().__init__(())
        self.noise = np.random.default_rng(3).standard_normal(SEGMENTS * PER)

    def swing(self, u: Array) -> Array:
        time = np.arange(SEGMENTS * PER) * 0.01
        return np.asarray(SIZE * (0.5 + u[1]) * np.sin(12.0 * time * (1.0 + 0.3 * u[0])))

    def residuals(self, hypotheses: Sequence[Hypothesis], trials: Sequence[int] | None = None) -> Array:
        rows = []
        for h in hypotheses:
            u = [c.shares(dict(t.values))[0] for c, t in zip(PARTS, h, strict=False)] + [0.0] * (2 - len(h))
            rows.append(self.noise + self.swing(TRUTH) - self.swing(np.array(u)))
        return np.array(rows)


def descend(problem: Paces, start: float) -> Fit:
    search = Search(problem)
    return follow_valley(search, [(Model(PARTS), np.array([start, 0.3]))], search.everything, widths=(0.01,))[0]


@pytest.mark.parametrize("start", [0.12, 0.68])
def test_the_deeper_valley_is_found_from_the_other(start: float) -> None:
    problem = Paces()
    caught = descend(problem, start)
    assert caught.energy > 3.0 * len(problem.noise)
    found = over_ridges(Search(problem), caught)
    assert found.u == pytest.approx(TRUTH, abs=0.02)
    assert found.energy < 1.1 * len(problem.noise)


def test_what_is_at_the_noise_stays_as_it_is() -> None:
    problem = Paces()
    fit = descend(problem, 0.41)
    assert over_ridges(Search(problem), fit) is fit


def test_only_the_values_that_were_fitted_count() -> None:
    """What is held out has no say in which valley it is."""
    problem = Paces()
    search = Search(problem)
    mask = np.arange(len(problem.noise)) < 0.8 * len(problem.noise)
    (caught,) = follow_valley(search, [(Model(PARTS), np.array([0.12, 0.3]))], mask, widths=(0.01,))
    problem.noise[~mask] = 100.0
    again = over_ridges(search, caught)
    problem.noise[~mask] = -50.0
    other = over_ridges(search, caught)
    assert np.array_equal(again.u, other.u)
    assert again.energy < 0.5 * caught.energy
    assert again.mask is caught.mask
