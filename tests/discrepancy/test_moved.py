"""A model that was made on other records: what its values became when they were fitted to these is told."""

from __future__ import annotations

from linear_problem import ROBOT, Linear

from ee_dist.discrepancy.accounts.of_explain import explain_account
from ee_dist.discrepancy.explain import explain
from ee_dist.discrepancy.search.candidates import candidate
from ee_dist.effects.catalogue import term

FIRST, SECOND = ROBOT.motor_names[:2]


def told(believed: float) -> str:
    problem = Linear(tuple(term("coulomb_friction", j, torque_nm=0.3) for j in (FIRST, SECOND)), motions=4)
    before = (
        term("coulomb_friction", FIRST, torque_nm=believed),
        term("coulomb_friction", SECOND, torque_nm=0.3),
    )
    found = explain(problem, [candidate(ROBOT, "viscous_friction", FIRST)], before)
    return next((line for line in explain_account(problem, found, None).lines if "fitted anew leave" in line), "")


def test_what_moved_is_told_with_what_it_was() -> None:
    line = told(0.1)
    assert "what moved most: coulomb friction at" in line and "torque 0.1 N.m in the model" in line
    assert line.count("in the model") == 1, "what stayed is no news"


def test_what_hardly_moved_is_not_told() -> None:
    assert "moved" not in told(0.3)
