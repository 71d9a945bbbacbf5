"""The headline names what looks the same, where that is little."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from ee_dist.discrepancy.explain import EFFECT
from ee_dist.discrepancy.words import explain_account
from ee_dist.effects.catalogue import term
from ee_dist.robots.servo_pendulum import servo_pendulum


def headline(tied: list[str]) -> str:
    best = SimpleNamespace(
        terms=(term("coulomb_friction", "servo", torque_nm=0.3),), tied_with=tied, interval=(0.4, 0.6), gain=0.5,
        explained=1.0, held_out="windows", error_heldout=1.1,
    )  # fmt: skip
    found = SimpleNamespace(
        best=best,
        verdict=EFFECT,
        left=[],
        baseline_error=2.0,
        refitted_error=2.0,
        noise_floor=1.0,
        floor_source="told",
        tried=9,
    )
    problem = SimpleNamespace(robot=servo_pendulum(), told=str, natural_name="error", natural_unit="")
    return explain_account(problem, found, None).headline  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("tied", "said"),
    [
        ([], "Missing: coulomb friction at servo (torque 0.3 N.m). Nothing"),
        (["part_lost@servo"], "(torque 0.3 N.m), or part lost at servo, which looks the same here. Nothing"),
        (["part_lost@servo", "b@c"], ", or part lost at servo or b at c, which look the same here. Nothing"),
        (["a@c", "b@c", "d@c"], ", or one of 3 others that look the same here. Nothing"),
    ],
)
def test_what_looks_the_same_is_named(tied: list[str], said: str) -> None:
    assert said in headline(tied)
