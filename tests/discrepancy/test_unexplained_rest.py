"""An interval knows of what is left unexplained: what is missing may have gone into the value."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from linear_problem import ROBOT, Linear
from way_samples import measure, problem_by, samples

from ee_dist.discrepancy.accounts.of_improve import improve_account
from ee_dist.discrepancy.accounts.ranges import rest_text
from ee_dist.discrepancy.evidence.intervals import (
    ALL_OF_IT,
    WIDER,
    called,
    half_widths,
    half_widths_by_rest,
    parameters,
)
from ee_dist.discrepancy.evidence.left import leftovers
from ee_dist.discrepancy.improve import improve
from ee_dist.discrepancy.ladder import Improvement
from ee_dist.discrepancy.problem import Problem
from ee_dist.discrepancy.search.candidates import candidate
from ee_dist.discrepancy.search.fit import fit_one
from ee_dist.discrepancy.search.fitted import Fit, Model
from ee_dist.discrepancy.search.search import Search
from ee_dist.effects.catalogue import Hypothesis, term
from ee_dist.tasks.results.summaries import of_improvement
from ee_dist.trials.log import Array

JOINT = ROBOT.motor_names[0]
FRICTION, PART = term("coulomb_friction", "servo", torque_nm=0.06), "arm"
OTHERS: tuple[Hypothesis, ...] = (
    (term("viscous_friction", "servo", damping_nm_s_rad=0.02),),
    (term("command_gain", "servo", change=0.1),),
    (term("part_mass", PART, change=0.3),),
    (term("motor_weak", "servo", loss=0.3),),
    (term("viscous_friction", "servo", damping_nm_s_rad=0.01), term("command_delay", "servo", delay_s=0.01)),
    (term("part_mass", PART, change=0.2), term("command_gain", "servo", change=-0.05)),
)


@cache
def pendulum(others: Hypothesis) -> tuple[Problem, Improvement]:
    """A servo pendulum with Coulomb friction and something else, of which only the friction is in the model."""
    sample = samples()["pendulum"]
    problem = problem_by("open_loop", measure(sample, (FRICTION, *others)), sample.robot)
    return problem, improve(problem, (), wanted=[candidate(sample.robot, "coulomb_friction", "servo")])


def test_intervals_hold_the_truth_though_something_else_is_missing() -> None:
    held, by_data = 0, 0
    for others in OTHERS:
        problem, found = pendulum(others)
        (p,) = found.parameters
        held += p.low <= 0.06 <= p.high
        c = candidate(problem.robot, "coulomb_friction", "servo")
        fit = fit_one(Search(problem), Model((c,)), [c.shares({"torque_nm": p.value})])
        (alone,) = parameters(problem, fit)
        by_data += alone.low <= 0.06 <= alone.high
        assert found.left and p.doubt in (WIDER, ALL_OF_IT)
    assert by_data <= len(OTHERS) / 2, "these are no easy cases"
    assert held == len(OTHERS)


def test_an_interval_goes_no_farther_than_physics() -> None:
    problem, found = pendulum(OTHERS[0])
    c = candidate(problem.robot, "position_gain", "servo")
    for share in (0.02, 0.5):
        fit = fit_one(Search(problem), Model((c,)), [c.shares({"factor": share})])
        wide = replace(fit, slopes=fit.slopes * 0.02)
        (p,) = parameters(problem, wide, found.left)
        assert p.low >= c.effect.parameters[0].lower


def test_no_more_is_taken_off_a_description_than_it_has() -> None:
    """Friction is not negative, however wide an interval is."""
    problem, found = pendulum(OTHERS[0])
    c = candidate(problem.robot, "coulomb_friction", "servo")
    fit = fit_one(Search(problem), Model((c,)), [c.shares({"torque_nm": 0.02})])
    (p,) = parameters(problem, replace(fit, slopes=fit.slopes * 0.02), found.left)
    described = problem.robot.drives[0].coulomb
    assert p.low == pytest.approx(-described) and p.high > 2 * p.value


def test_a_clean_case_has_the_interval_of_its_noise() -> None:
    problem, found = pendulum(())
    (p,) = found.parameters
    assert not p.doubt and not found.left
    assert p.low < 0.06 < p.high < p.low + 0.004
    assert called(found.parameters) == "95 % intervals"
    said = " ".join(improve_account(problem, found).lines)
    assert WIDER not in said


def test_it_is_said_wherever_the_value_is() -> None:
    problem, found = pendulum(OTHERS[0])
    (p,) = found.parameters
    account = improve_account(problem, found)
    assert any(line.startswith(f"Intervals are {WIDER}") for line in account.lines)
    assert f"95 % intervals, {WIDER}: " in " ".join(account.words)
    assert of_improvement(problem, found, account, "")["parameters"][0]["doubt"] == p.doubt
    whole = replace(p, doubt=ALL_OF_IT)
    text = " ".join(rest_text(found.terms, [whole, whole]))
    assert text.endswith("It could be all of: coulomb friction at servo.")
    three = (*found.terms, term("coulomb_friction", "other", torque_nm=0.1))
    assert "all of: coulomb friction at 2 places." in " ".join(rest_text(three, [whole, replace(whole, term=1)]))
    assert not rest_text(found.terms, [replace(p, doubt="")])
    assert "could be all of" not in " ".join(rest_text(found.terms, [replace(whole, flag="told already")]))
    assert replace(p, flag="a flag", doubt=WIDER).note == f"a flag; {WIDER}"


def fitted(problem: Linear) -> Fit:
    model = Model((candidate(ROBOT, "coulomb_friction", JOINT),))
    return fit_one(Search(problem), model, [np.array([0.3])])


def spoiled(problem: Linear, curves: list[tuple[int, int]], size: float) -> Array:
    """(n,) a pattern across everything in some curves (trial, channel), of energy ``size`` squared in each."""
    rng, extra = np.random.default_rng(3), np.zeros(len(problem.trial_of))
    for trial, channel in curves:
        own = (problem.trial_of == trial) & (problem.channel_of == channel)
        pattern = rng.standard_normal(int(own.sum()))
        extra[own] = size * pattern / np.linalg.norm(pattern)
    return extra


@pytest.mark.parametrize(
    ("motions", "curves", "quantile"),
    [
        (20, [(0, 0)], 12.706),
        (20, [(0, 0), (1, 0), (2, 1)], 3.182),
        (4, [(0, 0)], 2.776),
        (4, [(0, 0), (1, 0), (2, 1)], 2.776),
        (4, [(k, c) for k in range(4) for c in range(2)], 2.306),
    ],
)
def test_each_curve_counts_as_one_piece_or_up_to_four_of_its_windows_do(
    motions: int, curves: list[tuple[int, int]], quantile: float
) -> None:
    problem = Linear((term("coulomb_friction", JOINT, torque_nm=0.3),), motions=motions)
    problem.data = problem.data + spoiled(problem, curves, 60.0)
    fit = fitted(problem)
    left = leftovers(problem, fit.residual)
    assert {(g.index, problem.channels.index(g.channel)) for g in left} == set(curves)
    slopes = fit.slopes[:, 0]
    parts = []
    for trial, channel in curves:
        own = (problem.trial_of == trial) & (problem.channel_of == channel)
        parts.append(float((slopes[own] ** 2).sum()) * 60.0**2)
    expected = quantile * np.sqrt(sum(parts)) / float(slopes @ slopes)
    assert half_widths_by_rest(problem, fit, left)[0] == pytest.approx(expected, rel=0.15)
    (p,) = parameters(problem, fit, left)
    (without,) = parameters(problem, fit)
    assert p.high - p.low > without.high - without.low and p.value == without.value


def test_what_is_left_where_an_effect_leaves_no_mark_does_not_widen_its_interval() -> None:
    class Apart(Linear):
        def shift(self, hypothesis: Hypothesis) -> Array:
            return np.where(self.channel_of == 0, super().shift(hypothesis), 0.0)

    problem = Apart((term("coulomb_friction", JOINT, torque_nm=0.3),), motions=4)
    problem.data = problem.data + spoiled(problem, [(k, 1) for k in range(4)], 60.0)
    fit = fitted(problem)
    left = leftovers(problem, fit.residual)
    assert left and half_widths_by_rest(problem, fit, left)[0] < 1e-9 < half_widths(problem, fit)[0]
    assert not parameters(problem, fit, left)[0].doubt
