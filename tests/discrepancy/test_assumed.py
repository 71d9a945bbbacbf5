"""Gains that a description only assumed are the first suspect, all of them together, and farther off than gains that somebody
knew may be."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from way_samples import Sample, measure, problem_by, samples

from ee_dist.discrepancy.accounts.of_compare import compare_account
from ee_dist.discrepancy.accounts.of_explain import explain_account
from ee_dist.discrepancy.assumed import GUESSED, LABEL, assumed_drives, puts_right
from ee_dist.discrepancy.compare import compare
from ee_dist.discrepancy.everywhere import instead, taken_apart
from ee_dist.discrepancy.examine import Current, examine
from ee_dist.discrepancy.explain import explain
from ee_dist.discrepancy.problem import Problem, error
from ee_dist.discrepancy.search.candidates import candidate, candidates
from ee_dist.discrepancy.search.fitted import Model
from ee_dist.discrepancy.search.search import Search
from ee_dist.effects.catalogue import apply, term
from ee_dist.robots.model import Robot

STIFFER, DRIER = 6.0, (0.3, 0.2)


def guessed(robot: Robot, fields: tuple[str, ...] = ("kp", "kd", "rotor_inertia")) -> Robot:
    """Described with controllers several times as stiff, because nobody knew them."""
    drives = tuple(replace(d, kp=STIFFER * d.kp, kd=3.0 * d.kd) for d in robot.drives)
    return replace(robot, drives=drives, assumed=tuple((d.joint, f) for d in drives for f in fields))


@cache
def the_problem(limit: float = 0.0) -> Problem:
    """``limit``: share of the stated torque limit that the robot has not."""
    sample: Sample = samples()["arm"]
    hidden = (term("torque_limit", "all_joints", loss=limit),) if limit else ()
    hidden += tuple(
        term("coulomb_friction", j, torque_nm=c) for j, c in zip(sample.robot.motor_names, DRIER, strict=True)
    )
    return problem_by("open_loop", measure(sample, hidden), guessed(sample.robot))


def test_gains_that_were_assumed_are_found_together_with_friction() -> None:
    problem = the_problem()
    proposal, u = assumed_drives(Search(problem), candidates(problem.robot)) or pytest.fail("nothing was proposed")
    terms = Model(proposal.parts).hypothesis(u)
    found = {t.effect: dict(t.values) for t in terms}
    assert {t.target for t in terms} == {"all_joints"}
    assert found["position_gain"]["factor"] == pytest.approx(1 / STIFFER, rel=0.15)
    assert found["coulomb_friction"]["torque_nm"] == pytest.approx(np.mean(DRIER), rel=0.5)
    as_it_is, better = (error(r) for r in problem.residuals([(), terms]))
    assert better < 0.2 * as_it_is


def test_a_limit_that_was_stated_for_want_of_a_better_one_is_found_with_them() -> None:
    problem = the_problem(limit=0.75)
    proposal, u = assumed_drives(Search(problem), candidates(problem.robot)) or pytest.fail("nothing was proposed")
    terms = Model(proposal.parts).hypothesis(u)
    found = {t.effect: dict(t.values) for t in terms}
    assert found["torque_limit"]["loss"] == pytest.approx(0.75, abs=0.05)
    assert found["position_gain"]["factor"] == pytest.approx(1 / STIFFER, rel=0.3)
    as_it_is, better = (error(r) for r in problem.residuals([(), terms]))
    assert better < 0.2 * as_it_is


def test_they_come_before_whatever_mimics_a_part_of_them() -> None:
    problem = the_problem()
    pool = candidates(
        problem.robot, only=["position_gain", "speed_gain", "coulomb_friction", "part_mass", "zero_offset"]
    )
    best = examine(Search(problem), Current(), pool).best
    assert best is not None
    assert best.name == LABEL
    assert {c.effect.name for c in best.proposal.parts} == {"position_gain", "speed_gain", "coulomb_friction"}


@pytest.mark.parametrize("why", ["nobody guessed", "there already", "left out by the user"])
def test_nothing_is_proposed_where(why: str) -> None:
    problem, taken = the_problem(), []
    pool = candidates(problem.robot)
    if why == "nobody guessed":
        sample = samples()["arm"]
        problem = problem_by("open_loop", measure(sample, ()), sample.robot)
    elif why == "there already":
        taken = ["position_gain@all_joints"]
    else:
        pool = candidates(problem.robot, only=["part_mass", "position_gain"])
    assert assumed_drives(Search(problem), pool, taken) is None


def test_some_joints_of_several_are_named_one_by_one() -> None:
    robot = samples()["arm"].robot
    some = replace(guessed(robot), assumed=(("elbow", "kp"),))
    problem = problem_by("open_loop", measure(samples()["arm"], ()), some)
    proposal, _ = assumed_drives(Search(problem), candidates(some)) or pytest.fail("nothing was proposed")
    assert {c.target for c in proposal.parts} == {"elbow"}


def test_what_puts_them_right_stays_while_everything_is_fitted_and_nothing_else_does() -> None:
    some = replace(guessed(samples()["arm"].robot), assumed=(("elbow", "kp"),))
    of = {c: puts_right(some, candidate(some, *c)) for c in (
        ("speed_gain", "elbow"), ("torque_limit", "elbow"), ("speed_gain", "shoulder"), ("speed_gain", "all_joints"),
        ("zero_offset", "elbow"),
    )}  # fmt: skip
    assert [c for c, stays in of.items() if stays] == [("speed_gain", "elbow"), ("torque_limit", "elbow")]
    parts = tuple(
        candidate(some, *c) for c in (("speed_gain", "elbow"), ("zero_offset", "elbow"), ("deadband", "elbow"))
    )
    current = Current(parts, np.array([0.1, 0.1, 0.1]))
    assert list(instead(some, current, 0)) == [[0], [0, 2]]
    assert list(instead(samples()["arm"].robot, current, 0)) == [[], [0, 2]], "nothing was assumed"


def test_a_gain_is_looked_for_farther_off_where_it_was_assumed() -> None:
    robot = samples()["arm"].robot
    known, open_ = (candidate(r, "position_gain", "elbow") for r in (robot, guessed(robot)))
    assert known.bounds == ((0.2, 5.0),)
    assert open_.bounds[0][0] < 0.05


def test_a_robot_is_the_same_whatever_was_assumed_of_it() -> None:
    robot = samples()["arm"].robot
    marked = replace(robot, assumed=(("elbow", "kp"),))
    assert marked == robot
    assert marked.digest == robot.digest
    assert apply(marked, (term("coulomb_friction", "elbow", torque_nm=0.1),)).assumed == marked.assumed


def test_it_is_told_that_the_description_only_guessed() -> None:
    problem = the_problem()
    found = compare(problem, problem.residuals([()])[0])
    said = compare_account(problem, found, []).lines
    assert (
        "The description only assumed kp, kd, rotor_inertia of 2 drives: explain and improve look there first." in said
    )
    pool = candidates(problem.robot, only=["position_gain", "speed_gain", "coulomb_friction", "part_mass"])
    lines = explain_account(problem, explain(problem, pool), None).lines
    assert GUESSED in lines


def test_a_shared_effect_that_istaken_apart_is_not_called_dropped() -> None:
    robot = samples()["arm"].robot
    assert taken_apart(robot, candidate(robot, "position_gain", "all_joints")) == [
        "position_gain@shoulder",
        "position_gain@elbow",
    ]
    assert taken_apart(robot, candidate(robot, "position_gain", "elbow")) == []
