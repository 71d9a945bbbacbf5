"""What an account asks of a problem and of an explanation, made up."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from ee_dist.discrepancy.accounts.account import Account
from ee_dist.discrepancy.accounts.of_explain import explain_account
from ee_dist.discrepancy.evidence.intervals import ParameterReport
from ee_dist.discrepancy.evidence.left import Leftover
from ee_dist.discrepancy.explain import EFFECT
from ee_dist.discrepancy.meters import AtLimit
from ee_dist.discrepancy.search.candidates import candidate
from ee_dist.effects.catalogue import Term, term
from ee_dist.robots.servo_pendulum import servo_pendulum

DRY = term("coulomb_friction", "servo", torque_nm=0.3)


def made_up() -> SimpleNamespace:
    """What an account asks of a problem, of one trial."""
    return SimpleNamespace(
        robot=servo_pendulum(),
        told=str,
        natural_name="error",
        natural_unit="",
        way="open_loop",
        notes=[],
        doubts="",
        trials=("a",),
        measured=(),
        says_nothing=lambda _: "",
        layout=SimpleNamespace(units=("rad",)),
    )


def account(
    tied: list[str], explained: float = 1.0, ahead: object = None, planner: str = "", unsure: tuple[str, ...] = (),
    what: Term = DRY, left: tuple[Leftover, ...] = (), parameters: tuple[ParameterReport, ...] = (), label: str = "",
    problem: SimpleNamespace | None = None, at_limit: tuple[AtLimit, ...] = (),
) -> Account:  # fmt: skip
    best = SimpleNamespace(
        terms=(what,), tied_with=tied, interval=(0.4, 0.6), gain=0.5,
        explained=explained, held_out="windows", error_heldout=1.1, own=np.zeros(len(what.values)),
        proposal=SimpleNamespace(label=label, guess=False, parts=(candidate(servo_pendulum(), what.effect, what.target),)),
    )  # fmt: skip
    found = SimpleNamespace(
        candidates=[],
        best=best,
        verdict=EFFECT,
        left=list(left),
        baseline_error=2.0,
        refitted_error=2.0,
        noise_floor=1.0,
        floor_source="told",
        tried=9,
        offered=9,
        before=(),
        as_it_was=False,
        unsure=unsure,
        after=(what,),
        parameters=list(parameters),
        at_limit=list(at_limit),
    )
    return explain_account(problem or made_up(), found, ahead, planner)  # type: ignore[arg-type]
