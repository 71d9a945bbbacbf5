"""Fits of precise data come down to the noise, and of explanations that are tied the fuller goes first where much is left."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from linear_problem import ROBOT, Linear

from ee_dist.discrepancy.evidence.holdout import HeldOut, travelling, windows
from ee_dist.discrepancy.evidence.judge import judge, ranked, surely_better
from ee_dist.discrepancy.search.candidates import Candidate, Proposal, candidate
from ee_dist.discrepancy.search.fit import fit_all
from ee_dist.discrepancy.search.fitted import Fit, Model
from ee_dist.discrepancy.search.search import Search
from ee_dist.effects.catalogue import Hypothesis, term
from ee_dist.trials.log import Array

WEAK = candidate(ROBOT, "motor_weak", "knee_front_left")
SPREAD, SOFTNESS = 4000.0, 3.0


class Precise(Linear):
    """Sensors so precise that a quarter of a value is thousands of standard deviations, and residuals softened beyond a few."""

    def residuals(self, hypotheses: Sequence[Hypothesis], trials: Sequence[int] | None = None) -> Array:
        bent = [np.tanh(self.shift(h) / 3.0) for h in hypotheses]
        return np.array([SOFTNESS * np.arcsinh((self.exact - SPREAD * b) / SOFTNESS) for b in bent])

    @property
    def exact(self) -> Array:
        noise = np.random.default_rng(3).standard_normal(len(self.data))
        return noise + SPREAD * np.tanh(self.shift((term("motor_weak", "knee_front_left", loss=0.4137),)) / 3.0)

    def smooth(self, residual: Array) -> Array:
        return np.asarray(SOFTNESS * np.sinh(residual / SOFTNESS))


def test_precise_data_are_fitted_down_to_their_noise() -> None:
    problem = Precise(())
    (fit,) = fit_all(Search(problem), [(Model((WEAK,)), np.array([0.1]))])
    assert dict(fit.hypothesis[0].values)["loss"] == pytest.approx(0.4137, abs=1e-4)
    assert fit.energy < 1.1 * problem.floor.sum()


def held_out(
    problem: Linear, residual: Array, whole: bool, parts: tuple[Candidate, ...] = (), at: float = 0.1
) -> HeldOut:
    cut = travelling(problem)[0] if whole else windows(problem)
    everywhere = np.ones(len(residual), dtype=bool)
    fit = Fit(Model(parts), np.full(len(parts), at), 1.0, residual, np.ones((len(residual), len(parts))), everywhere)
    return HeldOut(cut, residual, 1.0, (fit,))


def test_an_exchange_pays_as_much_as_a_new_effect_on_motions_that_were_not_fitted() -> None:
    problem = Linear((), motions=4)
    unit = np.sign(problem.data)
    before = held_out(problem, 10.0 * unit, True)
    little, much = (held_out(problem, size * unit, True) for size in (9.7, 7.0))
    assert not surely_better(problem, before, little, 100) and surely_better(problem, before, much, 100)
    uneven = np.where(problem.trial_of == 0, 17.0, 5.0) * unit
    assert not surely_better(problem, before, held_out(problem, uneven, True), 100), "one motion is far worse"
    near = [held_out(problem, size * unit, False) for size in (1.2, 1.0)]
    assert surely_better(problem, near[0], near[1], 10), "windows of one motion: more than luck is enough"
    assert surely_better(problem, near[0], near[1], 10, Proposal((WEAK,))), (
        "and of what comes, where only noise is left"
    )


@pytest.mark.parametrize(
    ("after", "effect", "better"),
    [
        (8.7, "motor_weak", False),
        (8.7, "coulomb_friction", True),
        (8.0, "motor_weak", True),
        (9.7, "coulomb_friction", False),
    ],
)
def test_of_a_single_motion_what_comes_in_anothers_place_is_worth_as_much_as_any(
    after: float, effect: str, better: bool
) -> None:
    """What a description leaves open a tenth of what is above the noise; a fault, or a weight that was not described, 30 %."""
    problem = Linear(())
    unit = np.sign(problem.data)
    one, other = (held_out(problem, size * unit, False) for size in (10.0, after))
    came = Proposal((candidate(ROBOT, effect, "knee_front_left"),))
    assert surely_better(problem, one, other, 100, came) is better
    assert surely_better(problem, one, other, 100), "of what was weighed before it is enough"


@pytest.mark.parametrize(
    ("fuller", "ends", "first"),
    [
        (6.0, (False, False), 2),
        (9.0, (False, False), 1),
        (9.0, (True, False), 2),
        (9.0, (True, True), 1),
        (9.5, (True, False), 1),
    ],
)
def test_the_same_law_with_a_further_term_goes_first_where_it_takes_a_fifth(
    fuller: float, ends: tuple[bool, bool], first: int
) -> None:
    """Or less than that, where the law alone ended as far as it may go, and with the term it does not."""
    problem = Linear((), motions=4)
    unit = np.sign(problem.data)
    dry, other = (candidate(ROBOT, "coulomb_friction", j) for j in ("knee_front_left", "hip_rear_left"))
    base, simple = 20.0 * unit, 10.0 * unit
    # One motion is worse with it, so that the two are tied.
    worse = np.where(problem.trial_of == 0, 12.0, fuller) * unit
    models = [Proposal((dry,)), Proposal((dry, other))]
    ((_, most),) = dry.bounds
    found = [
        judge(problem, base, held_out(problem, r, True, p.parts, most if end else 0.1), p, Model(p.parts), 10)
        for p, r, end in zip(models, (simple, worse), ends, strict=True)
    ]
    order = ranked(found)
    assert len(order[0].proposal.parts) == first
    assert order[0].tied_with == ([order[1].name] if first == 2 else []), "the same and more is no other explanation"


@pytest.mark.parametrize(
    ("alone", "both", "first"), [((9.0, 10.5), 8.4, 2), ((9.0, 10.5), 9.0, 1), ((13.0, 13.0), 8.4, 1)]
)
def test_of_two_laws_that_data_do_not_tell_apart_both_go_first_where_they_take_off_more(
    alone: tuple[float, float], both: float, first: int
) -> None:
    """By the tenth that any effect must: which of them it is would be drawn by lot. One that is surely the better goes first."""
    problem = Linear((), motions=4)
    unit = np.sign(problem.data)
    one, other = (candidate(ROBOT, "coulomb_friction", j) for j in ("knee_front_left", "hip_rear_left"))
    uneven = np.where(problem.trial_of == 0, 12.0, both) * unit
    found = [
        judge(problem, 20.0 * unit, held_out(problem, r, True, p.parts), p, Model(p.parts), 10)
        for p, r in (
            (Proposal((one,)), 10.0 * unit),
            (Proposal((other,)), np.where(problem.trial_of == 0, *alone) * unit),
            (Proposal((one, other)), uneven),
        )
    ]
    assert len(ranked(found)[0].proposal.parts) == first


@pytest.mark.parametrize(("alone", "first"), [(17.0, 2), (15.0, 1)])
def test_one_number_goes_before_two_that_it_is_tied_with_unless_they_take_off_twice_as_much(
    alone: float, first: int
) -> None:
    """Of few motions an interval holds nearly anything: a pendulum that rubs was told to be heavier."""
    problem = Linear((), motions=4)
    unit = np.sign(problem.data)
    one, *two = (candidate(ROBOT, e, j) for e, j in (
        ("motor_weak", "knee_front_left"), ("coulomb_friction", "knee_front_left"), ("coulomb_friction", "hip_rear_left")
    ))  # fmt: skip
    uneven = np.where(problem.trial_of == 0, 20.0, 9.0) * unit
    models = [Proposal((one,)), Proposal(tuple(two))]
    found = [
        judge(problem, 20.0 * unit, held_out(problem, r, True, p.parts), p, Model(p.parts), 10)
        for p, r in zip(models, (alone * unit, uneven), strict=True)
    ]
    order = ranked(found)
    assert len(order[0].proposal.parts) == first and order[0].tied_with == [order[1].name]
