"""Positions that are read with noise: a balance of forces counts what differences make of it, and takes it for no effect."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from way_samples import measure, problem_by, samples

from ee_dist.discrepancy.explain import NOTHING_MISSING, explain
from ee_dist.discrepancy.problem import error
from ee_dist.discrepancy.search.pool import pool_of
from ee_dist.discrepancy.ways.force_balance.noise import NOISE, resting
from ee_dist.discrepancy.ways.force_balance.problem import ForceBalance
from ee_dist.effects.catalogue import Hypothesis, term
from ee_dist.measurements.errors import MeasurementError
from ee_dist.measurements.sampling import decimated
from ee_dist.trials.noise import with_noise


def pendulum(noise: float, hidden: Hypothesis = ()) -> ForceBalance:
    sample = samples()["pendulum"]
    sample = replace(sample, robot=with_noise(sample.robot, noise))
    found = problem_by("force_balance", measure(sample, hidden), sample.robot)
    assert isinstance(found, ForceBalance)
    return found


@pytest.mark.parametrize("noise", [2e-4, 1e-3])
def test_a_right_model_is_at_the_floor_whatever_the_noise(noise: float) -> None:
    problem = pendulum(noise)
    assert 0.6 < error(problem.residuals([()])[0]) < 1.4
    assert explain(problem, pool_of(problem)).verdict == NOTHING_MISSING


def test_nothing_is_gained_by_a_lighter_arm_that_lets_less_noise_through() -> None:
    problem = pendulum(1e-3)
    lighter, as_it_is, heavier = (
        error(problem.residuals([(term("part_mass", "arm", change=c),)])[0]) for c in (-0.1, 0.0, 0.1)
    )
    assert as_it_is < min(lighter, heavier)


def test_what_is_hidden_is_found_all_the_same() -> None:
    problem = pendulum(1e-3, samples()["pendulum"].hidden)
    found = explain(problem, pool_of(problem))
    assert found.best is not None
    assert samples()["pendulum"].hidden[0].name in [j.name for j in found.tied]


def test_more_smoothing_than_usual_is_told() -> None:
    assert pendulum(2e-4).notes == []
    sample = samples()["stage"]
    sample = replace(sample, robot=with_noise(sample.robot, 4e-4))
    (note,) = problem_by("force_balance", measure(sample, ()), sample.robot).notes
    assert "smoothed more than usual" in note


def test_positions_that_say_nothing_of_forces_are_refused_and_why() -> None:
    with pytest.raises(MeasurementError, match=r"too much for a balance of forces; compare by task.by=free_run"):
        pendulum(0.05)


def test_friction_at_rest_takes_no_noise_along() -> None:
    rng = np.random.default_rng(0)
    free = rng.standard_normal((20_000, 1))
    rest = np.ones(free.shape, dtype=bool)
    kept = resting(np.zeros_like(free), free, rest)
    assert np.mean(kept**2) > 0.98
    assert (resting(np.zeros_like(free), free, ~rest) == 0).all(), "what moves is held by nothing"
    # What cannot be noise is taken, but for one standard deviation; what friction cannot hold stays.
    assert resting(np.array([[0.0, 4.0]]), np.array([[-20.0, 20.0]]), np.ones((1, 2), bool)).tolist() == [[-1.0, 4.0]]
    assert np.abs(kept).max() <= NOISE + 1e-9


def test_samples_are_thinned_in_steps_where_one_filter_would_break() -> None:
    t = np.arange(40_000) * 1e-3
    slow = np.sin(2 * np.pi * 0.5 * t)
    noise = np.random.default_rng(1).standard_normal(len(t))
    kept = decimated(slow, 160)
    assert len(kept) == 250
    assert np.abs(kept - slow[159::160])[5:-5].max() < 0.03, "the ripple of three filters"
    assert 0.6 < np.std(decimated(noise, 160)) * np.sqrt(160) < 1.1
