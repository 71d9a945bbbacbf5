"""Gains that a description only assumed are the first suspect, all of them together, and farther off than gains that somebody
knew may be."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from assumed_samples import DRIER, STIFFER, guessed, put_right, rubbing, the_problem
from way_samples import Sample, measure, problem_by, samples

from ee_dist.discrepancy.assumed import LABEL, assumed_drives, puts_right
from ee_dist.discrepancy.examine import Current, examine
from ee_dist.discrepancy.lags import with_lags
from ee_dist.discrepancy.problem import error
from ee_dist.discrepancy.search.candidates import candidate, candidates
from ee_dist.discrepancy.search.fitted import Model
from ee_dist.discrepancy.search.pool import as_slow
from ee_dist.discrepancy.search.search import Search
from ee_dist.effects.catalogue import apply, find, term

TWELVE = 12.0
"""Times as strong as they are that all drives were taken to be."""


def test_drives_that_are_weaker_by_one_factor_in_all_are_found_with_their_lighter_rotors() -> None:
    sample: Sample = samples()["arm"]
    hidden = rubbing(sample.robot)
    drives = tuple(
        replace(d, kp=TWELVE * d.kp, kd=TWELVE * d.kd, rotor_inertia=TWELVE * (k + 1) * d.rotor_inertia)
        for k, d in enumerate(sample.robot.drives)
    )
    assumed = tuple((d.joint, f) for d in drives for f in ("kp", "kd", "rotor_inertia"))
    robot = replace(sample.robot, drives=drives, assumed=assumed)
    problem = problem_by("open_loop", measure(sample, hidden), robot)
    _, found = put_right(problem)
    assert found["position_gain"]["factor"] == pytest.approx(1 / TWELVE, rel=0.1)
    assert found["speed_gain"]["factor"] == pytest.approx(1 / TWELVE, rel=0.15)
    assert 0.02 < found["rotor_factor"]["factor"] < 0.1, (
        "one factor, where the guess at the second joint is twice as far off"
    )
    assert found["coulomb_friction"]["torque_nm"] == pytest.approx(np.mean(DRIER), rel=0.2)


def test_gains_that_were_assumed_are_found_together_with_friction() -> None:
    problem = the_problem()
    terms, found = put_right(problem)
    assert {t.target for t in terms} == {"all_joints"}, "and no weight is carried"
    assert found["position_gain"]["factor"] == pytest.approx(1 / STIFFER, rel=0.15)
    assert found["coulomb_friction"]["torque_nm"] == pytest.approx(np.mean(DRIER), rel=0.5)
    as_it_is, better = (error(r) for r in problem.residuals([(), terms]))
    assert better < 0.2 * as_it_is


@pytest.mark.parametrize("late_s", [0.02, 0.0])
def test_a_stiff_controller_that_is_late_is_not_a_soft_one(late_s: float) -> None:
    """Guessed too soft, it lags as much without any delay; where it is not late no delay comes with it."""
    sample: Sample = samples()["arm"]
    hidden = (term("command_delay", "all_joints", delay_s=late_s),) if late_s else ()
    trials = measure(sample, hidden)
    robot = with_lags(sample.robot, trials)
    assert all(j.lag_s > late_s for j in robot.joints)
    softer = tuple(replace(d, kp=d.kp / 5, kd=d.kd / 5) for d in robot.drives)
    robot = replace(robot, drives=softer, assumed=tuple((d.joint, f) for d in softer for f in ("kp", "kd")))
    problem = problem_by("open_loop", trials, robot)
    _, found = put_right(problem)
    assert found["position_gain"]["factor"] == pytest.approx(5.0, rel=0.15)
    if late_s:
        assert found["command_delay"]["delay_s"] == pytest.approx(late_s, abs=0.002)
    else:
        assert "command_delay" not in found


def test_a_joint_that_follows_as_a_filter_does_has_far_more_damping_than_was_guessed() -> None:
    """More than an explicit step of it holds, and no friction, delay or softer gain in its place."""
    sample, late_s = samples()["arm"], 0.15
    drives = tuple(replace(d, kd=late_s * d.kp, rotor_inertia=0.3 * d.rotor_inertia) for d in sample.robot.drives)
    trials = measure(replace(sample, robot=replace(sample.robot, drives=drives)), ())
    guess = tuple(replace(d, kd=d.kd / 4) for d in sample.robot.drives)
    described = replace(sample.robot, drives=guess, assumed=tuple((d.joint, f) for d in drives for f in ("kp", "kd")))
    robot = with_lags(described, trials)
    for d in guess:
        (_, most), (_, unseen) = (
            find("speed_gain").bounds(r, d.joint)["factor"] for r in (robot, replace(robot, joints=described.joints))
        )
        assert unseen * d.kd < late_s * d.kp < most * d.kd, "as long as nobody saw how late it is, what steps hold"
    problem = problem_by("open_loop", trials, robot)
    pool = candidates(robot, only=["position_gain", "speed_gain", "rotor_inertia", "coulomb_friction"])
    proposal, u = assumed_drives(Search(problem), pool) or pytest.fail("nothing was proposed")
    terms = Model(proposal.parts).hypothesis(u)
    found = apply(robot, terms).drives
    for d in found:
        assert d.kd / d.kp == pytest.approx(late_s, rel=0.05)
    as_it_is, better = (error(r) for r in problem.residuals([(), terms]))
    assert better < 0.1 * as_it_is


def test_a_limit_that_was_guessed_may_be_too_low() -> None:
    sample = samples()["arm"]
    lower = tuple(replace(d, torque_limit=0.1 * d.torque_limit) for d in sample.robot.drives)
    trials = measure(sample, ())
    guess = tuple((d.joint, f) for d in lower for f in ("torque_limit", "kp", "kd"))
    robot = replace(sample.robot, drives=lower, assumed=guess)
    problem = problem_by("open_loop", trials, robot)
    assert find("torque_limit").bounds(replace(robot, assumed=()), lower[0].joint)["loss"][0] == 0.0
    pool = candidates(robot, only=["position_gain", "speed_gain", "torque_limit"])
    proposal, u = assumed_drives(Search(problem), pool) or pytest.fail("nothing was proposed")
    found = apply(robot, Model(proposal.parts).hypothesis(u))
    assert found.drives[0].torque_limit > 2.0 * lower[0].torque_limit
    assert found.drives[0].kp == pytest.approx(lower[0].kp, rel=0.1)


def test_weight_that_controllers_carry_is_found_with_them() -> None:
    """Soft gains would sag under it: without it being carried they seem stiff, and dry friction holds the arm."""
    sample: Sample = samples()["arm"]
    (mounting,) = find("weight_carried").targets(sample.robot)
    soft, heavy = term("position_gain", "all_joints", factor=0.3), replace(
        sample.robot, parts=tuple(replace(p, mass_kg=3 * p.mass_kg) for p in sample.robot.parts)
    )  # fmt: skip
    friction = tuple(term("coulomb_friction", j, torque_nm=c) for j, c in zip(heavy.motor_names, DRIER, strict=True))
    hidden = (soft, term("weight_carried", mounting, share=0.95), *friction)
    problem = problem_by("open_loop", measure(replace(sample, robot=heavy), hidden), guessed(heavy))
    proposal, u = assumed_drives(Search(problem), candidates(problem.robot)) or pytest.fail("nothing was proposed")
    found = {t.effect: dict(t.values) for t in Model(proposal.parts).hypothesis(u)}
    assert proposal.guess and found["weight_carried"]["share"] == pytest.approx(0.95, abs=0.1)
    assert found["position_gain"]["factor"] == pytest.approx(0.3 / STIFFER, rel=0.3)
    other, _ = assumed_drives(Search(problem), candidates(problem.robot, without=["weight_carried"])) or pytest.fail(
        "nothing was proposed"
    )
    assert "weight_carried" not in {c.effect.name for c in other.parts}


@pytest.mark.parametrize("knows", [True, False])
def test_a_controller_that_knows_how_fast_its_goal_goes_is_no_stiffer_one(knows: bool) -> None:
    """Guessed at as one that does not, it would be ever so much stiffer; one that does not know it is told so neither."""
    sample = samples()["arm"]
    friction = tuple(term("coulomb_friction", j, torque_nm=0.05) for j in sample.robot.motor_names)
    hidden = (*((term("speed_feed_forward", "all_joints", share=1.0),) if knows else ()), *friction)
    trials = measure(sample, hidden)
    guess = tuple(replace(d, kp=d.kp / 2, kd=3 * d.kd) for d in sample.robot.drives)
    described = replace(sample.robot, drives=guess, assumed=tuple((d.joint, f) for d in guess for f in ("kp", "kd")))
    problem = problem_by("open_loop", trials, with_lags(described, trials))
    pool = candidates(problem.robot, without=["weight_carried"])
    proposal, u = assumed_drives(Search(problem), pool) or pytest.fail("nothing was proposed")
    terms = Model(proposal.parts).hypothesis(u)
    found = {t.effect: dict(t.values) for t in terms}
    assert ("speed_feed_forward" in found) == knows
    assert found["position_gain"]["factor"] == pytest.approx(2.0, rel=0.15)
    if knows:
        assert found["speed_feed_forward"]["share"] == pytest.approx(1.0, abs=0.1)
        assert all(puts_right(problem.robot, c) for c in proposal.parts)
    as_it_is, better = (error(r) for r in problem.residuals([(), terms]))
    assert better < 0.2 * as_it_is


def test_a_limit_that_was_stated_for_want_of_a_better_one_is_found_with_them() -> None:
    problem = the_problem(limit=0.75)
    terms, found = put_right(problem)
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


def test_a_gain_is_looked_for_farther_off_where_it_was_assumed() -> None:
    robot = samples()["arm"].robot
    known, open_ = (candidate(r, "position_gain", "elbow") for r in (robot, guessed(robot)))
    assert known.bounds == ((0.2, 5.0),)
    assert open_.bounds[0][0] < 0.05


def test_friction_that_slows_as_back_emf_does_is_worth_trying_where_the_stated_speed_is_nobodys() -> None:
    """A file's 20 rad/s, and a motor that is slowed to 3: all of its torque at a speed that the joint had is not too much."""
    sample = samples()["arm"]
    stated = replace(sample.robot, joints=tuple(replace(j, top_speed=40.0) for j in sample.robot.joints))
    problem = problem_by("open_loop", measure(sample, ()), stated)
    own = candidate(stated, "viscous_friction", "elbow")
    assert as_slow(problem, own) is own, "where the drives are known the range is as it was"
    unknown = replace(stated, assumed=tuple((j, "kp") for j in stated.motor_names))
    guess = problem_by("open_loop", measure(sample, ()), unknown)
    wider = as_slow(guess, candidate(unknown, "viscous_friction", "elbow"))
    fastest = max(
        float(np.quantile(np.abs(np.gradient(t.log.sensors[:, 1], t.log.times_s)), 0.99)) for t in guess.measured
    )
    drive = unknown.drives[unknown.motor_names.index("elbow")]
    assert wider.bounds[0][1] == pytest.approx(min(1.2 * drive.torque_limit / fastest, 10 * own.bounds[0][1]), rel=0.2)
    # A motor whose own speed is stated is believed, and other effects are as they were.
    believed = unknown.map_drive("elbow", lambda d: replace(d, speed_limit=40.0))
    known = candidate(believed, "viscous_friction", "elbow")
    assert as_slow(problem_by("open_loop", measure(sample, ()), believed), known).bounds == known.bounds
    dry = candidate(unknown, "coulomb_friction", "elbow")
    assert as_slow(guess, dry) is dry
