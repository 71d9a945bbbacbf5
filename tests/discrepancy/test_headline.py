"""What improve names in its first line is what the data tell from nothing."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from ee_dist.discrepancy.accounts.of_improve import _listed
from ee_dist.discrepancy.evidence.intervals import HARDLY, NEUTRAL
from ee_dist.effects.catalogue import term

TERMS = (
    term("coulomb_friction", "elbow", torque_nm=0.2),
    term("sensor_stuck", "position_wrist", share=0.01, from_s=0.0),
    term("backlash", "wrist", gap_rad=0.01),
)


def headline(flags: list[str]) -> str:
    parameters = [SimpleNamespace(term=0, flag=flags[0]), SimpleNamespace(term=1, flag=flags[1])]
    parameters += [SimpleNamespace(term=1, flag=NEUTRAL), SimpleNamespace(term=2, flag=flags[2])]
    found: Any = SimpleNamespace(terms=TERMS, parameters=parameters)
    shares: Any = [SimpleNamespace(terms=(t,), text=t.effect) for t in TERMS]
    return _listed(found, shares)


def test_what_may_be_nothing_is_counted_and_not_named() -> None:
    assert headline(["", NEUTRAL, HARDLY]) == "coulomb_friction; and 2 that may be nothing"
    assert headline(["", NEUTRAL, ""]) == "coulomb_friction; backlash; and 1 that may be nothing"


def test_where_all_may_be_nothing_it_is_named() -> None:
    assert headline([HARDLY, NEUTRAL, HARDLY]) == "coulomb_friction; sensor_stuck; backlash"
