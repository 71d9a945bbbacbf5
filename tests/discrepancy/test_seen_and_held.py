"""What has seen all data is not called held out, and what all data do not determine stays near the description."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from linear_problem import ROBOT, Linear

from ee_dist.discrepancy import last_steps as ending
from ee_dist.discrepancy.evidence.holdout import PRIOR, cross_fit, held_by_slopes, prior_of, travelling
from ee_dist.discrepancy.examine import Current
from ee_dist.discrepancy.kinds import Everywhere
from ee_dist.discrepancy.ladder import Rung
from ee_dist.discrepancy.search.candidates import Candidate, candidate
from ee_dist.discrepancy.search.fitted import Fit, Model
from ee_dist.discrepancy.search.screen import Screened
from ee_dist.discrepancy.search.search import Search
from ee_dist.discrepancy.search.valley import LARGE, follow_valley
from ee_dist.discrepancy.several import families
from ee_dist.discrepancy.told import Told
from ee_dist.effects.catalogue import term
from ee_dist.effects.groups import ALL_JOINTS

JOINTS = ROBOT.motor_names
MANY = Model(tuple(candidate(ROBOT, e, j) for e in ("coulomb_friction", "viscous_friction") for j in JOINTS))


def fitted() -> tuple[Search, Fit]:
    search = Search(Linear((term("coulomb_friction", JOINTS[0], torque_nm=0.3),), motions=4))
    (fit,) = follow_valley(search, [(MANY, np.zeros(len(MANY.parts)))], search.everything, PRIOR)
    return search, fit


def test_where_known_slopes_lead_nowhere_a_turn_is_fitted_anew() -> None:
    search, fit = fitted()
    assert len(fit.u) >= LARGE
    cut = travelling(search.problem)[0]
    astray = replace(fit, slopes=-fit.slopes)
    (by_slopes,) = cross_fit(search, [(fit.model, fit.u)], cut, leading=[astray.slopes])
    assert np.array_equal(by_slopes.residual, fit.residual), "values that have seen what is held out"
    (held,) = held_by_slopes(search, [astray], cut)
    (anew,) = cross_fit(search, [(fit.model, fit.u)], cut)
    assert held.energy == pytest.approx(anew.energy)
    assert held.energy > float(fit.residual @ fit.residual)


def test_slopes_that_lead_somewhere_are_followed() -> None:
    search, fit = fitted()
    cut = travelling(search.problem)[0]
    (held,) = held_by_slopes(search, [fit], cut)
    (by_slopes,) = cross_fit(search, [(fit.model, fit.u)], cut, leading=[fit.slopes])
    assert np.array_equal(held.residual, by_slopes.residual)


def test_the_prior_grows_with_what_is_left_above_the_noise() -> None:
    search, fit = fitted()
    at_noise = prior_of(search, [(fit.model, fit.u)])
    assert at_noise == pytest.approx(PRIOR, abs=0.5)
    far = prior_of(search, [(Model(()), np.zeros(0))])
    assert far > at_noise


@pytest.mark.parametrize(("above", "tried"), [(1000.0, True), (10_000.0, False)])
def test_joints_that_add_to_what_one_of_them_leaves_are_tried_together(above: float, tried: bool) -> None:
    """An elbow that promises 740, and a shoulder 200: little beside the elbow, and most of what it leaves of 1,000."""

    def promising(place: str, promise: float) -> Screened:
        c = candidate(ROBOT, "coulomb_friction", place)
        return Screened(c, promise, (np.full(c.size, 0.1),), promise)

    screened = [promising(JOINTS[0], 740.0), promising(JOINTS[1], 200.0), promising(ALL_JOINTS, 800.0)]
    found = families(screened, [], 20.0, set(), above, frozenset())
    assert [p.name for p, _ in found] == (["coulomb_friction@each of 2 joints"] if tried else [])


@pytest.mark.parametrize(("effect", "left"), [("position_gain", 2), ("coulomb_friction", 3)])
def test_a_joint_that_is_only_held_has_no_gain_of_its_own(effect: str, left: int) -> None:
    """How far it sags says as much of a torque."""
    places = JOINTS[:3]
    screened = [
        Screened(c := candidate(ROBOT, effect, place), promise, (np.full(c.size, 0.1),), promise)
        for place, promise in [*((p, 500.0) for p in places), (ALL_JOINTS, 600.0)]
    ]
    ((proposal, _),) = families(screened, [], 20.0, set(), 1000.0, frozenset(places[:1]))
    assert len(proposal.parts) == left


def test_small_values_are_fitted_anew_beside_what_came_in_the_place_of_one(monkeypatch: pytest.MonkeyPatch) -> None:
    search, fit = fitted()
    current = Current(fit.model.parts, fit.u)
    came = candidate(ROBOT, "supply_sag", "supply")
    then = Current((*fit.model.parts[1:], came), np.append(fit.u[1:], 0.3))
    last = Current((came,), np.array([0.2]))
    asked: list[tuple[str, ...]] = []

    def rung(name: str) -> Rung:
        return Rung(name, (), (), 5.0, 5.0, np.zeros(1), "motions that were not fitted")

    def everywhere(_: Search, now: Current, *more: object) -> Everywhere:
        asked.append(tuple(c.name for c in now.parts))
        return Everywhere(last, [rung("all anew")], 1.0)

    def nearest(_: Search, now: Current, *more: object) -> tuple[Current, list[object], Rung | None]:
        return (now, [], None) if came in now.parts else (then, [], rung("supply sag"))

    looked: list[Current] = []

    def told_only(_: Search, now: Current, *more: object) -> Told:
        looked.append(now)
        return Told(now)

    monkeypatch.setattr(ending, "told_only", told_only)
    monkeypatch.setattr(ending, "without_neutral", lambda now, *_: (now, ()))
    monkeypatch.setattr(ending, "nearest", nearest)
    monkeypatch.setattr(ending, "everywhere", everywhere)
    climbed: list[Rung] = []

    def settled(spread: bool, often: int, tried: frozenset[str] = frozenset()) -> Current:
        climbed.clear()
        pool: list[Candidate] = []
        return ending.last_steps(search, current, 0, pool, climbed.append, spread, [], often, tried)[0]

    assert settled(True, 1).parts == (came,) and [r.name for r in climbed][-2:] == ["supply sag", "all anew"]
    assert asked == [tuple(c.name for c in then.parts)]
    looked.clear()
    assert settled(True, 0).parts == then.parts, "as often as is allowed"
    assert [now.parts for now in looked] == [current.parts, then.parts], "beside what came others may tell nothing"
    assert settled(False, 1).parts == then.parts, (
        "where nothing is a little wrong everywhere there is nothing to fit anew"
    )
    assert settled(True, 1, frozenset({came.name})).parts == then.parts, "all of it was tried beside that before"
    assert len(asked) == 1
