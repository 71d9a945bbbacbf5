"""A richer law gives way to the plainer one that data miss it for; friction by load is asked for where there is a load."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from way_samples import measure, problem_by, samples

from ee_dist.discrepancy.evidence.holdout import windows
from ee_dist.discrepancy.examine import Current
from ee_dist.discrepancy.exchanges import strictest
from ee_dist.discrepancy.plainer import in_plain_terms
from ee_dist.discrepancy.problem import Problem
from ee_dist.discrepancy.search.candidates import candidate
from ee_dist.discrepancy.search.fit import fit_one
from ee_dist.discrepancy.search.fitted import Model
from ee_dist.discrepancy.search.pool import pool_of
from ee_dist.discrepancy.search.search import Search
from ee_dist.discrepancy.ways.free_run.pieces import spared, thinned
from ee_dist.discrepancy.ways.free_run.problem import FreeRun
from ee_dist.effects.catalogue import CATALOGUE, Hypothesis, term
from ee_dist.robots.model import Robot


def balance(hidden: Hypothesis, robot: Robot | None = None) -> Problem:
    sample = samples()["arm"]
    return problem_by("force_balance", measure(sample, hidden, seed=3), robot or sample.robot)


def with_effect(problem: Problem, name: str) -> Current:
    """The model with an effect at the second joint, fitted."""
    c = candidate(problem.robot, name, problem.robot.motor_names[1])
    fit = fit_one(Search(problem), Model((c,)), [np.full(c.size, 0.3)])
    return Current(fit.model.parts, fit.u)


@pytest.mark.parametrize(("rich", "hidden", "stays"), [
    ("parallel_spring", ("offset_torque", {"torque_nm": 0.3}), False),
    ("parallel_spring", ("parallel_spring", {"stiffness_nm_rad": 1.5, "rest_rad": 0.1}), True),
    ("stribeck_friction", ("coulomb_friction", {"torque_nm": 0.3}), False),
])  # fmt: skip
def test_a_richer_law_stays_where_its_second_number_is_worth_something(
    rich: str, hidden: tuple[str, dict[str, float]], stays: bool
) -> None:
    joint = samples()["arm"].robot.motor_names[1]
    problem = balance((term(hidden[0], joint, **hidden[1]),))
    found = in_plain_terms(Search(problem), with_effect(problem, rich), 0, pool_of(problem), strictest(problem))
    plain = CATALOGUE[rich].plainer
    assert [c.effect.name for c in found.then.parts] == [rich if stays else plain]
    assert found.gone == (() if stays else (f"{rich}@{joint}",)) and found.came == (
        () if stays else (f"{plain}@{joint}",)
    )
    if not stays:
        (one,) = found.then.hypothesis
        assert dict(one.values)["torque_nm"] == pytest.approx(hidden[1]["torque_nm"], rel=0.1)


def test_what_a_user_left_out_does_not_come_in_for_being_plainer() -> None:
    joint = samples()["arm"].robot.motor_names[1]
    problem = balance((term("offset_torque", joint, torque_nm=0.3),))
    pool = pool_of(problem, without=["offset_torque"])
    found = in_plain_terms(Search(problem), with_effect(problem, "parallel_spring"), 0, pool, windows(problem))
    assert not found.came and found.then.parts[0].effect.name == "parallel_spring"


def test_every_plainer_law_is_one_with_fewer_numbers() -> None:
    plainer = {name: CATALOGUE[e.plainer] for name, e in CATALOGUE.items() if e.plainer}
    assert plainer
    for name, plain in plainer.items():
        assert len(plain.parameters) < len(CATALOGUE[name].parameters) and not plain.plainer


def test_friction_by_load_is_asked_for_where_there_is_load() -> None:
    robot = samples()["arm"].robot
    dry = (term("coulomb_friction", "all_joints", torque_nm=0.3),)
    by_load = {"load_friction", "backdrive_friction", "quadratic_friction", "load_stribeck_friction"}

    def asked(described: Robot) -> set[str]:
        return {c.effect.name for c in pool_of(balance(dry, described))} & by_load

    assert asked(robot) == by_load
    light = tuple(
        replace(p, mass_kg=1e-3 * p.mass_kg, inertia_kg_m2=tuple(1e-3 * v for v in p.inertia_kg_m2))
        for p in robot.parts
    )
    unloaded = replace(robot, parts=light)
    assert asked(unloaded) == set()
    names = {c.effect.name for c in pool_of(balance(dry, unloaded))}
    assert {"coulomb_friction", "viscous_friction", "rotor_inertia"} <= names


def test_a_rotor_is_looked_for_far_beyond_its_link_where_forces_are_measured() -> None:
    sample = samples()["arm"]
    bare = replace(sample.robot, drives=tuple(replace(d, rotor_inertia=0.0) for d in sample.robot.drives))
    most = {
        way: next(
            c
            for c in pool_of(problem_by(way, measure(sample, ()), bare))
            if c.name == f"rotor_inertia@{bare.motor_names[1]}"
        ).bounds[0][1]
        for way in ("force_balance", "open_loop")
    }
    assert most["force_balance"] == pytest.approx(100 * most["open_loop"])


def test_a_search_simulates_some_windows_of_a_long_record_in_fine_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    sample = samples()["arm"]
    trials = measure(sample, (term("coulomb_friction", "all_joints", torque_nm=0.2),))
    whole = problem_by("free_run", trials, sample.robot)
    assert isinstance(whole, FreeRun)
    windows_of = whole.searched
    assert windows_of.one_in == 1 and not any("one in" in line for line in windows_of.notes)
    monkeypatch.setattr("ee_dist.discrepancy.ways.free_run.pieces.MOST_STEPS", 400)
    monkeypatch.setattr("ee_dist.discrepancy.ways.free_run.pieces.FEWEST", 2)
    fewer = problem_by("free_run", trials, sample.robot).searched
    assert isinstance(fewer, FreeRun) and fewer.one_in > 1
    assert {p.trial for p in fewer.pieces} == {p.trial for p in windows_of.pieces}
    assert len(fewer.pieces) < len(windows_of.pieces)
    assert any(f"one in {fewer.one_in} of the windows" in line for line in fewer.notes)
    np.testing.assert_array_equal(fewer.noise, windows_of.noise)


def test_windows_are_thinned_in_each_trial_and_never_below_the_fewest() -> None:
    class Window:
        def __init__(self, trial: int, at: int) -> None:
            self.trial, self.at, self.log = trial, at, range(10_000)

    many = [Window(k, i) for k in (0, 1) for i in range(20)]
    assert spared(many) == 3  # type: ignore[arg-type]
    kept = thinned(many, 3)  # type: ignore[arg-type]
    for k in (0, 1):
        at = [w.at for w in kept if w.trial == k]  # type: ignore[attr-defined]
        assert len(at) == 7 and at == sorted(at) and len(set(np.diff(at))) > 1, "of no period"
    assert spared(many[:1]) == 1  # type: ignore[arg-type]
