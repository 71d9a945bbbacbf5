"""One set of values that joints share, and a spread: a joint may have less of it than the others."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import pytest
from way_samples import measure, problem_by, samples

from ee_dist.discrepancy.accounts.of_explain import explain_account
from ee_dist.discrepancy.examine import Current, Effort, examine
from ee_dist.discrepancy.explain import explain
from ee_dist.discrepancy.improve import improve
from ee_dist.discrepancy.problem import Problem
from ee_dist.discrepancy.search.candidates import candidate, candidates, on_top_of, parse, with_room_left
from ee_dist.discrepancy.search.search import Search
from ee_dist.discrepancy.words import phrase, told
from ee_dist.effects.catalogue import term
from ee_dist.robots.quadruped import quadruped

QUICK = Effort(first=6, second=4, final=3, starts=1)
FRICTION = {"shoulder": 0.3, "elbow": 0.1}
SHARED = term("coulomb_friction", "all_joints", torque_nm=0.3)


@cache
def the_problem() -> Problem:
    hidden = tuple(term("coulomb_friction", j, torque_nm=c) for j, c in FRICTION.items())
    sample = samples()["arm"]
    return problem_by("open_loop", measure(sample, hidden), sample.robot)


def test_a_joint_may_have_less_than_joints_share_down_to_none_and_no_less_where_nothing_is_shared() -> None:
    robot = the_problem().robot
    pool = candidates(robot, only=["coulomb_friction", "viscous_friction", "zero_offset"])
    before = {c.name: c.bounds for c in pool}
    after = {
        c.name: c.bounds for c in on_top_of(robot, (SHARED, term("zero_offset", "shoulder", offset_rad=0.1)), pool)
    }
    changed = {name for name in before if before[name] != after[name]}
    assert list(before) == list(after)
    assert changed == {"coulomb_friction@shoulder", "coulomb_friction@elbow"}
    assert {after[name][0][0] for name in changed} == {-0.3}
    assert {before[name][0][0] for name in changed} == {0.0}


def test_in_the_end_a_joint_has_as_much_to_lose_as_is_there_then() -> None:
    """It came in beside 0.2 N.m that all share, which ended at 0.3, or was left out again."""
    robot = the_problem().robot
    at_first = on_top_of(
        robot, (term("coulomb_friction", "all_joints", torque_nm=0.2),), [parse(robot, "coulomb_friction@elbow")]
    )
    assert at_first[0].bounds[0][0] == -0.2
    shared = parse(robot, "coulomb_friction@all_joints")
    own = term("coulomb_friction", "elbow", torque_nm=0.1)
    (same, now), (alone,) = (
        with_room_left(robot, (SHARED, own), (shared, *at_first)),
        with_room_left(robot, (own,), at_first),
    )
    assert (same, now.bounds[0][0], alone.bounds[0][0]) == (shared, -0.3, 0.0)
    less = term("coulomb_friction", "elbow", torque_nm=-0.1)
    assert with_room_left(robot, (less,), at_first)[0].bounds[0][0] == -0.1, "no value leaves its bounds"
    light = candidate(robot, "rotor_inertia", "elbow")
    narrow = replace(light, bounds=((-1e-6, 1.0),))
    assert with_room_left(robot, (term("rotor_inertia", "elbow", added_kg_m2=0.0),), (narrow,)) == (narrow,)
    assert now.bounds[0][1] == alone.bounds[0][1] == at_first[0].bounds[0][1]


def test_the_joint_with_less_is_found_beside_what_all_share() -> None:
    problem = the_problem()
    pool = [parse(problem.robot, f"{e}@elbow") for e in ("coulomb_friction", "viscous_friction")]
    found = improve(problem, pool, (SHARED,), effort=QUICK)
    values = {t.target: dict(t.values)["torque_nm"] for t in found.terms if t.effect == "coulomb_friction"}
    assert values["all_joints"] == pytest.approx(FRICTION["shoulder"], abs=0.03)
    assert values["elbow"] == pytest.approx(FRICTION["elbow"] - FRICTION["shoulder"], abs=0.04)
    (less,) = (t for t in found.terms if t.target == "elbow")
    assert told(less, problem.robot).endswith("N.m less than joints share)")


def test_commands_to_one_joint_may_be_less_late_than_to_all() -> None:
    sample = samples()["arm"]
    hidden = tuple(term("command_delay", j, delay_s=d) for j, d in {"shoulder": 0.03, "elbow": 0.01}.items())
    problem = problem_by("open_loop", measure(sample, hidden), sample.robot)
    pool = [parse(problem.robot, f"{e}@elbow") for e in ("command_delay", "command_gain")]
    found = improve(problem, pool, (term("command_delay", "all_joints", delay_s=0.03),), effort=QUICK)
    (less,) = (t for t in found.terms if t.target == "elbow")
    assert less.effect == "command_delay"
    assert dict(less.values)["delay_s"] == pytest.approx(-0.02, abs=0.003)


def test_explain_says_which_joint_has_less_than_its_model_has_everywhere() -> None:
    problem = the_problem()
    pool = candidates(problem.robot, only=["coulomb_friction@elbow", "viscous_friction@elbow", "command_delay@elbow"])
    found = explain(problem, pool, (SHARED,), effort=QUICK)
    assert found.best is not None and found.best.name == "coulomb_friction@elbow"
    headline = explain_account(problem, found, None).headline
    assert headline.startswith("Too much: coulomb friction at elbow") and "less than joints share" in headline


def test_what_all_share_and_each_joint_by_itself_compete_when_the_first_is_in_the_model() -> None:
    problem = the_problem()
    shared = parse(problem.robot, "coulomb_friction@all_joints")
    current = Current((shared,), shared.shares({"torque_nm": 0.2}))
    pool = on_top_of(problem.robot, current.hypothesis, candidates(problem.robot, only=["coulomb_friction"]))
    found = examine(Search(problem), current, [c for c in pool if c.name != shared.name], QUICK)
    assert "coulomb_friction@each of 2 joints" in [j.name for j in found.judged]
    assert candidate(problem.robot, "coulomb_friction", "elbow").lower[0] == 0.0


def test_what_all_share_is_told_apart_from_the_spread() -> None:
    robot = quadruped()
    spread = [
        term("coulomb_friction", j, torque_nm=v) for j, v in zip(robot.motor_names, (-0.1, 0.05, 0.02), strict=False)
    ]
    assert phrase((SHARED, *spread), robot) == (
        "coulomb friction at all joints (torque 0.3 N.m); "
        "coulomb friction at 3 joints (torque 0.1 N.m less to 0.05 N.m more than joints share)"
    )
