"""What improve names in its first line is what the data tell from nothing."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from ee_dist.discrepancy.accounts.of_improve import _listed
from ee_dist.discrepancy.evidence.intervals import ALL_OF_IT, BOUND, HARDLY, NEUTRAL, NO_LIGHTER, NOT_DETERMINED, WIDER
from ee_dist.effects.catalogue import term

TERMS = (
    term("coulomb_friction", "elbow", torque_nm=0.2),
    term("sensor_stuck", "position_wrist", share=0.01, from_s=0.0),
    term("backlash", "wrist", gap_rad=0.01),
)


def of(flags: list[str], doubted: str = "") -> tuple[Any, Any]:
    """A finding of as many effects, called a, b, c; on those of ``doubted`` less depends than is left unexplained."""
    terms = [term("coulomb_friction", f"joint_{k}", torque_nm=0.1) for k in range(len(flags))]
    parameters = [SimpleNamespace(term=k, flag=flag, doubt="", tells=True) for k, flag in enumerate(flags)]
    shares = [SimpleNamespace(terms=(t,), text="abcde"[k], doubted="abcde"[k] in doubted) for k, t in enumerate(terms)]
    return SimpleNamespace(terms=terms, parameters=parameters), shares


def headline(flags: list[str], doubt: str = "") -> str:
    parameters = [
        SimpleNamespace(term=0, flag=flags[0], doubt=doubt, tells=True),
        SimpleNamespace(term=1, flag=flags[1], doubt=doubt, tells=True),
    ]
    parameters += [
        SimpleNamespace(term=1, flag=NEUTRAL, doubt=doubt, tells=True),
        SimpleNamespace(term=2, flag=flags[2], doubt=doubt, tells=True),
    ]
    found: Any = SimpleNamespace(terms=TERMS, parameters=parameters)
    shares: Any = [SimpleNamespace(terms=(t,), text=t.effect, doubted=False) for t in TERMS]
    return _listed(found, shares)


def test_what_may_be_nothing_is_counted_and_not_named() -> None:
    assert headline(["", NEUTRAL, HARDLY]) == "coulomb_friction; and 2 that may be nothing"
    assert headline(["", NEUTRAL, ""]) == "coulomb_friction; backlash; and 1 that may be nothing"


def test_what_is_not_determined_may_be_nothing_too() -> None:
    assert headline(["", f"{BOUND}; {NOT_DETERMINED}", NOT_DETERMINED]) == "coulomb_friction; and 2 that may be nothing"
    assert headline(["", BOUND, ""]) == "coulomb_friction; sensor_stuck; backlash"


def test_what_ended_at_a_bound_and_may_be_what_is_left_unexplained_may_be_nothing() -> None:
    assert headline([BOUND, NEUTRAL, NO_LIGHTER], WIDER) == "coulomb_friction; backlash; and 1 that may be nothing"
    assert headline(["", NEUTRAL, NO_LIGHTER], ALL_OF_IT) == "coulomb_friction; and 2 that may be nothing"


def test_more_than_a_headline_holds_is_counted() -> None:
    assert _listed(*of(["", "", "", "", NEUTRAL])) == "a; b; c; and 1 more, and 1 that may be nothing"


def test_what_may_stand_in_for_something_else_does_not_lead() -> None:
    assert _listed(*of(["", "", "", NEUTRAL], "ab")) == (
        "c; and 2 that may stand in for something else, and 1 that may be nothing"
    )
    assert _listed(*of(["", "", NEUTRAL], "ab")) == "a; b; and 1 that may be nothing", "there is nothing else"


def test_where_all_may_be_nothing_it_is_named() -> None:
    assert headline([HARDLY, NEUTRAL, HARDLY]) == "coulomb_friction; sensor_stuck; backlash"


@pytest.mark.parametrize(
    ("tells", "said"),
    [(True, "sensor_stuck; coulomb_friction"), (False, "coulomb_friction; and 1 that may be nothing")],
)
def test_when_a_sensor_sticks_does_not_tell_that_it_does(tells: bool, said: str) -> None:
    parameters = [
        SimpleNamespace(term=0, flag="", doubt="", tells=True),
        SimpleNamespace(term=1, flag=NEUTRAL, doubt="", tells=True),
        SimpleNamespace(term=1, flag="", doubt="", tells=tells),
    ]
    found: Any = SimpleNamespace(terms=TERMS[:2], parameters=parameters)
    shares: Any = [SimpleNamespace(terms=(t,), text=t.effect, doubted=False) for t in TERMS[1::-1]]
    assert _listed(found, shares) == said
