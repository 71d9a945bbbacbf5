"""A description that has too much of something: what is taken off is found, and told as such."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from way_samples import measure, problem_by, samples

from ee_dist.discrepancy.accounts.of_explain import explain_account
from ee_dist.discrepancy.accounts.of_improve import improve_account
from ee_dist.discrepancy.evidence.intervals import NONE_LEFT
from ee_dist.discrepancy.examine import Effort
from ee_dist.discrepancy.explain import explain
from ee_dist.discrepancy.improve import improve
from ee_dist.discrepancy.search.candidates import parse
from ee_dist.discrepancy.ways.free_run.problem import FreeRun
from ee_dist.discrepancy.words import told_all
from ee_dist.effects.catalogue import term
from ee_dist.robots.model import Robot

DESCRIBED = 0.4
QUICK = Effort(first=4, second=2, final=2, starts=1)


def rough(robot: Robot) -> Robot:
    """As tools write it: friction and rotors that nobody measured."""
    return robot.map_drive("elbow", lambda d: replace(d, coulomb=DESCRIBED))


@pytest.mark.parametrize("by", ["open_loop", "free_run", "force_balance"])
def test_friction_that_is_not_there_is_taken_off(by: str) -> None:
    sample = samples()["arm"]
    true = replace(sample, robot=sample.robot.map_drive("elbow", lambda d: replace(d, coulomb=0.15)))
    trials = measure(true, ())
    problem = problem_by(by, trials, rough(sample.robot))
    if isinstance(problem, FreeRun):
        problem.effort = 0.4
    pool = [parse(problem.robot, f"{e}@elbow") for e in ("coulomb_friction", "viscous_friction", "parallel_spring")]
    found = explain(problem, pool, (), effort=QUICK)
    assert found.best is not None and found.best.name == "coulomb_friction@elbow"
    assert dict(found.best.terms[0].values)["torque_nm"] == pytest.approx(0.15 - DESCRIBED, abs=0.03)
    told = explain_account(problem, found, None).headline
    assert told.startswith("Too much: coulomb friction at elbow (torque 0.2") and "N.m less than described" in told


def test_friction_that_is_not_there_at_all_is_at_its_bound_and_said_so() -> None:
    sample = samples()["arm"]
    problem = problem_by("force_balance", measure(sample, ()), rough(sample.robot))
    found = improve(problem, [], (), [parse(problem.robot, "coulomb_friction@elbow")])
    (value,) = found.parameters
    assert value.value == pytest.approx(-DESCRIBED, rel=0.03) and value.flag == NONE_LEFT
    assert any("next to none is left" in line for line in improve_account(problem, found).words)


def test_less_and_more_at_several_joints_in_words() -> None:
    terms = tuple(term("viscous_friction", t, damping_nm_s_rad=v) for t, v in (("a", -0.2), ("b", 0.1)))
    assert "a 0.2 N.m.s/rad less than described; b 0.1 N.m.s/rad" in told_all(terms)


def test_a_rotor_is_lighter_than_described_as_far_as_its_controller_stays_slow() -> None:
    robot = samples()["arm"].robot
    heavy = robot.map_drive("elbow", lambda d: replace(d, rotor_inertia=0.02))
    (low, _), *_ = parse(heavy, "rotor_inertia@elbow").bounds
    assert -0.9 * 0.02 <= low < -0.25 * 0.02
    stiff = heavy.map_drive("elbow", lambda d: replace(d, kp=1e5))
    assert np.isclose(parse(stiff, "rotor_inertia@elbow").bounds[0][0], -0.25 * 0.02)
