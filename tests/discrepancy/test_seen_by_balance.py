"""A balance of forces is asked for nothing that it cannot see, and nothing that only simulation minds bounds its answers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from way_samples import measure, problem_by, samples

from ee_dist.discrepancy.examine import Effort
from ee_dist.discrepancy.explain import explain
from ee_dist.discrepancy.problem import Problem
from ee_dist.discrepancy.search.fitted import Model
from ee_dist.discrepancy.search.pool import pool_of
from ee_dist.effects.catalogue import term

QUICK = Effort(first=6, second=4, final=3, starts=1)
CONTROLLERS = {
    "position_gain",
    "speed_gain",
    "torque_limit",
    "command_gain",
    "command_delay",
    "zero_offset",
    "deadband",
    "command_speed",
    "command_acceleration",
    "command_duration",
}


@cache
def guessed(way: str, fields: Sequence[str] = ("kp", "kd", "rotor_inertia")) -> Problem:
    """The arm with dry friction at both joints, by a description that guessed at everything about its drives, rotors too."""
    sample = samples()["arm"]
    hidden = tuple(term("coulomb_friction", j, torque_nm=0.3) for j in sample.robot.motor_names)
    drives = tuple(
        replace(d, kp=10 * d.kp, rotor_inertia=3 * k * d.rotor_inertia)
        for k, d in enumerate(sample.robot.drives, start=2)
    )
    assumed = tuple((d.joint, f) for d in drives for f in fields)
    return problem_by(way, measure(sample, hidden), replace(sample.robot, drives=drives, assumed=assumed))


def test_everything_that_a_balance_is_asked_for_changes_what_it_leaves() -> None:
    problem = guessed("force_balance")
    pool = pool_of(problem)
    models = [(c, Model((c,))) for c in pool]
    asked = [m.hypothesis(np.array(u)) for _, m in models for u in (m.lower, m.upper)]
    left = problem.residuals([(), *asked])
    changed = np.abs(np.nan_to_num(left[1:] - left[0], posinf=1.0)).max(axis=1).reshape(-1, 2).max(axis=1)
    assert not [c.name for c, by in zip(pool, changed, strict=True) if by == 0]
    assert not {c.effect.name for c in pool} & CONTROLLERS
    assert {"rotor_factor", "coulomb_friction", "part_mass", "parallel_spring"} <= {c.effect.name for c in pool}


def test_a_simulation_is_still_asked_for_its_controllers() -> None:
    assert {c.effect.name for c in pool_of(guessed("open_loop"))} >= CONTROLLERS


def test_a_controller_that_would_shake_does_not_keep_a_rotor_heavy_where_nothing_is_simulated() -> None:
    least = {
        (way, fields): next(c for c in pool_of(guessed(way, fields)) if c.effect.name == "rotor_factor").bounds[0][0]
        for way in ("open_loop", "force_balance")
        for fields in (("rotor_inertia",), ("kp", "kd", "rotor_inertia"))
    }
    assert least["force_balance", ("rotor_inertia",)] == pytest.approx(0.02)
    assert least["open_loop", ("rotor_inertia",)] > 0.3
    # Where gains were guessed too, both may be as far off.
    assert [v for (_, fields), v in least.items() if "kp" in fields] == pytest.approx([0.02, 0.02])


def test_a_verdict_on_forces_names_no_gains_of_a_controller() -> None:
    problem = guessed("force_balance")
    found = explain(problem, pool_of(problem), effort=QUICK)
    assert found.best is not None
    named = {t.effect for t in found.best.terms}
    assert "coulomb_friction" in named or "rotor_factor" in named
    assert not named & CONTROLLERS


def test_a_measured_force_has_had_its_back_emf_taken_off() -> None:
    sample = samples()["pendulum"]
    trials = measure(sample, ())
    asked = {way: {c.effect.name for c in pool_of(problem_by(way, trials, sample.robot))} for way in sample.ways}
    assert "speed_limit" in asked["open_loop"] and "speed_limit" not in asked["force_balance"]
