"""Several values that do together what one other effect does."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from linear_problem import PER, ROBOT, SEGMENTS, Linear
from way_samples import Sample, measure, problem_by

from ee_dist.discrepancy.accounts.of_improve import improve_account
from ee_dist.discrepancy.evidence.holdout import HeldOut, cross_fit, windows
from ee_dist.discrepancy.examine import Current
from ee_dist.discrepancy.exchanges import nearest
from ee_dist.discrepancy.improve import improve
from ee_dist.discrepancy.instead import instead_of
from ee_dist.discrepancy.problem import Problem
from ee_dist.discrepancy.search.candidates import Candidate, candidate
from ee_dist.discrepancy.search.fit import fit_one
from ee_dist.discrepancy.search.fitted import Model
from ee_dist.discrepancy.search.search import Search
from ee_dist.effects.catalogue import Hypothesis, term
from ee_dist.robots.servo_pendulum import servo_pendulum
from ee_dist.trials.excitation import Excitation
from ee_dist.trials.log import Array
from ee_dist.trials.noise import with_noise

JOINT = ROBOT.motor_names[0]
WEAK = candidate(ROBOT, "motor_weak", JOINT)
KINDS = ("coulomb_friction", "viscous_friction", "rotor_inertia")
THREE = tuple(candidate(ROBOT, name, JOINT) for name in KINDS)
OTHER = candidate(ROBOT, "payload", ROBOT.parts[1].name)


class Alike(Linear):
    """A weak motor leaves the marks of three other effects at once, each at 0.8 of its range for a motor that is gone."""

    def shift(self, hypothesis: Hypothesis) -> Array:
        total = np.zeros(SEGMENTS * PER)
        for t in hypothesis:
            if t.effect == "motor_weak":
                parts = [c.term([0.8 * t.values[0][1]]) for c in THREE]
            else:
                parts = [t]
            for part in parts:
                c = next(c for c in (*THREE, WEAK, OTHER) if c.effect.name == part.effect)
                key = sum(map(ord, part.effect))
                size = float(np.abs(c.shares(dict(part.values))).max())
                total = total + 5.0 * size * np.random.default_rng(key).standard_normal(len(total))
        return total


def fitted(problem: Problem, parts: tuple[Candidate, ...]) -> tuple[Search, Current]:
    search = Search(problem)
    fit = fit_one(search, Model(parts), [np.full(sum(c.size for c in parts), 0.2)])
    return search, Current(parts, fit.u)


def test_one_effect_that_does_what_three_do_is_nearer() -> None:
    search, current = fitted(Alike((term("motor_weak", JOINT, loss=0.6),)), THREE)
    found = instead_of(search, current, 0, [*THREE, WEAK, OTHER])
    assert found and all(i.comes.name == WEAK.name and i.nearer for i in found)
    changed, twins, step = nearest(search, current, 0, [*THREE, WEAK, OTHER])
    values = {t.name: t.values[0][1] for t in changed.hypothesis}
    assert values[WEAK.name] == pytest.approx(0.6, abs=0.05)
    assert step is not None and [t.name for t in step.added] == [WEAK.name]
    (twin,) = twins
    assert twin.name == WEAK.name and [twin.term.name] == list(step.dropped)
    assert twin.terms == current.hypothesis


def test_what_is_nearer_and_foretells_worse_is_neither_taken_nor_told_as_a_twin(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """As well on what was fitted, and not on what was held out."""
    search, current = fitted(Alike((term("motor_weak", JOINT, loss=0.6),)), THREE)

    def held_out(search: Search, models: Sequence[tuple[Model, Array]], *_: object, **more: object) -> list[HeldOut]:
        found = cross_fit(search, models, windows(search.problem))
        return [
            replace(h, residual=h.residual * (1.3 if WEAK in m.parts else 1.0))
            for h, (m, _) in zip(found, models, strict=True)
        ]

    monkeypatch.setattr("ee_dist.discrepancy.exchanges.cross_fit", held_out)
    kept, twins, step = nearest(search, current, 0, [*THREE, WEAK, OTHER])
    assert kept is current and twins == [] and step is None


def test_what_three_effects_do_is_not_said_to_be_one_that_would_be_farther() -> None:
    search, current = fitted(Alike((THREE[0].term([0.3]),)), THREE)
    assert instead_of(search, current, 0, [*THREE, WEAK, OTHER]) == []
    kept, twins, step = nearest(search, current, 0, [*THREE, WEAK, OTHER])
    assert kept is current and twins == [] and step is None


def test_a_mark_of_its_own_is_nobody_s_twin() -> None:
    search, current = fitted(Linear((term("motor_weak", JOINT, loss=0.5),)), (WEAK, THREE[0]))
    assert instead_of(search, current, 0, [*THREE, WEAK]) == []


def test_what_the_model_had_stays() -> None:
    search, current = fitted(Alike((term("motor_weak", JOINT, loss=0.6),)), THREE)
    assert instead_of(search, current, 3, [*THREE, WEAK]) == []


def test_the_account_says_it_with_the_values_that_follow() -> None:
    problem = Alike((term("motor_weak", JOINT, loss=0.6),), motions=4)
    found = improve(problem, [*THREE, WEAK])
    assert {t.name for t in found.terms} == {WEAK.name}
    assert found.twins == []
    assert improve_account(problem, found).good


def test_a_weak_pendulum_is_the_same_as_a_heavy_one() -> None:
    """All that a torque moves, larger by one factor, moves as with a torque that is smaller by it."""
    robot = with_noise(servo_pendulum(), 1e-4)
    servo, arm = robot.motor_names[0], robot.parts[1].name
    hidden = (term("motor_weak", servo, loss=0.5), term("coulomb_friction", servo, torque_nm=0.05))
    plan = tuple(Excitation(kind, 3.0, 0.5, k) for k, kind in enumerate(("multisine", "steps")))
    problem = problem_by("open_loop", measure(Sample(robot, plan, hidden, ()), hidden), robot)
    kinds = {"part_mass": arm, "rotor_inertia": servo, "viscous_friction": servo, "coulomb_friction": servo}
    heavy = tuple(candidate(robot, name, place) for name, place in kinds.items())
    search, current = fitted(problem, heavy)
    assert current.u @ current.u > 0.1
    found = instead_of(search, current, 0, [*heavy, candidate(robot, "motor_weak", servo)])
    assert found and all(i.comes.effect.name == "motor_weak" for i in found)
    # Twice the mass is no more unlikely than half the torque.
    assert not any(i.nearer for i in found)
    losses = [i.then.hypothesis[-1].values[0][1] for i in found]
    assert losses == pytest.approx([0.5] * len(found), abs=0.03)


def test_what_is_better_on_data_held_out_is_taken() -> None:
    """A search that was caught by three effects which stand in for one, where one of them does not quite do."""
    problem = Alike((WEAK.term([0.6]), OTHER.term([0.5, 0.0, 0.0, 0.0])), motions=4)
    search, current = fitted(problem, (*THREE[:2], OTHER))
    before = problem.residuals([current.hypothesis])[0]
    changed, twins, step = nearest(search, current, 0, [*THREE, WEAK, OTHER])
    assert twins == [] and step is not None and WEAK.name in {c.name for c in changed.parts}
    after = problem.residuals([changed.hypothesis])[0]
    assert after @ after < 0.5 * before @ before
