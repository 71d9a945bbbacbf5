"""A robot that is a little wrong everywhere, and one in which something stands out beside that."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from way_samples import measured, problem_by, samples

from ee_dist.discrepancy.accounts.of_improve import rivals
from ee_dist.discrepancy.contenders import with_others_for
from ee_dist.discrepancy.everywhere import _Look, everywhere, looked_for_at_once
from ee_dist.discrepancy.evidence.holdout import travelling, windows
from ee_dist.discrepancy.examine import Current
from ee_dist.discrepancy.improve import improve
from ee_dist.discrepancy.kinds import Kept, Steps, luck
from ee_dist.discrepancy.problem import Layout, Problem, error
from ee_dist.discrepancy.pruning import pruned
from ee_dist.discrepancy.search.candidates import Candidate, candidate
from ee_dist.discrepancy.search.fitted import Model
from ee_dist.discrepancy.search.pool import pool_of as candidates_of
from ee_dist.discrepancy.search.race import race
from ee_dist.discrepancy.search.search import Search
from ee_dist.discrepancy.search.valley import follow_valley
from ee_dist.discrepancy.told import told_only
from ee_dist.effects.catalogue import Hypothesis
from ee_dist.robots.describe import load_robot
from ee_dist.trials.log import SensorLog

ROWS, TRIALS, NOISE = 240, 3, 0.1
PLAIN = ("coulomb_friction", "viscous_friction", "zero_offset", "command_gain", "part_mass")
OTHER = ("backdrive_friction", "load_friction", "torque_limit", "motor_weak")


class Curved(Problem):
    """A linear mixture of what every effect does, then bent: no simulation, but values that stand in for one another."""

    way = "curved"

    def __init__(self, robot, truth: dict[str, float], seed: int = 0) -> None:
        rng = np.random.default_rng(seed)
        self.robot = robot
        n = ROWS * TRIALS
        self.marks = {name: rng.normal(size=n) + 2.0 * rng.normal() for name in (*PLAIN, *OTHER)}
        common = rng.normal(size=n)
        for name in PLAIN:
            self.marks[name] = self.marks[name] + 2.0 * common
        self.noise = NOISE * rng.normal(size=n)
        self.truth = self._bent(truth)
        segment = np.arange(n) // 40
        self.measured = tuple(_Trial(f"t{k}", rng.normal(size=(ROWS, 1))) for k in range(TRIALS))
        self.layout = Layout(
            tuple(f"s{k}" for k in range(segment[-1] + 1)), np.arange(segment[-1] + 1) * 40 // ROWS, segment,
            np.zeros(n, dtype=int), np.tile(np.arange(ROWS) * 0.01, TRIALS), np.ones(n, dtype=bool),
            np.full(n, NOISE**2), np.zeros(n), ("x",), ("rad",), (0,),
        )  # fmt: skip
        self.error_definition = "root mean square"

    def _bent(self, values: dict[str, float]) -> np.ndarray:
        s = 3.0 * sum((v * self.marks[name] for name, v in values.items()), np.zeros(ROWS * TRIALS))
        return s + 0.05 * s**2

    def residuals(self, hypotheses, trials=None):
        rows = []
        for h in hypotheses:
            values = {t.effect: float(candidate(self.robot, t.effect, t.target).shares(dict(t.values))[0]) for t in h}
            rows.append(self.truth + self.noise - self._bent(values))
        out = np.array(rows)
        if trials is not None:
            out = np.where(np.isin(self.trial_of, trials), out, 0.0)
        return out

    def noise_floor(self):
        return NOISE, "stated"

    def raw(self, residual):
        return residual

    def series(self, hypothesis: Hypothesis):
        return []


class _Trial:
    setup, number = (), 0

    def __init__(self, name: str, commands: np.ndarray) -> None:
        self.name = name
        times = np.arange(len(commands)) * 0.01
        names = tuple(f"joint_{k}" for k in range(commands.shape[1]))
        self.log = SensorLog(times, np.zeros((len(times), 0)), commands, (), (), names, joints=commands)


@pytest.fixture(scope="module")
def robot():
    return load_robot("servo_pendulum")[0]


def pool_of(robot) -> list[Candidate]:
    return [c for n in (*PLAIN, *OTHER) for c in [candidate(robot, n, "arm" if n == "part_mass" else "servo")]]


def look(problem: Problem, pool: list[Candidate]):
    return everywhere(Search(problem), Current(), 0, pool, travelling(problem) or [windows(problem)])


def names(found) -> set[str]:
    return {c.effect.name for c in found.current.parts}


def test_all_that_is_a_little_wrong_is_found_and_nothing_else(robot):
    truth = {"coulomb_friction": 0.1, "viscous_friction": 0.2, "zero_offset": -0.15, "part_mass": 0.12}
    problem = Curved(robot, truth)
    found = look(problem, pool_of(robot))
    assert names(found) == set(truth)
    values = {c.effect.name: u for c, u in zip(found.current.parts, found.current.u, strict=True)}
    assert values == pytest.approx(truth, abs=0.02)
    errors = [r.error_heldout for r in found.rungs]
    assert errors == sorted(errors, reverse=True)
    assert errors[-1] < 1.1 * NOISE
    assert {t.effect for r in found.rungs for t in r.added} == set(truth)


def test_many_kinds_come_in_few_steps_those_that_matter_most_first(robot, monkeypatch):
    truth = {"coulomb_friction": 0.1, "viscous_friction": 0.2, "zero_offset": -0.15, "part_mass": 0.12}
    each = look(Curved(robot, truth), pool_of(robot))
    monkeypatch.setattr("ee_dist.discrepancy.kinds.STEPS", 2)
    few = look(Curved(robot, truth), pool_of(robot))
    assert names(few) == names(each) == set(truth)
    assert len(few.rungs) == 2 < len(each.rungs)
    assert few.rungs[0].name == each.rungs[0].name and few.rungs[1].error_heldout == each.rungs[-1].error_heldout
    assert {t.effect for r in few.rungs for t in r.added} == set(truth)


def test_a_descent_that_ended_above_another_is_not_asked_what_may_leave_it(robot, monkeypatch):
    problem, pool = Curved(robot, {"coulomb_friction": 0.1, "viscous_friction": 0.2}), pool_of(robot)[:3]
    search, cut = Search(problem), travelling(problem)[0]
    (fit,) = follow_valley(search, [(Model(tuple(pool)), np.zeros(3))], search.everything, 1.0)
    looked = _Look(search, search, search, 0, tuple(pool), Current(), ((cut, search.base()),), ())
    asked = []
    monkeypatch.setattr(
        "ee_dist.discrepancy.everywhere.pruned", lambda *a: asked.append(a) or Current(fit.model.parts, fit.u)
    )
    kept = looked._worth(fit, {}, 0.99 * fit.energy + looked.luck(fit.energy))
    assert kept is not None and kept.fitted == fit.energy and len(asked) == 1, "luck may make so much of a difference"
    assert looked._worth(fit, {}, 0.5 * fit.energy) is None and len(asked) == 1


@pytest.mark.parametrize("rests", [False, True])
def test_of_long_trials_the_beginning_tells_where_to_look_unless_nothing_moves_there(robot, rests):
    truth = {"coulomb_friction": 0.1, "viscous_friction": 0.2, "zero_offset": -0.15, "part_mass": 0.12}

    class Long(Curved):
        asked = 0

        def residuals(self, hypotheses, trials=None):
            self.asked += len(hypotheses)
            return super().residuals(hypotheses, trials)

    def looked_at(**more) -> tuple[Long, object]:
        problem = type("Long", (Long,), more)(robot, truth)
        return problem, look(problem, pool_of(robot))

    brief = Long(robot, {} if rests else truth, seed=1)
    plain, first = looked_at()
    problem, found = looked_at(beginning=lambda _self, _seconds: brief)
    assert names(found) == set(truth) and names(first) == set(truth)
    assert brief.asked > 0
    assert (problem.asked == plain.asked) == rests
    if not rests:
        assert problem.asked < plain.asked


def test_kinds_that_make_what_is_held_out_worse_are_left_out_again(robot):
    truth = {"coulomb_friction": 0.1, "viscous_friction": 0.2}
    problem, pool = Curved(robot, truth), pool_of(robot)[:2]
    search, cut = Search(problem), travelling(problem)[0]
    model = Current(tuple(pool), np.array([0.1, 0.2]))
    steps = Steps(search, search, 0, Current(), ((cut, search.base()),), len(pool))
    kept = Kept(model, 5.0, cut, {})
    starts = [(Model(tuple(pool[:k])), model.u[:k]) for k in (1, 2)]
    assert steps._as_far(kept, starts, [9.0, 5.0]) == (1, model, 5.0)
    least = luck(problem, len(pool), 9.0)
    assert steps._as_far(kept, starts, [9.0, 9.0 + 0.9 * least])[0] == 1
    last, less, energy = steps._as_far(kept, starts, [9.0, 9.0 + 1.1 * least])
    assert (last, energy) == (0, 9.0) and less.parts == tuple(pool[:1])


def test_what_stands_out_beside_it_is_found_too(robot):
    truth = {"coulomb_friction": 0.1, "viscous_friction": 0.1, "zero_offset": -0.1, "backdrive_friction": 0.9}
    found = improve(Curved(robot, truth), pool_of(robot))
    assert {t.effect for t in found.terms} == set(truth)
    assert found.ladder[-1].error_heldout < 1.2 * NOISE


@pytest.mark.parametrize("together", [True, False])
def test_what_a_step_of_several_effects_is_tied_with_keeps_its_values(robot, monkeypatch, together):
    """A plan needs them. Of a step of one effect a search goes by them, which compared these already: there they are names."""
    truth = {"coulomb_friction": 0.3, "viscous_friction": 0.2, "zero_offset": -0.15, "load_friction": 0.5}
    monkeypatch.setattr("ee_dist.discrepancy.everywhere.TIE_ENERGY", 1e9)
    if together:
        monkeypatch.setattr("ee_dist.discrepancy.kinds.STEPS", 1)
    found = improve(Curved(robot, truth), pool_of(robot))
    rung = next(r for r in found.ladder if "load_friction" in {t.effect for t in r.added})
    assert rung.tied_with and (len(rung.added) > 1) == together
    kept = rivals(found, rung, robot)
    assert [p.name for p, _ in kept] == (rung.tied_with if together else [])
    for proposal, u in kept:
        terms = Model(proposal.parts).hypothesis(u)
        rest = [t.name for t in rung.added if t.effect != "load_friction"]
        assert len(rest) > 1 and {t.name for t in terms} == {*rest, proposal.name}
        assert with_others_for(found.terms, rung.added, terms)


def test_what_stands_out_is_looked_for_though_the_rest_alone_is_worth_something(robot):
    """Small values without it leave much, and take in what is not theirs."""
    truth = {"coulomb_friction": 0.3, "viscous_friction": 0.2, "zero_offset": -0.15, "load_friction": 0.5}
    problem = Curved(robot, truth)
    assert names(look(problem, [c for c in pool_of(robot) if c.effect.name in PLAIN])) <= set(PLAIN)
    assert names(look(problem, pool_of(robot))) == set(truth)


def test_of_many_starts_the_best_go_on(robot):
    truth = {"coulomb_friction": 0.3, "motor_weak": 0.4}
    problem = Curved(robot, truth)
    search, pool = Search(problem), pool_of(robot)
    starts = [(Model((pool[0], c)), np.zeros(2)) for c in pool[1:]]
    fits = race(search, starts, search.everything, ((2, 3), (2, 2)))
    assert len(fits) == 2
    assert [c.effect.name for c in fits[0].model.parts] == ["coulomb_friction", "motor_weak"]
    assert fits[0].u == pytest.approx([0.3, 0.4], abs=0.02)
    assert fits[0].energy < fits[1].energy


def test_an_untouched_robot_gets_nothing(robot):
    assert look(Curved(robot, {}), pool_of(robot)) is None


def test_the_models_own_terms_stay_and_useless_ones_go(robot):
    problem, search = Curved(robot, {"viscous_friction": 0.2}), None
    search = Search(problem)
    few = [c for c in pool_of(robot) if c.effect.name in PLAIN[:3]]
    (fit,) = follow_valley(search, [(Model(tuple(few)), np.zeros(3))], search.everything, 1.0)
    kept = pruned(search, fit, 1, 20, travelling(problem)[0])
    assert [c.effect.name for c in kept.parts] == ["coulomb_friction", "viscous_friction"]


def test_a_valley_is_followed_within_bounds_and_on_the_trials_asked_for(robot):
    truth = {"coulomb_friction": 0.3, "viscous_friction": 0.2, "zero_offset": -0.3}
    problem = Curved(robot, truth)
    search = Search(problem)
    model = Model(tuple(c for c in pool_of(robot) if c.effect.name in truth))
    mask = problem.trial_of != 2
    (fit,) = follow_valley(search, [(model, np.zeros(3))], mask)
    assert (fit.u >= model.lower).all() and (fit.u <= model.upper).all()
    assert fit.slopes.shape == (int(mask.sum()), 3)
    assert fit.residual[~mask].any()
    assert error(fit.residual) < 1.1 * NOISE
    assert fit.energy == pytest.approx(float((fit.residual[mask] ** 2).sum()))


def test_what_is_not_told_from_neutral_goes_in_the_end(robot):
    truth = {"coulomb_friction": 0.1, "viscous_friction": 0.2, "part_mass": 0.15}
    problem = Curved(robot, truth)
    parts = tuple(c for c in pool_of(robot) if c.effect.name in PLAIN)
    start = Current(parts, np.array([truth.get(c.effect.name, 0.001) for c in parts]))
    told = told_only(Search(problem), start, 0, travelling(problem)[0], 20)
    kept, gone = told.then, told.gone
    assert {c.effect.name for c in kept.parts} == set(truth)
    assert {n.split("@")[0] for n in gone} == set(PLAIN) - set(truth)
    assert told_only(Search(problem), start, len(parts), travelling(problem)[0], 20).gone == (), (
        "the model's own terms stay"
    )


def test_a_twin_is_tried_in_the_place_of_what_was_added(robot):
    """The search has not what it would take to put the twin there by itself."""
    truth = {"coulomb_friction": 0.1, "viscous_friction": 0.2, "zero_offset": -0.15, "load_friction": 0.6}
    problem, pool = Curved(robot, truth), pool_of(robot)
    added, twin = (next(c for c in pool if c.effect.name == n) for n in ("motor_weak", "load_friction"))
    rest = [c for c in pool if c is not twin]
    current = Current((pool[0], added), np.array([0.1, 0.3]))
    search, cuts = Search(problem), travelling(problem)
    found = everywhere(search, current, 0, rest, cuts, True, [(1, twin, np.array([0.2]))])
    assert names(found) == set(truth)
    assert "motor_weak@servo" in found.rungs[0].dropped
    without = everywhere(search, current, 0, rest, cuts, True)
    assert without is None or "load_friction" not in names(without)


def test_what_was_worth_its_place_before_is_let_loose_again(robot, monkeypatch):
    """On top of values that stood in for it nothing of it promises, so that it is not among those that are tried for that."""
    truth = {"coulomb_friction": 0.1, "viscous_friction": 0.2, "zero_offset": -0.15, "load_friction": 0.6}
    problem, pool = Curved(robot, truth), pool_of(robot)
    search, cuts = Search(problem), travelling(problem)
    before = next(c for c in pool if c.effect.name == "load_friction")
    monkeypatch.setattr("ee_dist.discrepancy.everywhere.TRIED", 0)
    found = everywhere(search, Current(), 0, pool, cuts, seen=[(before, np.array([0.2]))])
    assert "load_friction" in names(found)
    without = everywhere(search, Current(), 0, pool, cuts)
    assert without is None or "load_friction" not in names(without)


def test_of_a_single_motion_what_driven_joints_have_is_fitted_at_once_and_nothing_else():
    problems = [problem_by("force_balance", measured("arm")[:n], samples()["arm"].robot) for n in (1, 2)]
    one, two = (
        {c.effect.name for c in looked_for_at_once(p, candidates_of(p)) if c.effect.everywhere} for p in problems
    )
    assert one == {"coulomb_friction", "viscous_friction", "rotor_inertia"}
    assert one < two and "part_mass" in two
    # A base that is tilted by as much as a search may think of is no small wrong that every robot has.
    assert "mounting_tilt" not in two and "mounting_tilt" in {c.effect.name for c in candidates_of(problems[1])}
    # What stands out by itself is tried beside them either way.
    assert "backdrive_friction" in {c.effect.name for c in looked_for_at_once(problems[0], candidates_of(problems[0]))}


def test_a_passive_joint_is_not_among_what_drives_have():
    robot = samples()["arm"].robot.map_drive("elbow", lambda d: replace(d, command="none", kp=0.0, kd=0.0))
    single = problem_by("force_balance", measured("arm")[:1], robot)
    pool = [candidate(robot, "viscous_friction", "elbow"), candidate(robot, "viscous_friction", "shoulder")]
    assert [c.target for c in looked_for_at_once(single, pool)] == ["shoulder"]
