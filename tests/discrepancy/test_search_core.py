"""Screening, fitting, judging and verdicts on residuals whose answer is known, with no simulation."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from linear_problem import ROBOT, Linear

from ee_dist.discrepancy import examine as examining
from ee_dist.discrepancy.evidence.holdout import MOTIONS, SETTINGS, bootstrap, travelling, windows
from ee_dist.discrepancy.evidence.left import leftovers
from ee_dist.discrepancy.examine import Current, Effort, examine
from ee_dist.discrepancy.explain import EFFECT, NOTHING_MISSING, UNEXPLAINED, explain
from ee_dist.discrepancy.improve import improve
from ee_dist.discrepancy.search import ground as grounds
from ee_dist.discrepancy.search import screen as screening
from ee_dist.discrepancy.search.candidates import Candidate, candidate, candidates, known, parse
from ee_dist.discrepancy.search.fitted import Model
from ee_dist.discrepancy.search.ground import Ground
from ee_dist.discrepancy.search.refit import Refit
from ee_dist.discrepancy.search.scan import scan
from ee_dist.discrepancy.search.screen import screen
from ee_dist.discrepancy.search.search import Search
from ee_dist.discrepancy.search.slopes import follow_slopes
from ee_dist.discrepancy.search.trials import telling
from ee_dist.effects.catalogue import Hypothesis, Term, term
from ee_dist.effects.effect import EffectError
from ee_dist.robots.quadruped_lab import quadruped_lab
from ee_dist.trials.log import Array

POOL = candidates(ROBOT, only=["motor_weak", "joint_jam", "command_gain", "load_friction"])
QUICK = Effort(first=6, second=4, final=3, starts=1)


def test_the_hidden_effect_is_named_with_its_value() -> None:
    hidden = (term("motor_weak", "knee_front_left", loss=0.4),)
    found = explain(Linear(hidden), POOL, effort=QUICK)
    assert found.verdict == EFFECT
    assert found.best is not None and found.best.name == "motor_weak@knee_front_left"
    assert found.best.terms[0].values[0][1] == pytest.approx(0.4, abs=0.05)
    assert found.best.tied_with == []
    assert 0 < found.best.interval[0] < found.best.gain < found.best.interval[1] < 1


@pytest.mark.parametrize("seed", range(5))
def test_noise_alone_needs_no_effect(seed: int) -> None:
    assert explain(Linear((), seed), POOL, effort=QUICK).verdict == NOTHING_MISSING


def test_what_no_candidate_explains_is_said_to_be_unexplained() -> None:
    found = explain(Linear((), extra=1.0), POOL, effort=QUICK)
    assert found.verdict == UNEXPLAINED
    assert found.left and found.left[0].trend


def test_auto_adds_two_effects_and_stops() -> None:
    hidden = (term("motor_weak", "knee_front_left", loss=0.4), term("load_friction", "hip_rear_left", share=0.3))
    found = improve(Linear(hidden), POOL, effort=QUICK)
    assert {t.effect for t in found.terms} == {"motor_weak", "load_friction"}
    held = [r.error_heldout for r in found.ladder]
    assert len(held) == 3 and held[0] > held[1] > held[2]
    assert held[-1] < 1.1
    values = {p.name: p for p in found.parameters}
    assert values["loss"].low < 0.4 < values["loss"].high
    assert not found.left
    assert found.ties(1) == found.ties(2) == []


def test_improve_names_what_its_data_do_not_tell_from_what_it_added() -> None:
    class Twins(Linear):
        def shift(self, hypothesis: Hypothesis) -> Array:
            same = (term("motor_weak", "knee_front_left", loss=t.values[0][1]) for t in hypothesis)
            return super().shift(tuple(same))

    hidden = (term("motor_weak", "knee_front_left", loss=0.4),)
    twins = [parse(ROBOT, "motor_weak@knee_front_left"), parse(ROBOT, "load_friction@hip_rear_left")]
    found = improve(Twins(hidden), twins, effort=QUICK)
    assert len(found.terms) == 1
    assert {f"{found.terms[0].effect}@{found.terms[0].target}", *found.ties(1)} == {c.name for c in twins}


def test_asked_for_effects_are_added_and_flagged_when_they_do_nothing() -> None:
    found = improve(Linear(()), POOL, wanted=[candidate(ROBOT, "command_gain", "hip_front_left")], effort=QUICK)
    assert len(found.terms) == 1
    assert found.parameters[0].flag


def test_an_earlier_effect_is_fitted_again() -> None:
    hidden = (term("motor_weak", "knee_front_left", loss=0.4), term("load_friction", "hip_rear_left", share=0.3))
    before = (term("motor_weak", "knee_front_left", loss=0.1),)
    found = improve(Linear(hidden), POOL, before, [parse(ROBOT, "load_friction@hip_rear_left")], effort=QUICK)
    assert dict(found.terms[0].values)["loss"] == pytest.approx(0.4, abs=0.05)


def test_every_segment_is_held_out_once() -> None:
    fold = windows(Linear(())).fold_of
    assert set(fold) == {0, 1} and abs(fold.mean() - 0.5) <= 0.05


def test_motions_and_settings_are_held_out_whole() -> None:
    assert travelling(Linear(())) == [], "one motion, one setting"
    problem = Linear((), motions=4)
    (motions,) = travelling(problem)
    assert motions.name == MOTIONS and motions.folds == 4
    assert travelling(Linear((), motions=6))[0].folds == 2, "more take turns in two groups"
    for k in range(4):
        assert len(set(motions.fold_of[problem.trial_of_segment == k])) == 1
    held = tuple(replace(t, setup=(term("on_stand"),) if k < 2 else ()) for k, t in enumerate(problem.measured))
    problem.measured = held
    assert len(travelling(problem)) == 1, "how a robot was held is no setting of it"
    # A gear is no suspect of the search, and yet a setting.
    heavy = (term("gear_ratio", "servo", change=0.5),)
    problem.measured = tuple(replace(t, setup=heavy if k < 2 else ()) for k, t in enumerate(problem.measured))
    _, settings = travelling(problem)
    assert settings.name == SETTINGS
    assert settings.fold_of.tolist() == (problem.trial_of_segment >= 2).astype(int).tolist()
    # Of the same commands under two names: repeats of one motion, which does not travel to itself.
    log = problem.measured[0].log
    problem.measured = tuple(replace(t, log=log, setup=()) for t in problem.measured)
    assert travelling(problem) == []
    # Drives released a row later, and another motion of the joints: the same commands are the same motion.
    late = np.array(log.commands)
    late[-3:] = np.nan
    moved = replace(log, commands=late, joints=None if log.joints is None else log.joints + 1.0)
    problem.measured = (replace(problem.measured[0], log=moved), *problem.measured[1:])
    assert travelling(problem) == []


def test_torques_that_a_controller_worked_out_do_not_make_another_motion_of_a_repeat() -> None:
    problem = Linear((), motions=2)
    course = np.sin(np.arange(len(problem.data)) / 20.0)[:, None] * np.ones(len(ROBOT.motor_names))
    late = np.roll(course, 2, axis=0)
    another = np.cos(np.arange(len(problem.data)) / 33.0)[:, None] * np.ones(len(ROBOT.motor_names))
    first, second = problem.measured
    for joints, motions in ((late, 1), (another, 2)):
        logs = (replace(first.log, joints=course), replace(second.log, joints=joints))
        problem.measured = tuple(replace(t, log=log) for t, log in zip((first, second), logs, strict=True))
        assert len({c.name for c in travelling(problem)}) == motions - 1


def test_leftovers_of_noise_are_none() -> None:
    problem = Linear(())
    assert leftovers(problem, problem.residuals([()])[0]) == []


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 400), st.lists(st.floats(-1, 1), min_size=3, max_size=3))
def test_shares_and_values_are_inverse(index: int, shares: list[float]) -> None:
    pool = ALL
    c = pool[index % len(pool)]
    u = np.clip(np.array(shares[: c.size]), c.lower, c.upper)
    values = c.values(u)
    for (low, high), v in zip(c.bounds, values.values(), strict=True):
        assert low <= v <= high
    assert np.allclose(c.shares(values), u, atol=1e-9)


ALL: list[Candidate] = candidates(ROBOT)


def test_screening_finds_the_exact_gain_of_a_linear_effect() -> None:
    problem = Linear((term("motor_weak", "hip_rear_left", loss=0.2),))
    base = problem.residuals([()])[0]
    best = problem.residuals([(term("motor_weak", "hip_rear_left", loss=0.2),)])[0]
    promise = {s.candidate.name: s.promise for s in screen(Search(problem), POOL)}
    top = max(promise, key=lambda k: promise[k])
    assert top == "motor_weak@hip_rear_left"
    assert promise[top] == pytest.approx(base @ base - best @ best, rel=0.05)


class Asked(Linear):
    """Remembers what it was asked; a torque that is weaker by less than ``dead`` does nothing."""

    dead = 0.0

    def shift(self, hypothesis: Hypothesis) -> Array:
        alive = tuple(t for t in hypothesis if t.effect != "motor_weak" or t.values[0][1] > self.dead)
        return 2.0 * super().shift(alive)

    def residuals(self, hypotheses: Sequence[Hypothesis], trials: Sequence[int] | None = None) -> Array:
        self.asked = [*getattr(self, "asked", []), *(t for h in hypotheses for t in h)]
        return super().residuals(hypotheses, trials)


def test_screening_looks_further_on_where_a_small_step_promises_something(monkeypatch: pytest.MonkeyPatch) -> None:
    hidden = (term("joint_jam", "hip_rear_left", loss=0.5),)
    problem = Asked(hidden)
    every = {s.candidate.name: s.promise for s in screen(Search(problem), POOL)}
    times = Counter(f"{t.effect}@{t.target}" for t in problem.asked)
    assert max(times.values()) < 4, "of two sides the one that is promised"
    monkeypatch.setattr(screening, "FURTHER", 3)
    few = Asked(hidden)
    found = {s.candidate.name: s.promise for s in screen(Search(few), POOL)}
    times = Counter(f"{t.effect}@{t.target}" for t in few.asked)
    assert sum(count > 1 for count in times.values()) == 3 and len(times) == len(POOL)
    best = max(every, key=lambda name: every[name])
    assert best == "joint_jam@hip_rear_left" and found[best] == every[best]


class Sticks(Asked):
    """A sensor that sticks from some time on leaves another pattern than one that does from the start."""

    def shift(self, hypothesis: Hypothesis) -> Array:
        total = np.zeros(len(self.trial_of))
        for t in hypothesis:
            values = dict(t.values)
            late = values.get("from_s", 0.0) > 0.1
            pattern = np.random.default_rng(len(t.target) + 100 * late).standard_normal(len(total))
            total += 20.0 * values.get("share", values.get("bias", 0.0)) * pattern
        return total


def test_what_begins_at_a_moment_of_its_own_is_looked_at_further_on(monkeypatch: pytest.MonkeyPatch) -> None:
    """A little of it from the start promises nothing, however many others promise more."""
    monkeypatch.setattr(screening, "FURTHER", 3)
    pool = candidates(ROBOT, only=("sensor_stuck", "sensor_bias"), sharing=False)
    where = pool[-1].target
    problem = Sticks((term("sensor_stuck", where, share=0.8, from_s=1.0),))
    found = screen(Search(problem), pool)
    best = max(found, key=lambda s: s.promise)
    assert best.candidate.name == f"sensor_stuck@{where}"
    assert max(u[1] for u in best.starts) > 0
    assert best.promise > 0.9 * float((problem.data**2).sum() - len(problem.data))


class Resonant(Asked):
    """A little more of what is too much already is better, and so is much less: the far side of a resonance."""

    def shift(self, hypothesis: Hypothesis) -> Array:
        total = 0.0
        for t in hypothesis:
            change = t.values[0][1]
            total += -60.0 * change if change > -0.15 else 100.0 * change
        return np.asarray(total * np.random.default_rng(7).standard_normal(len(self.trial_of)))


@pytest.mark.parametrize(("far", "sides"), [(4.0, {-1.0, 1.0}), (1e9, {1.0})])
def test_screening_looks_to_both_sides_where_the_model_is_far_off(
    monkeypatch: pytest.MonkeyPatch, far: float, sides: set[float]
) -> None:
    """Nearer to the noise the side that a small step promises is enough."""
    monkeypatch.setattr(grounds, "FAR", far)
    problem = Resonant((term("command_gain", "hip_rear_left", change=-0.3),))
    problem.asked = []
    (found,) = screen(Search(problem), [candidate(ROBOT, "command_gain", "hip_rear_left")])
    assert {float(np.sign(t.values[0][1])) for t in problem.asked} == sides
    assert (found.starts[0][0] < 0.0) == (-1.0 in sides)


def test_what_shows_in_no_small_step_is_looked_at_further_on(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(screening, "FURTHER", 0)
    monkeypatch.setattr(Asked, "dead", 0.3)
    found = {
        s.candidate.name: s.promise
        for s in screen(Search(Asked((term("motor_weak", "hip_rear_left", loss=0.5),))), POOL)
    }
    assert max(found, key=lambda name: found[name]) == "motor_weak@hip_rear_left"


class OneBlind(Asked):
    """Motors that are weaker, or swapped, show in the second trial alone."""

    def shift(self, hypothesis: Hypothesis) -> Array:
        late = tuple(t for t in hypothesis if t.effect.startswith("motor"))
        others = tuple(t for t in hypothesis if t not in late)
        return np.asarray(super().shift(others) + np.where(self.trial_of == 0, 0.0, super().shift(late)))


@pytest.mark.parametrize(
    "hidden", [term("motor_weak", "hip_rear_left", loss=0.5), term("motors_swapped", "hip_rear_left+knee_rear_left")]
)
def test_screening_on_one_trial_looks_into_the_others_for_what_does_not_show_in_it(hidden: Term) -> None:
    pool = [*POOL, *candidates(ROBOT, only=["motors_swapped"])]
    search = Search(OneBlind((hidden,), motions=2))
    found = screen(search, pool, few=Ground.of(search.among([0]), Refit()))
    best = max(found, key=lambda s: s.promise).candidate
    assert (best.effect.name, best.target) == (hidden.effect, hidden.target)


@pytest.mark.parametrize(("motors", "trials"), [("weak", (0, 1)), ("sound", (0,))])
def test_scans_are_on_one_trial_unless_something_shows_in_others_alone(
    motors: str, trials: tuple[int, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    hidden: Hypothesis = (term("joint_jam", "knee_rear_left", loss=1.0),)
    if motors == "weak":
        hidden += (term("motor_weak", "hip_rear_left", loss=0.9),)
    problem = OneBlind(hidden, motions=2)
    # A joint that is stuck tells more than a thousand in the first trial alone.
    problem.data = problem.data + 2.0 * problem.shift(hidden[:1]) * (problem.trial_of == 0)
    assert telling(problem, problem.data, [0, 1]) == 0
    seen: list[tuple[int, ...] | None] = []
    monkeypatch.setattr(examining, "scan", lambda s, *a: seen.append(s.trials) or scan(s, *a))
    monkeypatch.setattr(examining, "busiest", lambda *_: [0, 1])
    found = examine(Search(problem), Current(), POOL, QUICK)
    assert seen == [trials]
    assert found.best is not None and found.best.name == "joint_jam@knee_rear_left"


def test_screening_on_one_trial_promises_what_all_hold() -> None:
    problem = Asked((term("joint_jam", "hip_rear_left", loss=0.5),), motions=2)
    search = Search(problem)
    alone, both = (
        {s.candidate.name: s.promise for s in screen(search, POOL, few=few)}
        for few in (Ground.of(search.among([0]), Refit()), None)
    )
    best = max(both, key=lambda name: both[name])
    assert best == "joint_jam@hip_rear_left" == max(alone, key=lambda name: alone[name])
    assert alone[best] == pytest.approx(both[best], rel=0.2)


def test_a_step_that_keeps_its_promise_is_not_tried_shorter_and_is_the_last() -> None:
    """A straight problem: one slope and one step for each value, and no second look."""

    class Counted(Linear):
        count = 0

        def residuals(self, hypotheses: Sequence[Hypothesis], trials: Sequence[int] | None = None) -> Array:
            self.count += len(hypotheses)
            return super().residuals(hypotheses, trials)

    problem = Counted((term("motor_weak", "hip_rear_left", loss=0.4),))
    search, c = Search(problem), candidate(ROBOT, "motor_weak", "hip_rear_left")
    (fit,) = follow_slopes(search, [(Model((c,)), np.array([0.3]))], search.everything)
    assert c.values(fit.u)["loss"] == pytest.approx(0.4, abs=0.02)
    assert problem.count == 3, "the start, a slope and a step"


def test_unknown_names_are_told_with_the_nearest() -> None:
    with pytest.raises(EffectError, match="motor_weak"):
        parse(ROBOT, "motor_weka@knee_front_left")
    with pytest.raises(EffectError, match="knee_front_left"):
        parse(ROBOT, "motor_weak@knee_frnt_left")


def test_a_known_value_beyond_the_range_stays() -> None:
    c = known(ROBOT, term("viscous_friction", "knee_front_left", damping_nm_s_rad=50.0))
    assert c.values(c.shares({"damping_nm_s_rad": 50.0})) == {"damping_nm_s_rad": 50.0}


def test_bootstrap_holds_the_sum() -> None:
    d = np.random.default_rng(1).normal(1.0, 0.1, 50)
    low, high = bootstrap(d)
    assert low < d.sum() < high and low > 40


def test_one_trial_screens_alone_only_where_it_has_enough_to_tell():
    """Else the right explanation of a faint residual is lost among hundreds: of one trial the small probe of a rotor promised a
    quarter of what others did, of all trials most of all."""
    problem = SimpleNamespace(
        trials=(None, None), trial_of=np.array([0] * 100 + [1] * 50), floor=np.ones(150), trust=(1.0, 1.0), looped=()
    )
    faint = np.ones(150) * 2.0
    loud = faint.copy()
    loud[100:] = 6.0
    assert telling(problem, faint, [0, 1]) is None  # type: ignore[arg-type]
    assert telling(problem, loud, [0, 1]) == 1  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "c", [c for c in candidates(quadruped_lab(), sharing=False) if c.inert][::7], ids=lambda c: c.name
)
def test_values_that_show_only_beside_others_are_looked_at_on_both_sides(c: Candidate) -> None:
    """A spring that rests on the other side pulls the other way: the first look must not see one side alone."""
    probes = c.probes((0.3, 0.9))
    for k in c.inert:
        signs = {float(np.sign(u[k])) for u in probes if u[k]}
        assert signs == {s for s, room in ((1.0, c.upper[k]), (-1.0, c.lower[k])) if room}
