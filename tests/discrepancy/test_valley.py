"""Descents with many values: what is asked for between slopes, and when a descent ends."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from linear_problem import ROBOT, Linear

from ee_dist.discrepancy.search import valley
from ee_dist.discrepancy.search.candidates import candidate, candidates
from ee_dist.discrepancy.search.fitted import Model
from ee_dist.discrepancy.search.search import Search
from ee_dist.discrepancy.search.trials import telling_values
from ee_dist.discrepancy.search.valley import (
    BEHIND,
    DAMPINGS,
    NARROWEST,
    SHORTEST,
    _correct,
    _give_up,
    _next,
    _Run,
    follow_valley,
)
from ee_dist.effects.catalogue import Hypothesis
from ee_dist.trials.log import Array

JOINTS = ROBOT.motor_names
MODEL = Model(tuple(candidate(ROBOT, "viscous_friction", j) for j in JOINTS))
P = len(JOINTS)
BEND = 3.0


class Bent(Linear):
    """Marks that grow with the square of their values beside them, so that slopes change on the way."""

    asked = 0

    def residuals(self, hypotheses: Sequence[Hypothesis], trials: Sequence[int] | None = None) -> Array:
        self.asked += len(hypotheses)
        rows = [self.data - x - BEND * x**2 for x in (self.shift(h) for h in hypotheses)]
        return np.stack(rows)


def bent(u: Array) -> Bent:
    problem = Bent(())
    shift = problem.shift(MODEL.hypothesis(u))
    problem.data += shift + BEND * shift**2
    return problem


def test_slopes_are_corrected_by_the_step_that_they_led_to() -> None:
    """Broyden's condition: along the step they say what it showed, and across it what they said before."""
    rng = np.random.default_rng(0)
    problem = Linear(())
    search = Search(problem)
    mask, before = search.everything, rng.uniform(-0.1, 0.1, P)
    run = _Run(MODEL, before + rng.uniform(-0.1, 0.1, P), 0.1, problem.data)
    run.slopes = old = rng.standard_normal((len(problem.data), P))
    run.smooth, run.before = rng.standard_normal(len(problem.data)), (1.0, before)
    was, step = run.smooth, run.u - before
    _correct(run, search, mask)
    assert np.allclose(run.slopes @ step, problem.data - was)
    across = rng.standard_normal(P)
    weights = (old**2).sum(axis=0)
    across -= step * (weights * step @ across) / (weights * step @ step)
    assert np.allclose(run.slopes @ across, old @ across)


def test_slopes_are_taken_less_often_where_steps_between_them_pay(monkeypatch: pytest.MonkeyPatch) -> None:
    truth = np.random.default_rng(1).uniform(0.5, 0.9, P)
    taken: list[int] = []
    slopes = valley._slopes
    monkeypatch.setattr(valley, "_slopes", lambda runs, *a: taken.append(len(runs)) or slopes(runs, *a))
    found = {}
    for followed in (0, 3):
        monkeypatch.setattr(valley, "FOLLOWED", followed)
        taken.clear()
        search = Search(bent(truth))
        (fit,) = follow_valley(search, [(MODEL, np.zeros(P))], search.everything)
        found[followed] = sum(taken), fit.energy
        assert np.abs(fit.u - truth).max() < 0.1
    assert found[3][0] < found[0][0]
    assert found[3][1] < 1.01 * found[0][1]


def _run(energy: float, before: float, width: float = 0.12, followed: int = 0) -> _Run:
    return _Run(
        MODEL, np.zeros(P), width, np.zeros(1), energy, before=(before, np.zeros(P)), rounds=1, followed=followed
    )


def test_a_descent_narrows_step_by_step_near_the_noise_and_at_once_far_from_it() -> None:
    near, far = _run(1.0, 1.0), _run(100.0, 100.0)
    for run in (near, far):
        _next(run, 10.0, False, True)
    assert near.width == 0.06 and far.width == NARROWEST
    assert not (near.done or far.done), "the narrowest slopes decide"
    _next(far, 10.0, False, True)
    assert far.done


def test_a_settled_descent_tries_its_slopes_with_shorter_steps_before_it_ends() -> None:
    """Off the end of a range, or where it bends, the first steps lead nowhere, and shorter ones do."""
    stuck = _run(100.0, 100.0)
    _next(stuck, 10.0, True, True)
    assert stuck.again and not stuck.done and not stuck.followed
    stuck.damping = SHORTEST
    _next(stuck, 10.0, True, True)
    assert stuck.done and not stuck.again
    better = _run(99.9, 100.0)
    _next(better, 10.0, True, True)
    assert better.done and not better.again, "a step that takes next to nothing ends it as before"


def test_what_pays_is_followed_while_slopes_may_be_taken_again() -> None:
    assert [_after(_run(0.9, 1.0), True), _after(_run(0.9, 1.0), False)] == [1, 0]
    assert [_after(_run(0.9, 1.0, followed=k), True) for k in (1, 2, 3)] == [2, 3, 0]
    assert _after(_run(0.99, 1.0), True) == 0


def _after(run: _Run, more: bool) -> int:
    _next(run, 10.0, False, more)
    return run.followed


def test_a_descent_that_stands_still_far_above_another_is_given_up() -> None:
    best, still, going = _run(1.0, 1.0), _run(2.5, 2.5), _run(2.5, 5.0)
    for run in (best, still, going):
        _next(run, 10.0, False, True)
    _give_up([best, still, going])
    assert (best.done, still.done, going.done) == (False, True, False)
    near = _run(0.99 / BEHIND, 0.99 / BEHIND)
    _next(near, 10.0, False, True)
    _give_up([best, near])
    assert not near.done


def test_heats_are_on_the_trial_that_tells_and_on_all_where_none_does() -> None:
    problem = Linear((), motions=2)
    everything = np.ones(len(problem.data), dtype=bool)
    assert telling_values(problem, problem.data, everything).all()
    loud = problem.data.copy()
    loud[problem.trial_of == 1] *= 30.0
    assert np.array_equal(telling_values(problem, loud, everything), problem.trial_of == 1)
    first = problem.trial_of == 0
    assert np.array_equal(telling_values(problem, loud, first), first), "of the trials that are fitted"


def test_one_evaluation_serves_all_dampings() -> None:
    problem = bent(np.full(P, 0.5))
    search = Search(problem)
    follow_valley(search, [(MODEL, np.zeros(P))], search.everything, iterations=1)
    assert problem.asked == 1 + P + len(DAMPINGS) + 3


def test_first_slopes_by_values_that_all_starts_share_are_taken_once() -> None:
    """Descents that differ in their last effect alone, each at a value of its own, step as if each asked for itself,
    where slopes by the others do not change with it."""
    problem = Bent(())
    problem.data += problem.shift(MODEL.hypothesis(np.full(P, 0.2)))
    starts = [(MODEL, np.concatenate([np.full(P - 1, 0.1), [last]])) for last in (0.0, 0.02, 0.05)]
    asked, found = [], []
    for same in (0, P - 1):
        problem.asked = 0
        search = Search(problem)
        found.append(follow_valley(search, starts, search.everything, iterations=1, same=same))
        asked.append(problem.asked)
    steps = 3 * (1 + len(DAMPINGS))
    assert asked == [3 * P + steps, (1 + P - 1) + 3 + steps]
    before = [float((problem.residuals([MODEL.hypothesis(u)])[0] ** 2).sum()) for _, u in starts]
    for anew, once, was in zip(*found, before, strict=True):
        assert once.energy < was
        assert once.energy == pytest.approx(anew.energy, rel=0.05)


def test_what_has_no_values_of_its_own_may_be_beside_those_that_are_shared() -> None:
    lost = next(c for c in candidates(ROBOT) if not c.size)
    search = Search(bent(np.full(P, 0.5)))
    starts = [
        (Model((*MODEL.parts, c)), np.zeros(P + c.size)) for c in (lost, candidate(ROBOT, "zero_offset", JOINTS[0]))
    ]
    one, other = follow_valley(search, starts, search.everything, iterations=1, same=P)
    assert one.slopes.shape[1] == P and other.slopes.shape[1] == P + 1


def test_steps_by_corrected_slopes_may_be_the_last_where_only_values_are_wanted() -> None:
    truth, energies = np.random.default_rng(1).uniform(0.5, 0.9, P), []
    for only in (False, True):
        search = Search(bent(truth))
        (fit,) = follow_valley(search, [(MODEL, np.zeros(P))], search.everything, iterations=1, values_only=only)
        energies.append(fit.energy)
    assert energies[1] < energies[0]


def test_slopes_go_finer_in_the_end_where_the_narrowest_step_changes_more_than_is_left() -> None:
    """A play known to a thousandth of a radian is not told by slopes over two; what the data tell less keeps its step."""
    search = Search(Linear(()))
    mask, rows = search.everything, len(search.everything)
    run = _Run(MODEL, np.zeros(P), NARROWEST, search.problem.data, 100.0)
    run.smooth, run.weights = np.full(rows, 10.0 / np.sqrt(rows)), np.ones(rows)
    slopes = np.random.default_rng(0).standard_normal((rows, P))
    run.slopes = slopes / np.linalg.norm(slopes, axis=0) * np.array([1e5, *[1.0] * (P - 1)])
    run.before = (100.0, run.u)
    _next(run, 0.0, False, True)
    assert not run.done and run.reach is not None
    assert run.reach[0] == pytest.approx(max(10.0 / 1e5, valley.FINEST * NARROWEST))
    assert (run.reach[1:] >= NARROWEST).all()
    asked: list[Array] = []

    class Asked(Linear):
        def residuals(self, hypotheses: Sequence[Hypothesis], trials: Sequence[int] | None = None) -> Array:
            asked.extend(np.array([dict(t.values)["damping_nm_s_rad"] for t in h]) for h in hypotheses)
            return super().residuals(hypotheses, trials)

    valley._slopes([run], Search(Asked(())), mask)
    steps = np.array([u[k] for k, u in enumerate(asked)]) / [MODEL.parts[k].bounds[0][1] for k in range(P)]
    assert steps[0] == pytest.approx(run.reach[0]) and steps[1] == pytest.approx(0.2 * NARROWEST)
    # Where that brings nothing either it ends.
    run.before = (100.0, run.u)
    _next(run, 0.0, False, True)
    assert run.done


def test_slopes_stay_as_they_are_where_no_step_changes_as_much_as_is_left() -> None:
    rows = len(Search(Linear(())).everything)
    run = _Run(MODEL, np.zeros(P), NARROWEST, np.zeros(rows), 100.0)
    run.smooth, run.weights, run.slopes = np.ones(rows), np.ones(rows), np.ones((rows, P))
    run.before = (100.0, run.u)
    _next(run, 0.0, False, True)
    assert run.done
