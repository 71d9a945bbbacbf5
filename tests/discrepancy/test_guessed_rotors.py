"""Rotors that somebody guessed at are off by one number, by themselves and beside guessed gains."""

from __future__ import annotations

from dataclasses import replace

import pytest
from way_samples import measure, problem_by, samples

from ee_dist.discrepancy.accounts.of_compare import compare_account
from ee_dist.discrepancy.accounts.of_explain import _rivals, explain_account
from ee_dist.discrepancy.assumed import GUESS, assumed_drives, puts_right
from ee_dist.discrepancy.compare import compare
from ee_dist.discrepancy.explain import explain
from ee_dist.discrepancy.problem import Problem
from ee_dist.discrepancy.search.candidates import candidate, candidates
from ee_dist.discrepancy.search.fitted import Model
from ee_dist.discrepancy.search.search import Search


def rotors(twice: bool = True, marked: bool = True) -> Problem:
    """A small arm with motors of two sizes, described with rotors half as heavy as they are, because somebody guessed at them."""
    sample = samples()["arm"]
    true = replace(sample.robot, drives=tuple(
        replace(d, rotor_inertia=r) for d, r in zip(sample.robot.drives, (0.06, 0.02), strict=True)
    ))  # fmt: skip
    drives = tuple(replace(d, rotor_inertia=d.rotor_inertia / (2.0 if twice else 1.0)) for d in true.drives)
    assumed = tuple((d.joint, "rotor_inertia") for d in drives) if marked else ()
    measured = measure(replace(sample, robot=true), ())
    return problem_by("open_loop", measured, replace(true, drives=drives, assumed=assumed))


def test_guessed_rotors_are_off_by_one_number_before_any_sound_motor_is_blamed() -> None:
    problem = rotors()
    pool = candidates(problem.robot, only=["motor_weak", "rotor_inertia", "rotor_factor", "command_delay", "part_mass"])
    assert [c.name for c in pool if c.guess] == ["rotor_factor@all_joints", "rotor_inertia@all_joints"]
    found = explain(problem, pool)
    assert found.best is not None and found.best.name == "rotor_factor@all_joints"
    assert dict(found.best.terms[0].values)["factor"] == pytest.approx(2.0, rel=0.1)
    assert "rotor_inertia@each of 2 joints" in found.best.tied_with
    assert GUESS in explain_account(problem, found, None).lines
    said = compare_account(problem, compare(problem, problem.residuals([()])[0]), []).lines
    assert "The description only assumed rotor_inertia of 2 drives: explain and improve look there first." in said


def test_what_does_better_and_does_not_go_first_is_told() -> None:
    """A dozen numbers at sound parts that leave less than a few guesses, which go before them."""
    problem = rotors()
    found = explain(problem, candidates(problem.robot, only=["rotor_inertia", "rotor_factor", "command_delay"]))
    best = found.best
    assert best is not None
    account = explain_account(problem, found, None)
    assert "does better" not in account.sure
    assert "Of 9 explanations 2 others do as well" in account.sure
    other = next(c for c in found.candidates if c.name == "rotor_inertia@shoulder")
    other.held = 0.5 * best.held
    said = explain_account(problem, found, None).sure
    assert "Of 9 explanations 1 does better, where nothing was guessed (" in said, (
        "it has one number, as the guess does"
    )
    assert "), and 2 others do as well" in said
    assert "1 does better, by more numbers where nothing was guessed (a)" in _rivals(9, (), "", ["a"], True)


def test_what_is_the_best_and_more_is_told_where_the_table_has_it_above() -> None:
    """It is no other explanation, and yet nobody may read that none does as well above a row that does better."""
    problem = rotors()
    found = explain(problem, candidates(problem.robot, only=["rotor_factor", "rotor_inertia"]))
    best = found.best
    assert best is not None
    more = replace(best.proposal, parts=(*best.proposal.parts, candidate(problem.robot, "rotor_inertia", "shoulder")))
    fuller = replace(best, proposal=more, error_heldout=0.9 * best.error_heldout, rank=2, tied_with=[])
    found = replace(found, examined=replace(found.examined, judged=[best, fuller]))
    best.tied_with = []
    named = "rotor factor at all joints and rotor inertia at shoulder"
    said = explain_account(problem, found, None).sure
    assert f"explanations no other does as well but itself with more beside it ({named});" in said
    best.tied_with = ["a@b"]
    assert (
        f"1 other does as well, and so does itself with more beside it ({named});"
        in explain_account(problem, found, None).sure
    )
    best.tied_with = []
    for other in (replace(fuller, error_heldout=0.99999 * best.error_heldout), replace(fuller, why_not="luck")):
        found.examined.judged[1] = other
        said = explain_account(problem, found, None).sure
        assert "no other does as well;" in said, "the table shows no lesser error, or that it was refused"


def test_a_factor_on_rotors_is_proposed_only_where_unequal_ones_were_guessed() -> None:
    names = {c.effect.name for c in candidates(rotors(marked=False).robot)}
    assert "rotor_inertia" in names and "rotor_factor" not in names
    even = replace(rotors().robot, drives=tuple(replace(d, rotor_inertia=0.01) for d in rotors().robot.drives))
    guesses = [c.name for c in candidates(even) if c.guess]
    assert guesses == ["rotor_inertia@all_joints"], "as much more at each is the same"
    one = replace(rotors().robot, assumed=(("elbow", "rotor_inertia"), ("elbow", "kp")))
    assert [c.name for c in candidates(one) if c.guess] == ["position_gain@elbow", "rotor_inertia@elbow"]


def test_guessed_rotors_beside_guessed_gains_are_off_by_a_factor_too() -> None:
    problem = rotors()
    robot = replace(problem.robot, assumed=(*problem.robot.assumed, *((j, "kp") for j in problem.robot.motor_names)))
    problem.robot = robot
    proposal, u = assumed_drives(Search(problem), candidates(robot)) or pytest.fail("nothing was proposed")
    found = {t.effect: dict(t.values) for t in Model(proposal.parts).hypothesis(u)}
    assert "rotor_inertia" not in found and found["rotor_factor"]["factor"] == pytest.approx(2.0, rel=0.1)
    assert puts_right(robot, candidate(robot, "rotor_factor", "all_joints"))
