"""The ladder on residuals whose answer is known: what it adds, what it drops, what it calls tied, and where it stops."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from linear_problem import GAIN, HIDDEN, JAM, ROBOT, WEAK, Linear, StandIn

import ee_dist.discrepancy.improve as improving
from ee_dist.discrepancy.accounts.of_improve import improve_account
from ee_dist.discrepancy.asked_for import ASKED
from ee_dist.discrepancy.evidence.holdout import MOTIONS, WINDOWS
from ee_dist.discrepancy.evidence.rule import TOO_LITTLE, TOO_LITTLE_ALONE
from ee_dist.discrepancy.examine import STANDARD_EFFORT
from ee_dist.discrepancy.explain import NOTHING_MISSING, UNEXPLAINED, as_it_was
from ee_dist.discrepancy.finished import BETTER, EXPLAINED
from ee_dist.discrepancy.improve import NOTHING_LEFT, improve
from ee_dist.discrepancy.search.candidates import parse
from ee_dist.discrepancy.search.search import Search
from ee_dist.effects.catalogue import Hypothesis, Term, term
from ee_dist.trials.log import Array

POOL = [parse(ROBOT, name) for name in (WEAK, JAM, GAIN)]


class Twins(Linear):
    """``command_gain`` does nearly what ``motor_weak`` does."""

    unlike = 0.01

    def shift(self, hypothesis: Hypothesis) -> Array:
        total = super().shift(tuple(t for t in hypothesis if t.effect != "command_gain"))
        for t in hypothesis:
            if t.effect == "command_gain":
                size = t.values[0][1]
                own = super().shift((Term(t.effect, t.target, (("change", 1.0),)),))
                like = super().shift((term("motor_weak", "knee_front_left", loss=1.0),))
                total = total + size * (like + self.unlike * own)
        return total


def test_what_is_there_is_added_and_nothing_else() -> None:
    found = improve(Linear(HIDDEN), POOL)
    assert [r.name for r in found.ladder[1:]] == [WEAK, JAM]
    held = [r.error_heldout for r in found.ladder]
    assert held[0] > held[1] > held[2]
    assert held[2] == pytest.approx(1.0, abs=0.1)
    assert not any(r.tied_with or r.dropped for r in found.ladder)
    assert found.stopped == NOTHING_LEFT and found.verdict == EXPLAINED
    assert found.explained == pytest.approx(1.0, abs=0.05)
    assert found.last is not None and all(j.why_not for j in found.last.judged)


def test_a_step_that_foretells_no_better_with_all_values_fitted_anew_is_refused(monkeypatch) -> None:
    """It was judged beside a model that only went along with it."""
    as_it_stands = improving._as_it_stands

    def worse_with_the_jam(search, current, cut, rung) -> None:
        as_it_stands(search, current, cut, rung)
        rung.error_heldout += 9.0 * (rung.name == JAM)

    monkeypatch.setattr(improving, "_as_it_stands", worse_with_the_jam)
    found = improve(Linear(HIDDEN), POOL)
    assert [r.name for r in found.ladder[1:]] == [WEAK] and {t.name for t in found.terms} == {WEAK}
    assert improving.WORSE in found.stopped and found.verdict == BETTER


def test_what_is_asked_for_and_there_already_is_fitted_anew_in_its_place() -> None:
    before = (term("motor_weak", "knee_front_left", loss=0.1),)
    named = improve(Linear(HIDDEN[:1]), POOL, before, [POOL[0]])
    only = improve(Linear(HIDDEN[:1]), POOL, before, [])
    assert named.terms == only.terms and [t.name for t in named.terms] == [WEAK]
    assert dict(named.terms[0].values)["loss"] == pytest.approx(0.4, abs=0.05)
    assert not any(r.added for r in named.ladder)
    assert named.stopped == f"{WEAK}, which the model has already, was fitted anew in its place"
    account = improve_account(Linear(HIDDEN[:1]), named)
    assert account.headline.startswith("Added: nothing; the model's own values were fitted anew.")
    assert any(named.stopped in line for line in account.lines)


def test_what_is_asked_for_twice_is_added_once() -> None:
    asked = [POOL[0], POOL[1], POOL[0]]
    found = improve(Linear(HIDDEN), POOL, wanted=asked)
    assert [t.name for t in found.terms] == [WEAK, JAM] and found.stopped == ASKED
    beside = improve(Linear(HIDDEN), POOL, HIDDEN[:1], asked)
    assert [t.name for t in beside.terms] == [WEAK, JAM] and [r.name for r in beside.ladder if r.added] == [JAM]
    assert beside.stopped.startswith(f"{ASKED}; {WEAK}, which the model has already")


def test_the_same_joints_by_another_name_are_the_same() -> None:
    joints = "+".join(ROBOT.motor_names)
    asked = [parse(ROBOT, "viscous_friction@all_joints"), parse(ROBOT, f"viscous_friction@{joints}")]
    found = improve(Linear(()), POOL, wanted=asked)
    assert [t.name for t in found.terms] == ["viscous_friction@all_joints"]


def test_a_twin_is_called_tied() -> None:
    first = improve(Twins(HIDDEN[:1]), POOL).ladder[1]
    assert {first.name, *first.tied_with} == {WEAK, GAIN}


def test_an_effect_that_is_worse_beyond_doubt_is_not_tied() -> None:
    problem = Twins(HIDDEN[:1])
    problem.unlike = 1.0
    problem.data = np.random.default_rng(0).standard_normal(len(problem.data)) + problem.shift(HIDDEN[:1])
    first = improve(problem, POOL).ladder[1]
    assert first.name == WEAK and not first.tied_with


def test_a_step_that_a_later_one_makes_useless_is_dropped() -> None:
    found = improve(StandIn(HIDDEN), POOL)
    assert found.ladder[1].name == GAIN, "it explains most at once"
    assert {t.name for t in found.terms} == {WEAK, JAM}
    assert [d for r in found.ladder for d in r.dropped] == [GAIN]
    assert found.ladder[-1].error_heldout == pytest.approx(1.0, abs=0.1)


def test_a_robot_with_nothing_wrong_is_left_as_it_is() -> None:
    found = improve(Linear(()), POOL)
    assert found.verdict == NOTHING_MISSING and found.terms == () and len(found.ladder) == 1


def test_what_no_effect_explains_is_unexplained_and_half_of_it_better() -> None:
    alone = improve(Linear((), extra=1.0), POOL)
    assert alone.verdict == UNEXPLAINED and alone.left and alone.terms == ()
    beside = improve(Linear(HIDDEN, extra=1.0), POOL)
    assert beside.verdict == BETTER and beside.left
    assert {t.name for t in beside.terms} == {WEAK, JAM}


def test_where_more_than_noise_is_left_other_motions_are_held_out() -> None:
    calm = improve(Linear(HIDDEN, motions=4), POOL)
    assert calm.ladder[-1].held_out == WINDOWS
    messy = improve(Linear(HIDDEN, extra=2.0, motions=4), POOL)
    assert messy.ladder[1].held_out == MOTIONS


def test_an_effect_that_takes_little_of_a_large_misfit_is_not_worth_a_term() -> None:
    small = (term("motor_weak", "knee_front_left", loss=0.15),)
    asked = improve(Linear(small, motions=4), POOL)
    assert [t.name for t in asked.terms] == [WEAK], "where nothing else is wrong it is found"
    found = improve(Linear(small, extra=4.0, motions=4), POOL)
    assert found.terms == () and found.verdict == UNEXPLAINED
    assert found.last is not None
    assert next(j for j in found.last.judged if j.name == WEAK).why_not == TOO_LITTLE


def test_what_was_fitted_to_one_motion_only_does_not_travel() -> None:
    # A pattern that an effect has in the first motion, and its opposite in the others.
    class Fickle(Linear):
        def shift(self, hypothesis: Hypothesis) -> Array:
            return super().shift(hypothesis) * np.where(self.trial_of % 2, -1.0, 1.0)

    problem = Fickle((), extra=2.0, motions=4)
    problem.data = problem.data + Linear.shift(problem, HIDDEN[:1])
    found = improve(problem, POOL)
    assert WEAK not in {t.name for t in found.terms}


@pytest.mark.parametrize(
    ("name", "value", "expected"), [(WEAK, "loss", False), ("coulomb_friction@knee_front_left", "torque_nm", True)]
)
def test_one_motion_is_weak_evidence_for_what_a_robot_in_order_does_not_have(
    name: str, value: str, expected: bool
) -> None:
    # Each takes a fifth of what is above the noise, in every window of the only motion.
    effect, joint = name.split("@")
    found = improve(Linear((term(effect, joint, **{value: 0.47}),), extra=4.0), [parse(ROBOT, name)])
    assert bool(found.terms) is expected
    assert found.last is not None and (expected or found.last.judged[0].why_not == TOO_LITTLE_ALONE)


@pytest.mark.parametrize(("energy", "better"), [(50.0, True), (190.0, False)])
def test_a_model_made_elsewhere_may_be_right_as_it_was(
    monkeypatch: pytest.MonkeyPatch, energy: float, better: bool
) -> None:
    before, as_it_is, refitted = HIDDEN[:1], np.full(100, 2.0), np.full(100, 1.5)
    search, seen = Search(Linear(())), []

    def kept(now: Search, *_: object) -> SimpleNamespace:
        seen.append(now.fixed)
        return SimpleNamespace(best=SimpleNamespace(held=np.array([energy])))

    monkeypatch.setattr("ee_dist.discrepancy.explain.examine", kept)
    found = SimpleNamespace(base=refitted, best=None)
    asked = as_it_was(search, found, before, as_it_is, POOL, STANDARD_EFFORT)  # type: ignore[arg-type]
    assert (asked is not None) is better and seen == [before]
    # Values that come from a calibration stay anyway, and where fitting anew did little there is nothing to choose.
    assert as_it_was(search.on(before), found, before, as_it_is, POOL, STANDARD_EFFORT) is None  # type: ignore[arg-type]
    assert as_it_was(search, found, before, refitted, POOL, STANDARD_EFFORT) is None  # type: ignore[arg-type]
