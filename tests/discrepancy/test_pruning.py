"""Pruning, and what counts as evidence where only some trials are searched."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from linear_problem import ROBOT, Linear

from ee_dist.discrepancy.evidence.holdout import WINDOWS, held_by_slopes, travelling
from ee_dist.discrepancy.evidence.intervals import half_widths
from ee_dist.discrepancy.examine import Current
from ee_dist.discrepancy.pruning import _luck, _may_cost, as_many, luck, pruned, without_these
from ee_dist.discrepancy.search.candidates import candidate
from ee_dist.discrepancy.search.fitted import Fit, Model
from ee_dist.discrepancy.search.search import Search
from ee_dist.discrepancy.search.valley import follow_valley
from ee_dist.discrepancy.told import told_only
from ee_dist.effects.catalogue import term

JOINTS = ROBOT.motor_names
MODEL = Model(tuple(candidate(ROBOT, "coulomb_friction", j) for j in JOINTS))


def fitted(search: Search) -> Fit:
    (fit,) = follow_valley(search, [(MODEL, np.zeros(len(JOINTS)))], search.everything, 1.0)
    return fit


def test_a_fit_stays_as_it_was_when_a_model_is_pruned_from_it() -> None:
    search = Search(Linear((term("coulomb_friction", JOINTS[0], torque_nm=0.3),), motions=4))
    fit = fitted(search)
    before = fit.u.copy()
    kept = pruned(search, fit, 0, 50, travelling(search.problem)[0])
    assert 0 < len(kept.parts) < len(JOINTS)
    assert np.array_equal(fit.u, before)


def test_what_held_out_data_want_stays_however_large_luck_is_taken_to_be(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where much is left at one joint, what it leaves counts as doubt about all that moves it."""
    monkeypatch.setattr("ee_dist.discrepancy.pruning._luck", lambda _, fit: np.full(int(fit.mask.sum()), 1e9))
    hidden = tuple(term("coulomb_friction", j, torque_nm=0.3) for j in JOINTS[:2])
    search = Search(Linear(hidden, motions=4))
    kept = pruned(search, fitted(search), 0, 50, travelling(search.problem)[0])
    assert {c.target for c in kept.parts} >= set(JOINTS[:2])


def test_trials_that_are_not_searched_are_no_evidence() -> None:
    problem = Linear((term("coulomb_friction", JOINTS[0], torque_nm=0.3),), motions=3)
    first = Search(problem, trials=(0,))
    assert first.everything.sum() == (problem.trial_of == 0).sum() < len(problem.trial_of)
    fit = fitted(first)
    (alone,) = follow_valley(Search(problem), [(MODEL, np.zeros(len(JOINTS)))], problem.trial_of == 0, 1.0)
    assert np.allclose(fit.u, alone.u, atol=1e-6)
    assert np.allclose(half_widths(problem, fit), half_widths(problem, alone), rtol=1e-6)
    assert first.within(first.everything) is first
    assert first.within(problem.trial_of == 0) is first
    assert Search(problem).within(problem.trial_of == 0).trials == (0,)


def test_what_one_channel_leaves_is_no_doubt_about_another() -> None:
    problem = Linear(())
    problem.data[problem.channel_of == 1] *= 30.0
    fit = fitted(Search(problem))
    luck = _luck(problem, fit)
    quiet, loud = (luck[problem.channel_of[fit.mask] == c] for c in (0, 1))
    assert np.ptp(quiet) == np.ptp(loud) == 0.0
    assert loud[0] > 50.0 * quiet[0]
    assert quiet[0] >= problem.floor.mean()


def test_what_the_readings_of_a_channel_leave_is_no_doubt_about_its_texture() -> None:
    """A noisy sensor is told by its texture, and its noise stays in what it reads."""
    problem = Linear(())
    texture = np.arange(len(problem.data)) % 8 == 0
    problem.layout = replace(problem.layout, reading=~texture)
    problem.data[~texture] *= 30.0
    fit = fitted(Search(problem))
    luck = _luck(problem, fit)[texture[fit.mask]]
    assert luck.max() < 50.0 * problem.floor.mean() < _luck(problem, fit).max()


def test_what_goes_is_made_up_for_as_a_fit_without_it_would() -> None:
    """Where slopes are straight, what they foretell of a smaller model is its fit."""
    search = Search(Linear((term("coulomb_friction", JOINTS[0], torque_nm=0.1),), motions=4))
    foretold = without_these(fitted(search), [1, 2])
    less = Model(tuple(c for k, c in enumerate(MODEL.parts) if k not in (1, 2)))
    (anew,) = follow_valley(search, [(less, np.zeros(len(less.parts)))], search.everything, 1.0)
    assert foretold.model.parts == less.parts
    assert np.allclose(foretold.u, anew.u, atol=1e-3)
    assert np.allclose(foretold.residual, anew.residual, atol=0.05)
    assert np.allclose(half_widths(search.problem, foretold), half_widths(search.problem, anew), rtol=0.05)


def test_terms_that_nothing_speaks_for_leave_the_model_all_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[int] = []
    monkeypatch.setattr(
        "ee_dist.discrepancy.told.follow_valley",
        lambda *a, **k: asked.append(len(a[1][0][1])) or follow_valley(*a, **k),
    )
    search = Search(Linear((term("coulomb_friction", JOINTS[0], torque_nm=0.3),), motions=4))
    told = told_only(search, Current(MODEL.parts, fitted(search).u), 0, travelling(search.problem)[0], 50)
    kept, gone = told.then, told.gone
    assert kept.parts[0] is MODEL.parts[0]
    assert set(gone) == {c.name for c in MODEL.parts} - {c.name for c in kept.parts}
    assert len(gone) >= 4 and sum(n > 0 for n in asked) <= 3, "one fit each would be as many as there are terms"


@pytest.mark.parametrize(
    ("rises", "go"),
    [
        ({1: 1.5}, 0),
        ({1: 0.5}, 1),
        ({20: 2.0, 10: 1.5, 5: 0.1, 2: 0.1, 1: 0.0}, 20),
        ({20: 3.0, 10: 2.0, 5: 0.1, 2: 0.1, 1: 0.0}, 10),
        ({4: 3.0, 2: 2.1, 1: 0.1}, 1),
    ],
)  # fmt: skip
def test_far_from_the_noise_each_term_that_goes_may_cost_luck(monkeypatch, rises, go) -> None:
    """One that nothing but held-out data tells stays where they tell it: a joint's error doubled without its rotor. ``rises``: of
    held-out energy, in units of luck, by how many go; together they may cost a twentieth of what is above the noise."""
    problem = Linear((term("coulomb_friction", JOINTS[0], torque_nm=0.3),), motions=4)
    cut, energy = travelling(problem)[0], 20.0 * float(problem.floor.sum())
    chance = luck(problem, energy, 50)
    assert 2.1 * chance < 0.05 * (energy - float(problem.floor.sum())) < 2.5 * chance
    held = {0: energy} | {n: energy + rise * chance for n, rise in rises.items()}
    monkeypatch.setattr(
        "ee_dist.discrepancy.pruning.held_by_slopes",
        lambda _search, fits, _cut: [SimpleNamespace(energy=held[f]) for f in fits],
    )
    monkeypatch.setattr("ee_dist.discrepancy.pruning._fits_as_well", lambda _whole, _without: True)
    monkeypatch.setattr("ee_dist.discrepancy.pruning.may_reach", lambda _fit, _most: True)
    assert as_many(Search(problem), 0, {n: n for n in rises}, cut, 50) == go  # type: ignore[arg-type, dict-item]


@pytest.mark.parametrize(("values", "share"), [(80, 0.25), (20_000, 0.08)])
def test_of_few_values_what_goes_may_not_take_the_model_along(values: int, share: float) -> None:
    """Eight terms that luck may tell cost what it does once, or a fifth of all that is left: eight times that of eighty
    values would be three times the error."""
    problem = SimpleNamespace(floor=np.ones(values))
    energy = 4.0 * values
    most = _may_cost(problem, energy, SimpleNamespace(name=WINDOWS), 100, 8, True)
    assert luck(problem, energy, 100, 1.0) <= most <= share * energy
    assert most <= 8 * luck(problem, energy, 100, 1.0)


def test_what_is_told_together_stays_though_nothing_held_out_speaks_for_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fitted to one motion alone many values foretell the other badly, and yet both are fitted by them and not without."""
    problem = Linear((term("coulomb_friction", JOINTS[0], torque_nm=0.3),), motions=2)
    monkeypatch.setattr(
        "ee_dist.discrepancy.pruning.held_by_slopes", lambda _s, fits, _c: [SimpleNamespace(energy=1.0) for _ in fits]
    )
    part = np.array([True, False])
    whole, close, far = (SimpleNamespace(energy=e, mask=part) for e in (100.0, 120.0, 290.0))
    cut = travelling(problem)[0]
    assert as_many(Search(problem), whole, {6: far, 3: close, 1: whole}, cut, 50) == 3  # type: ignore[arg-type, dict-item]
    assert as_many(Search(problem), whole, {6: far}, cut, 50) == 0  # type: ignore[arg-type, dict-item]


def test_what_leaves_more_of_all_data_than_may_be_left_of_those_held_out_is_not_asked(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Values that have not seen a piece foretell it no better than those of a fit that has, so that such a model need not be
    fitted in every turn."""
    problem = Linear((term("coulomb_friction", JOINTS[0], torque_nm=0.3),), motions=4)
    cut, asked = travelling(problem)[0], []
    every = np.ones(3, dtype=bool)
    whole, close, far = (SimpleNamespace(energy=e, mask=every) for e in (100.0, 105.0, 1e6))

    def held(_search: Search, fits: list, _cut: object) -> list:
        asked.extend(fits)
        return [SimpleNamespace(energy=110.0) for _ in fits]

    monkeypatch.setattr("ee_dist.discrepancy.pruning.held_by_slopes", held)
    assert as_many(Search(problem), whole, {6: far, 3: close, 1: whole}, cut, 50) == 3  # type: ignore[arg-type, dict-item]
    assert asked[0] is whole and close in asked and far not in asked
    seldom = SimpleNamespace(energy=1e6, mask=np.array([True, False, True]))
    assert as_many(Search(problem), whole, {6: seldom}, cut, 50) == 6, "of some of the data it says nothing"  # type: ignore[arg-type, dict-item]


def test_what_is_held_out_is_foretold_no_better_than_by_a_fit_that_has_seen_it() -> None:
    search = Search(Linear((term("coulomb_friction", JOINTS[0], torque_nm=0.3),), motions=4))
    fit = fitted(search)
    assert fit.mask.all()
    (held,) = held_by_slopes(search, [fit], travelling(search.problem)[0])
    assert held.energy >= fit.energy * (1 - 1e-9)
