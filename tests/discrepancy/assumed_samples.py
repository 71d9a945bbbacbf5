"""An arm whose description only guessed at its controllers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import pytest
from way_samples import Sample, measure, problem_by, samples

from ee_dist.discrepancy.assumed import assumed_drives
from ee_dist.discrepancy.problem import Problem
from ee_dist.discrepancy.search.candidates import Candidate, candidates
from ee_dist.discrepancy.search.fitted import Model
from ee_dist.discrepancy.search.search import Search
from ee_dist.effects.catalogue import Hypothesis, term
from ee_dist.robots.model import Robot

STIFFER, DRIER = 6.0, (0.3, 0.2)


def guessed(robot: Robot, fields: tuple[str, ...] = ("kp", "kd", "rotor_inertia")) -> Robot:
    """Described with controllers several times as stiff, because nobody knew them."""
    drives = tuple(replace(d, kp=STIFFER * d.kp, kd=3.0 * d.kd) for d in robot.drives)
    return replace(robot, drives=drives, assumed=tuple((d.joint, f) for d in drives for f in fields))


def rubbing(robot: Robot) -> Hypothesis:
    """Dry friction at both joints, which nobody described."""
    return tuple(term("coulomb_friction", j, torque_nm=c) for j, c in zip(robot.motor_names, DRIER, strict=True))


def put_right(
    problem: Problem, pool: Sequence[Candidate] | None = None
) -> tuple[Hypothesis, dict[str, dict[str, float]]]:
    """What is proposed for drives that were guessed at, and its values by effect."""
    some = candidates(problem.robot) if pool is None else pool
    proposal, u = assumed_drives(Search(problem), some) or pytest.fail("nothing was proposed")
    terms = Model(proposal.parts).hypothesis(u)
    return terms, {t.effect: dict(t.values) for t in terms}


@cache
def the_problem(limit: float = 0.0) -> Problem:
    """``limit``: share of the stated torque limit that the robot has not."""
    sample: Sample = samples()["arm"]
    hidden = (term("torque_limit", "all_joints", loss=limit),) if limit else ()
    hidden += rubbing(sample.robot)
    return problem_by("open_loop", measure(sample, hidden), guessed(sample.robot))
