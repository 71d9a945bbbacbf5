"""A guess that ended as far off as it may be goes on from there."""

from __future__ import annotations

from dataclasses import replace

import pytest
from assumed_samples import put_right, rubbing
from way_samples import Sample, measure, problem_by, samples

from ee_dist.discrepancy.improve import improve
from ee_dist.discrepancy.problem import Problem, error
from ee_dist.discrepancy.search.candidates import Candidate, candidate, candidates
from ee_dist.effects.catalogue import term


def test_a_guess_that_is_farther_off_than_one_may_go_at_first_is_found_by_going_on_from_there() -> None:
    sample, softer = samples()["arm"], 40.0
    hidden = tuple(term("coulomb_friction", j, torque_nm=0.05) for j in sample.robot.motor_names)
    drives = tuple(replace(d, kp=d.kp / softer, kd=d.kd / softer) for d in sample.robot.drives)
    robot = replace(sample.robot, drives=drives, assumed=tuple((d.joint, f) for d in drives for f in ("kp", "kd")))
    (at_first,) = candidate(robot, "position_gain", "all_joints").bounds
    assert at_first[1] < 0.7 * softer
    problem = problem_by("open_loop", measure(sample, hidden), robot)
    pool = candidates(robot, only=["position_gain", "speed_gain", "coulomb_friction"])
    terms, found = put_right(problem, pool)
    assert found["position_gain"]["factor"] == pytest.approx(softer, rel=0.15)
    as_it_is, better = (error(r) for r in problem.residuals([(), terms]))
    assert better < 0.2 * as_it_is


FORTY = 40.0
"""Times too weak that all drives were taken to be: beyond what any single guess may be off."""


def far_too_weak() -> Problem:
    """Their limits, of a file that states none, and their rotors too."""
    sample: Sample = samples()["arm"]
    hidden = rubbing(sample.robot)
    fields = ("kp", "kd", "rotor_inertia", "torque_limit")
    drives = tuple(replace(d, **{f: getattr(d, f) / FORTY for f in fields}) for d in sample.robot.drives)
    robot = replace(sample.robot, drives=drives, assumed=tuple((d.joint, f) for d in drives for f in fields))
    return problem_by("open_loop", measure(sample, hidden), robot)


def test_drives_that_are_stronger_by_far_than_any_guess_may_be_off_are_found() -> None:
    problem = far_too_weak()
    terms, found = put_right(problem)
    assert found["position_gain"]["factor"] == pytest.approx(FORTY, rel=0.2)
    as_it_is, better = (error(r) for r in problem.residuals([(), terms]))
    assert better < 0.2 * as_it_is


def test_what_was_asked_for_has_as_much_room() -> None:
    problem = far_too_weak()
    wanted = [candidate(problem.robot, e, "all_joints") for e in ("torque_limit", "position_gain", "speed_gain")]
    found = improve(problem, candidates(problem.robot), wanted=wanted)
    assert found.ladder[-1].name == "with more room for what was guessed"
    (gain,) = (dict(t.values)["factor"] for t in found.terms if t.effect == "position_gain")
    assert gain > 25.0 > wanted[1].bounds[0][1]
    assert found.ladder[-1].error_heldout < 0.8 * found.ladder[-2].error_heldout


def hardly_damped() -> tuple[Problem, list[Candidate]]:
    """Damping of a sixth, which is a little beyond what a guess may be off at first, and an encoder that is far off."""
    sample, hidden = samples()["arm"], (term("zero_offset", "elbow", offset_rad=0.3),)
    drives = tuple(replace(d, kd=d.kd / 6.0) for d in sample.robot.drives)
    robot = replace(sample.robot, drives=drives, assumed=tuple((d.joint, f) for d in drives for f in ("kp", "kd")))
    pool = candidates(robot, only=["position_gain", "speed_gain", "zero_offset"])
    return problem_by("open_loop", measure(sample, hidden), robot), pool


def test_beside_what_came_since_a_guess_goes_farther_than_it_did_when_more_was_wrong() -> None:
    problem, pool = hardly_damped()
    found = improve(problem, pool)
    damping = [dict(t.values)["factor"] for r in found.ladder for t in r.terms if t.effect == "speed_gain"]
    assert damping[0] < 5.5
    assert damping[-1] == pytest.approx(6.0, rel=0.05) and not found.no_farther
    assert found.ladder[-1].error_heldout < 1.2 * problem.noise_floor()[0]


def test_a_guess_at_its_end_that_more_room_does_no_good_is_kept_in_mind() -> None:
    problem, pool = hardly_damped()
    found = improve(problem, pool, wanted=[candidate(problem.robot, "speed_gain", "all_joints")])
    assert found.no_farther == {"speed_gain@all_joints"}
