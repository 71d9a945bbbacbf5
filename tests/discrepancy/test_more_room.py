"""A guess that ended as far off as it may be goes on from there."""

from __future__ import annotations

from dataclasses import replace

import pytest
from assumed_samples import DRIER
from way_samples import Sample, measure, problem_by, samples

from ee_dist.discrepancy.assumed import assumed_drives
from ee_dist.discrepancy.improve import improve
from ee_dist.discrepancy.problem import Problem, error
from ee_dist.discrepancy.search.candidates import candidate, candidates
from ee_dist.discrepancy.search.fitted import Model
from ee_dist.discrepancy.search.search import Search
from ee_dist.effects.catalogue import term

FORTY = 40.0
"""Times too weak that all drives were taken to be: beyond what any single guess may be off."""


def far_too_weak() -> Problem:
    """Their limits, of a file that states none, and their rotors too."""
    sample: Sample = samples()["arm"]
    hidden = tuple(
        term("coulomb_friction", j, torque_nm=c) for j, c in zip(sample.robot.motor_names, DRIER, strict=True)
    )
    fields = ("kp", "kd", "rotor_inertia", "torque_limit")
    drives = tuple(replace(d, **{f: getattr(d, f) / FORTY for f in fields}) for d in sample.robot.drives)
    robot = replace(sample.robot, drives=drives, assumed=tuple((d.joint, f) for d in drives for f in fields))
    return problem_by("open_loop", measure(sample, hidden), robot)


def test_drives_that_are_stronger_by_far_than_any_guess_may_be_off_are_found() -> None:
    problem = far_too_weak()
    proposal, u = assumed_drives(Search(problem), candidates(problem.robot)) or pytest.fail("nothing was proposed")
    terms = Model(proposal.parts).hypothesis(u)
    found = {t.effect: dict(t.values) for t in terms}
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
