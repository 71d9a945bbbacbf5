"""A value is as sure as what it stands beside: what a description only guessed, and a model leaves so, counts as unknown."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from way_samples import measure, problem_by, samples

from ee_dist.discrepancy.evidence.intervals import BESIDE_GUESSES, ParameterReport, parameters
from ee_dist.discrepancy.lags import with_lags
from ee_dist.discrepancy.left_as_guessed import beside_guesses, left_as_guessed
from ee_dist.discrepancy.search.candidates import candidate
from ee_dist.discrepancy.search.fit import fit_one
from ee_dist.discrepancy.search.fitted import Fit, Model
from ee_dist.discrepancy.search.search import Search
from ee_dist.robots.model import Robot

LATE_S, SOFTER = 0.15, 1.5
"""How late the joints follow, nearly all by their damping; by how much both gains were guessed too low."""


def a_robot_that_follows_as_a_filter_does(guessed: tuple[str, ...]) -> tuple[Search, Robot]:
    sample = samples()["arm"]
    true = tuple(replace(d, kp=8 * d.kp, kd=8 * LATE_S * d.kp, torque_limit=1e3) for d in sample.robot.drives)
    trials = measure(replace(sample, robot=replace(sample.robot, drives=true)), ())
    guess = tuple(replace(d, kp=d.kp / SOFTER, kd=d.kd / SOFTER / 1.5) for d in true)
    assumed = tuple((d.joint, f) for d in guess for f in guessed)
    robot = with_lags(replace(sample.robot, drives=guess, assumed=assumed), trials)
    return Search(problem_by("open_loop", trials, robot)), robot


def reported(search: Search, names: tuple[str, ...]) -> tuple[Fit, list[ParameterReport]]:
    model = Model(tuple(candidate(search.problem.robot, n, "all_joints") for n in names))
    fit = fit_one(search, model, [np.zeros(len(model.lower))])
    return fit, parameters(search.problem, fit, guesses=beside_guesses(search, fit))


def test_a_gain_beside_guessed_damping_is_told_by_their_ratio_alone() -> None:
    search, _ = a_robot_that_follows_as_a_filter_does(("kp", "kd"))
    fit, (gain,) = reported(search, ("position_gain",))
    assert [c.name for c in left_as_guessed(search, fit)] == ["speed_gain@all_joints"]
    assert gain.value < 0.8 * SOFTER, "the guessed damping pulls it down"
    assert gain.flag == BESIDE_GUESSES
    assert gain.low < SOFTER < 1.03 * gain.high, "as far as slopes tell"
    known = parameters(search.problem, fit)[0]
    assert known.flag == "" and known.high < SOFTER, "what is told without a word about the guess"


def test_what_the_model_has_or_the_description_knows_is_no_guess_beside_it() -> None:
    search, _ = a_robot_that_follows_as_a_filter_does(("kp", "kd"))
    fit, found = reported(search, ("position_gain", "speed_gain"))
    assert not left_as_guessed(search, fit) and not beside_guesses(search, fit).any()
    assert found[0].value == pytest.approx(SOFTER, rel=0.3)
    search, _ = a_robot_that_follows_as_a_filter_does(("kp",))
    fit, (gain,) = reported(search, ("position_gain",))
    assert not left_as_guessed(search, fit) and gain.flag == ""
