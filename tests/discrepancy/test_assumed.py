"""Gains that a description only assumed are the first suspect, all of them together, and farther off than gains that somebody
knew may be."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
from linear_problem import ROBOT as LINEAR
from linear_problem import Linear
from way_samples import Sample, measure, problem_by, samples

from ee_dist.discrepancy.accounts.of_compare import compare_account
from ee_dist.discrepancy.accounts.of_explain import _rivals, explain_account
from ee_dist.discrepancy.assumed import GUESS, LABEL, assumed_drives, guessed_text, of_one_guess, puts_right
from ee_dist.discrepancy.compare import compare
from ee_dist.discrepancy.everywhere import instead
from ee_dist.discrepancy.evidence import judge
from ee_dist.discrepancy.examine import Current, Effort, examine
from ee_dist.discrepancy.explain import explain
from ee_dist.discrepancy.lags import with_lags
from ee_dist.discrepancy.problem import Problem, error
from ee_dist.discrepancy.pruning import units_of
from ee_dist.discrepancy.search.candidates import Proposal, candidate, candidates
from ee_dist.discrepancy.search.fitted import Model
from ee_dist.discrepancy.search.pool import as_slow
from ee_dist.discrepancy.search.search import Search
from ee_dist.effects.catalogue import Hypothesis, apply, find, term
from ee_dist.robots.model import Robot
from ee_dist.trials.log import Array

STIFFER, DRIER = 6.0, (0.3, 0.2)


def guessed(robot: Robot, fields: tuple[str, ...] = ("kp", "kd", "rotor_inertia")) -> Robot:
    """Described with controllers several times as stiff, because nobody knew them."""
    drives = tuple(replace(d, kp=STIFFER * d.kp, kd=3.0 * d.kd) for d in robot.drives)
    return replace(robot, drives=drives, assumed=tuple((d.joint, f) for d in drives for f in fields))


@cache
def the_problem(limit: float = 0.0) -> Problem:
    """``limit``: share of the stated torque limit that the robot has not."""
    sample: Sample = samples()["arm"]
    hidden = (term("torque_limit", "all_joints", loss=limit),) if limit else ()
    hidden += tuple(
        term("coulomb_friction", j, torque_nm=c) for j, c in zip(sample.robot.motor_names, DRIER, strict=True)
    )
    return problem_by("open_loop", measure(sample, hidden), guessed(sample.robot))


TWELVE = 12.0
"""Times as strong as they are that all drives were taken to be."""


def test_drives_that_are_weaker_by_one_factor_in_all_are_found_with_their_lighter_rotors() -> None:
    sample: Sample = samples()["arm"]
    hidden = tuple(
        term("coulomb_friction", j, torque_nm=c) for j, c in zip(sample.robot.motor_names, DRIER, strict=True)
    )
    drives = tuple(
        replace(d, kp=TWELVE * d.kp, kd=TWELVE * d.kd, rotor_inertia=TWELVE * (k + 1) * d.rotor_inertia)
        for k, d in enumerate(sample.robot.drives)
    )
    assumed = tuple((d.joint, f) for d in drives for f in ("kp", "kd", "rotor_inertia"))
    robot = replace(sample.robot, drives=drives, assumed=assumed)
    problem = problem_by("open_loop", measure(sample, hidden), robot)
    proposal, u = assumed_drives(Search(problem), candidates(robot)) or pytest.fail("nothing was proposed")
    found = {t.effect: dict(t.values) for t in Model(proposal.parts).hypothesis(u)}
    assert found["position_gain"]["factor"] == pytest.approx(1 / TWELVE, rel=0.1)
    assert found["speed_gain"]["factor"] == pytest.approx(1 / TWELVE, rel=0.15)
    assert 0.02 < found["rotor_factor"]["factor"] < 0.1, (
        "one factor, where the guess at the second joint is twice as far off"
    )
    assert found["coulomb_friction"]["torque_nm"] == pytest.approx(np.mean(DRIER), rel=0.2)


def test_gains_that_were_assumed_are_found_together_with_friction() -> None:
    problem = the_problem()
    proposal, u = assumed_drives(Search(problem), candidates(problem.robot)) or pytest.fail("nothing was proposed")
    terms = Model(proposal.parts).hypothesis(u)
    found = {t.effect: dict(t.values) for t in terms}
    assert {t.target for t in terms} == {"all_joints"}, "and no weight is carried"
    assert found["position_gain"]["factor"] == pytest.approx(1 / STIFFER, rel=0.15)
    assert found["coulomb_friction"]["torque_nm"] == pytest.approx(np.mean(DRIER), rel=0.5)
    as_it_is, better = (error(r) for r in problem.residuals([(), terms]))
    assert better < 0.2 * as_it_is


@pytest.mark.parametrize("late_s", [0.02, 0.0])
def test_a_stiff_controller_that_is_late_is_not_a_soft_one(late_s: float) -> None:
    """Guessed too soft, it lags as much without any delay; where it is not late no delay comes with it."""
    sample: Sample = samples()["arm"]
    hidden = (term("command_delay", "all_joints", delay_s=late_s),) if late_s else ()
    trials = measure(sample, hidden)
    robot = with_lags(sample.robot, trials)
    assert all(j.lag_s > late_s for j in robot.joints)
    softer = tuple(replace(d, kp=d.kp / 5, kd=d.kd / 5) for d in robot.drives)
    robot = replace(robot, drives=softer, assumed=tuple((d.joint, f) for d in softer for f in ("kp", "kd")))
    problem = problem_by("open_loop", trials, robot)
    proposal, u = assumed_drives(Search(problem), candidates(robot)) or pytest.fail("nothing was proposed")
    found = {t.effect: dict(t.values) for t in Model(proposal.parts).hypothesis(u)}
    assert found["position_gain"]["factor"] == pytest.approx(5.0, rel=0.15)
    if late_s:
        assert found["command_delay"]["delay_s"] == pytest.approx(late_s, abs=0.002)
    else:
        assert "command_delay" not in found


def test_a_guess_that_is_farther_off_than_one_may_go_at_first_is_found_by_going_on_from_there() -> None:
    sample, softer = samples()["arm"], 40.0
    hidden = tuple(term("coulomb_friction", j, torque_nm=0.05) for j in sample.robot.motor_names)
    drives = tuple(replace(d, kp=d.kp / softer, kd=d.kd / softer) for d in sample.robot.drives)
    robot = replace(sample.robot, drives=drives, assumed=tuple((d.joint, f) for d in drives for f in ("kp", "kd")))
    (at_first,) = candidate(robot, "position_gain", "all_joints").bounds
    assert at_first[1] < 0.7 * softer
    problem = problem_by("open_loop", measure(sample, hidden), robot)
    pool = candidates(robot, only=["position_gain", "speed_gain", "coulomb_friction"])
    proposal, u = assumed_drives(Search(problem), pool) or pytest.fail("nothing was proposed")
    terms = Model(proposal.parts).hypothesis(u)
    found = {t.effect: dict(t.values) for t in terms}
    assert found["position_gain"]["factor"] == pytest.approx(softer, rel=0.15)
    as_it_is, better = (error(r) for r in problem.residuals([(), terms]))
    assert better < 0.2 * as_it_is


def test_a_joint_that_follows_as_a_filter_does_has_far_more_damping_than_was_guessed() -> None:
    """More than an explicit step of it holds, and no friction, delay or softer gain in its place."""
    sample, late_s = samples()["arm"], 0.15
    drives = tuple(replace(d, kd=late_s * d.kp, rotor_inertia=0.3 * d.rotor_inertia) for d in sample.robot.drives)
    trials = measure(replace(sample, robot=replace(sample.robot, drives=drives)), ())
    guess = tuple(replace(d, kd=d.kd / 4) for d in sample.robot.drives)
    described = replace(sample.robot, drives=guess, assumed=tuple((d.joint, f) for d in drives for f in ("kp", "kd")))
    robot = with_lags(described, trials)
    for d in guess:
        (_, most), (_, unseen) = (
            find("speed_gain").bounds(r, d.joint)["factor"] for r in (robot, replace(robot, joints=described.joints))
        )
        assert unseen * d.kd < late_s * d.kp < most * d.kd, "as long as nobody saw how late it is, what steps hold"
    problem = problem_by("open_loop", trials, robot)
    pool = candidates(robot, only=["position_gain", "speed_gain", "rotor_inertia", "coulomb_friction"])
    proposal, u = assumed_drives(Search(problem), pool) or pytest.fail("nothing was proposed")
    terms = Model(proposal.parts).hypothesis(u)
    found = apply(robot, terms).drives
    for d in found:
        assert d.kd / d.kp == pytest.approx(late_s, rel=0.05)
    as_it_is, better = (error(r) for r in problem.residuals([(), terms]))
    assert better < 0.1 * as_it_is


def test_a_limit_that_was_guessed_may_be_too_low() -> None:
    sample = samples()["arm"]
    lower = tuple(replace(d, torque_limit=0.1 * d.torque_limit) for d in sample.robot.drives)
    trials = measure(sample, ())
    guess = tuple((d.joint, f) for d in lower for f in ("torque_limit", "kp", "kd"))
    robot = replace(sample.robot, drives=lower, assumed=guess)
    problem = problem_by("open_loop", trials, robot)
    assert find("torque_limit").bounds(replace(robot, assumed=()), lower[0].joint)["loss"][0] == 0.0
    pool = candidates(robot, only=["position_gain", "speed_gain", "torque_limit"])
    proposal, u = assumed_drives(Search(problem), pool) or pytest.fail("nothing was proposed")
    found = apply(robot, Model(proposal.parts).hypothesis(u))
    assert found.drives[0].torque_limit > 2.0 * lower[0].torque_limit
    assert found.drives[0].kp == pytest.approx(lower[0].kp, rel=0.1)


def test_weight_that_controllers_carry_is_found_with_them() -> None:
    """Soft gains would sag under it: without it being carried they seem stiff, and dry friction holds the arm."""
    sample: Sample = samples()["arm"]
    (mounting,) = find("weight_carried").targets(sample.robot)
    soft, heavy = term("position_gain", "all_joints", factor=0.3), replace(
        sample.robot, parts=tuple(replace(p, mass_kg=3 * p.mass_kg) for p in sample.robot.parts)
    )  # fmt: skip
    friction = tuple(term("coulomb_friction", j, torque_nm=c) for j, c in zip(heavy.motor_names, DRIER, strict=True))
    hidden = (soft, term("weight_carried", mounting, share=0.95), *friction)
    problem = problem_by("open_loop", measure(replace(sample, robot=heavy), hidden), guessed(heavy))
    proposal, u = assumed_drives(Search(problem), candidates(problem.robot)) or pytest.fail("nothing was proposed")
    found = {t.effect: dict(t.values) for t in Model(proposal.parts).hypothesis(u)}
    assert proposal.guess and found["weight_carried"]["share"] == pytest.approx(0.95, abs=0.1)
    assert found["position_gain"]["factor"] == pytest.approx(0.3 / STIFFER, rel=0.3)
    other, _ = assumed_drives(Search(problem), candidates(problem.robot, without=["weight_carried"])) or pytest.fail(
        "nothing was proposed"
    )
    assert "weight_carried" not in {c.effect.name for c in other.parts}


@pytest.mark.parametrize("knows", [True, False])
def test_a_controller_that_knows_how_fast_its_goal_goes_is_no_stiffer_one(knows: bool) -> None:
    """Guessed at as one that does not, it would be ever so much stiffer; one that does not know it is told so neither."""
    sample = samples()["arm"]
    friction = tuple(term("coulomb_friction", j, torque_nm=0.05) for j in sample.robot.motor_names)
    hidden = (*((term("speed_feed_forward", "all_joints", share=1.0),) if knows else ()), *friction)
    trials = measure(sample, hidden)
    guess = tuple(replace(d, kp=d.kp / 2, kd=3 * d.kd) for d in sample.robot.drives)
    described = replace(sample.robot, drives=guess, assumed=tuple((d.joint, f) for d in guess for f in ("kp", "kd")))
    problem = problem_by("open_loop", trials, with_lags(described, trials))
    pool = candidates(problem.robot, without=["weight_carried"])
    proposal, u = assumed_drives(Search(problem), pool) or pytest.fail("nothing was proposed")
    terms = Model(proposal.parts).hypothesis(u)
    found = {t.effect: dict(t.values) for t in terms}
    assert ("speed_feed_forward" in found) == knows
    assert found["position_gain"]["factor"] == pytest.approx(2.0, rel=0.15)
    if knows:
        assert found["speed_feed_forward"]["share"] == pytest.approx(1.0, abs=0.1)
        assert all(puts_right(problem.robot, c) for c in proposal.parts)
    as_it_is, better = (error(r) for r in problem.residuals([(), terms]))
    assert better < 0.2 * as_it_is


def test_no_motor_is_called_weak_beside_a_guess() -> None:
    """A torque is too small only beside one that somebody knew: with guessed gains it is these that are wrong."""
    robot = samples()["arm"].robot
    joint = robot.motor_names[0]
    assert f"motor_weak@{joint}" in {c.name for c in candidates(robot)}
    unknown = guessed(robot)
    assert "motor_weak" not in {c.effect.name for c in candidates(unknown)}
    assert {f"position_gain@{joint}", f"speed_gain@{joint}"} <= {c.name for c in candidates(unknown)}
    assert f"motor_weak@{joint}" in {c.name for c in candidates(unknown, only=["motor_weak"])}, "who asks is answered"
    assert [c.name for c in candidates(unknown, only=[f"motor_weak@{joint}"])] == [f"motor_weak@{joint}"]


def test_a_limit_that_was_stated_for_want_of_a_better_one_is_found_with_them() -> None:
    problem = the_problem(limit=0.75)
    proposal, u = assumed_drives(Search(problem), candidates(problem.robot)) or pytest.fail("nothing was proposed")
    terms = Model(proposal.parts).hypothesis(u)
    found = {t.effect: dict(t.values) for t in terms}
    assert found["torque_limit"]["loss"] == pytest.approx(0.75, abs=0.05)
    assert found["position_gain"]["factor"] == pytest.approx(1 / STIFFER, rel=0.3)
    as_it_is, better = (error(r) for r in problem.residuals([(), terms]))
    assert better < 0.2 * as_it_is


def test_they_come_before_whatever_mimics_a_part_of_them() -> None:
    problem = the_problem()
    pool = candidates(
        problem.robot, only=["position_gain", "speed_gain", "coulomb_friction", "part_mass", "zero_offset"]
    )
    best = examine(Search(problem), Current(), pool).best
    assert best is not None
    assert best.name == LABEL
    assert {c.effect.name for c in best.proposal.parts} == {"position_gain", "speed_gain", "coulomb_friction"}


@pytest.mark.parametrize("why", ["nobody guessed", "there already", "left out by the user"])
def test_nothing_is_proposed_where(why: str) -> None:
    problem, taken = the_problem(), []
    pool = candidates(problem.robot)
    if why == "nobody guessed":
        sample = samples()["arm"]
        problem = problem_by("open_loop", measure(sample, ()), sample.robot)
    elif why == "there already":
        taken = ["position_gain@all_joints"]
    else:
        pool = candidates(problem.robot, only=["part_mass", "position_gain"])
    assert assumed_drives(Search(problem), pool, taken) is None


def test_some_joints_of_several_are_named_one_by_one() -> None:
    robot = samples()["arm"].robot
    some = replace(guessed(robot), assumed=(("elbow", "kp"),))
    problem = problem_by("open_loop", measure(samples()["arm"], ()), some)
    proposal, _ = assumed_drives(Search(problem), candidates(some)) or pytest.fail("nothing was proposed")
    assert {c.target for c in proposal.parts} == {"elbow"}


def test_what_puts_them_right_stays_while_everything_is_fitted_and_nothing_else_does() -> None:
    some = replace(guessed(samples()["arm"].robot), assumed=(("elbow", "kp"),))
    of = {c: puts_right(some, candidate(some, *c)) for c in (
        ("speed_gain", "elbow"), ("torque_limit", "elbow"), ("speed_gain", "shoulder"), ("speed_gain", "all_joints"),
        ("zero_offset", "elbow"),
    )}  # fmt: skip
    assert [c for c, stays in of.items() if stays] == [("speed_gain", "elbow"), ("torque_limit", "elbow")]
    parts = tuple(
        candidate(some, *c) for c in (("speed_gain", "elbow"), ("zero_offset", "elbow"), ("deadband", "elbow"))
    )
    current = Current(parts, np.array([0.1, 0.1, 0.1]))
    assert list(instead(some, current, 0)) == [[0], [0, 2]]
    assert list(instead(samples()["arm"].robot, current, 0)) == [[], [0, 2]], "nothing was assumed"


def test_a_gain_is_looked_for_farther_off_where_it_was_assumed() -> None:
    robot = samples()["arm"].robot
    known, open_ = (candidate(r, "position_gain", "elbow") for r in (robot, guessed(robot)))
    assert known.bounds == ((0.2, 5.0),)
    assert open_.bounds[0][0] < 0.05


def rotors(twice: bool = True, marked: bool = True) -> Problem:
    """A small arm with motors of two sizes, described with rotors half as heavy as they are, because somebody guessed at them."""
    sample = samples()["arm"]
    true = replace(sample.robot, drives=tuple(
        replace(d, rotor_inertia=r) for d, r in zip(sample.robot.drives, (0.06, 0.02), strict=True)
    ))  # fmt: skip
    drives = tuple(replace(d, rotor_inertia=d.rotor_inertia / (2.0 if twice else 1.0)) for d in true.drives)
    assumed = tuple((d.joint, "rotor_inertia") for d in drives) if marked else ()
    measured = measure(replace(sample, robot=true), ())
    return problem_by("open_loop", measured, replace(true, drives=drives, assumed=assumed))


def test_guessed_rotors_are_off_by_one_number_before_any_sound_motor_is_blamed() -> None:
    problem = rotors()
    pool = candidates(problem.robot, only=["motor_weak", "rotor_inertia", "rotor_factor", "command_delay", "part_mass"])
    assert [c.name for c in pool if c.guess] == ["rotor_factor@all_joints", "rotor_inertia@all_joints"]
    found = explain(problem, pool)
    assert found.best is not None and found.best.name == "rotor_factor@all_joints"
    assert dict(found.best.terms[0].values)["factor"] == pytest.approx(2.0, rel=0.1)
    assert "rotor_inertia@each of 2 joints" in found.best.tied_with
    assert GUESS in explain_account(problem, found, None).lines
    said = compare_account(problem, compare(problem, problem.residuals([()])[0]), []).lines
    assert "The description only assumed rotor_inertia of 2 drives: explain and improve look there first." in said


def test_what_does_better_and_does_not_go_first_is_told() -> None:
    """A dozen numbers at sound parts that leave less than a few guesses, which go before them."""
    problem = rotors()
    found = explain(problem, candidates(problem.robot, only=["rotor_inertia", "rotor_factor", "command_delay"]))
    best = found.best
    assert best is not None
    account = explain_account(problem, found, None)
    assert "does better" not in account.sure
    assert "Of 9 explanations 2 others do as well" in account.sure
    other = next(c for c in found.candidates if c.name == "rotor_inertia@shoulder")
    other.held = 0.5 * best.held
    said = explain_account(problem, found, None).sure
    assert "Of 9 explanations 1 does better, where nothing was guessed (" in said, (
        "it has one number, as the guess does"
    )
    assert "), and 2 others do as well" in said
    assert "1 does better, by more numbers where nothing was guessed (a)" in _rivals(9, (), "", ["a"], True)


def test_a_factor_on_rotors_is_proposed_only_where_unequal_ones_were_guessed() -> None:
    names = {c.effect.name for c in candidates(rotors(marked=False).robot)}
    assert "rotor_inertia" in names and "rotor_factor" not in names
    even = replace(rotors().robot, drives=tuple(replace(d, rotor_inertia=0.01) for d in rotors().robot.drives))
    guesses = [c.name for c in candidates(even) if c.guess]
    assert guesses == ["rotor_inertia@all_joints"], "as much more at each is the same"
    one = replace(rotors().robot, assumed=(("elbow", "rotor_inertia"), ("elbow", "kp")))
    assert [c.name for c in candidates(one) if c.guess] == ["position_gain@elbow", "rotor_inertia@elbow"]


def test_guessed_rotors_beside_guessed_gains_are_off_by_a_factor_too() -> None:
    problem = rotors()
    robot = replace(problem.robot, assumed=(*problem.robot.assumed, *((j, "kp") for j in problem.robot.motor_names)))
    problem.robot = robot
    proposal, u = assumed_drives(Search(problem), candidates(robot)) or pytest.fail("nothing was proposed")
    found = {t.effect: dict(t.values) for t in Model(proposal.parts).hypothesis(u)}
    assert "rotor_inertia" not in found and found["rotor_factor"]["factor"] == pytest.approx(2.0, rel=0.1)
    assert puts_right(robot, candidate(robot, "rotor_factor", "all_joints"))


JOINTS = LINEAR.motor_names


def linear(hidden: Hypothesis, twins: bool = False) -> Linear:
    """Its first joint's rotor was assumed; of ``twins`` a weak motor there leaves the same mark."""

    class Guessed(Linear):
        def shift(self, hypothesis: Hypothesis) -> Array:
            same = term("motor_weak", JOINTS[0], loss=0.4)
            return super().shift(tuple(same if twins and t.target == JOINTS[0] else t for t in hypothesis))

    problem = Guessed(hidden)
    problem.robot = replace(LINEAR, assumed=((JOINTS[0], "rotor_inertia"),))
    return problem


def test_a_guessed_controller_is_put_right_as_a_whole_or_not_at_all() -> None:
    """Gain, damping and rotor, of which a log may tell ratios alone; a limit that is never reached goes as anything else."""
    robot = replace(LINEAR, assumed=tuple((j, f) for j in LINEAR.motor_names for f in ("kp", "kd", "torque_limit")))
    names = ("position_gain", "speed_gain", "torque_limit", "coulomb_friction")
    model = Model(tuple(candidate(robot, n, "all_joints") for n in names))
    assert of_one_guess(model) == {0, 1}
    assert units_of(model, 0, len(names)) == [[2], [3]]
    alone = Model((model.parts[0], *model.parts[2:]))
    assert of_one_guess(alone) == set() and units_of(alone, 0, 3) == [[0], [1], [2]]
    known = Model(tuple(candidate(LINEAR, n, "all_joints") for n in names))
    assert of_one_guess(known) == set()


def test_of_what_is_tied_a_guess_goes_before_a_sound_part() -> None:
    problem = linear((term("motor_weak", JOINTS[0], loss=0.4),), twins=True)
    pool = [candidate(problem.robot, "motor_weak", JOINTS[0]), candidate(problem.robot, "rotor_inertia", JOINTS[0])]
    assert [c.guess for c in pool] == [False, True]
    found = explain(problem, pool)
    assert [c.name for c in found.tied] == [c.name for c in reversed(pool)]
    unmarked = linear((term("motor_weak", JOINTS[0], loss=0.4),), twins=True)
    unmarked.robot = LINEAR
    found = explain(unmarked, [candidate(LINEAR, c.effect, c.target) for c in pool])
    assert [c.name for c in found.tied] == [c.name for c in pool]


def test_one_set_of_values_for_drives_that_were_guessed_at_is_a_guess_and_one_for_each_joint_is_not() -> None:
    robot = guessed(samples()["arm"].robot)

    def proposal(effects: Sequence[str], *targets: str) -> Proposal:
        return Proposal(tuple(candidate(robot, e, t) for e in effects for t in targets))

    assert proposal(["position_gain", "coulomb_friction"], "all_joints").guess
    assert not proposal(["coulomb_friction", "position_gain"], "all_joints").guess
    assert not proposal(["position_gain"], "shoulder", "elbow").guess
    assert not proposal(["position_gain"], "all_joints", "elbow").guess


@pytest.mark.parametrize(("size", "first"), [(6, "guess"), (7, "each"), (4, "guess")])
def test_a_guess_goes_before_as_many_numbers_that_it_is_tied_with(
    monkeypatch: pytest.MonkeyPatch, size: int, first: str
) -> None:
    """Though not with what is best of all, which has more numbers and is tied with those."""

    def judged(name: str, size: int, guess: bool, left: float) -> SimpleNamespace:
        proposal = SimpleNamespace(parts=(), size=size, guess=guess)
        return SimpleNamespace(
            name=name, proposal=proposal, vague=False, earned=True, stands=True, held=np.array([left])
        )

    found = [judged("most", 12, False, 1.0), judged("each", 6, False, 1.2), judged("guess", size, True, 1.3)]
    monkeypatch.setattr(judge, "tied", lambda one, other: {one.name, other.name} != {"most", "guess"})
    order = judge.ranked(found)  # type: ignore[arg-type]
    assert order[0].name == first
    assert set(order[0].tied_with) == {"most", "each", "guess"} - {first}


@pytest.mark.parametrize(
    ("gain", "size", "first"), [(0.5, 6, "guess"), (0.3, 6, "each"), (0.5, 12, "each"), (0.5, 11, "guess")]
)
def test_few_guesses_go_before_many_numbers_at_sound_parts(
    monkeypatch: pytest.MonkeyPatch, gain: float, size: int, first: str
) -> None:
    """A deadband at each of twelve joints leaves less than gains that were guessed, as long as these are as they were guessed."""

    def judged(name: str, size: int, guess: bool, gain: float) -> SimpleNamespace:
        proposal = SimpleNamespace(parts=(), size=size, guess=guess)
        return SimpleNamespace(
            name=name, proposal=proposal, vague=False, earned=True, stands=True, held=np.array([1.0 - gain]), gain=gain
        )

    monkeypatch.setattr(judge, "tied", lambda *_: False)
    order = judge.ranked([judged("each", 12, False, 0.8), judged("guess", size, True, gain)])  # type: ignore[arg-type,list-item]
    assert [order[0].name, [j.rank for j in order]] == [first, [1, 2]]
    assert order[0].tied_with == [], "what it goes before does not do as well"
    # One number that all share at sound parts takes off more than the guess does: each by itself is the same, and more.
    shared = judged("shared", 1, False, gain + 0.1)
    many = [judged("each", 12, False, 0.8), judged("guess", size, True, gain), shared]
    assert judge.ranked(many)[0].name == "each"  # type: ignore[arg-type]
    less = [*many[:2], judged("shared", 1, False, gain - 0.1)]
    assert judge.ranked(less)[0].name == first  # type: ignore[arg-type]


def test_a_guess_is_judged_beside_whatever_promises_more() -> None:
    hidden = (term("motor_weak", JOINTS[1], loss=0.4), term("rotor_inertia", JOINTS[0], added_kg_m2=0.1))
    problem = linear(hidden)
    pool = candidates(problem.robot, only=["motor_weak", "rotor_inertia"])
    effort = Effort(first=1, second=1, starts=1, final=1)
    judged = {c.name for c in explain(problem, pool, effort=effort).candidates}
    assert judged == {f"motor_weak@{JOINTS[1]}", f"rotor_inertia@{JOINTS[0]}"}


def test_a_robot_is_the_same_whatever_was_assumed_of_it() -> None:
    robot = samples()["arm"].robot
    marked = replace(robot, assumed=(("elbow", "kp"),))
    assert marked == robot
    assert marked.digest == robot.digest
    assert apply(marked, (term("coulomb_friction", "elbow", torque_nm=0.1),)).assumed == marked.assumed


def test_it_is_told_that_the_description_only_guessed() -> None:
    problem = the_problem()
    found = compare(problem, problem.residuals([()])[0])
    said = compare_account(problem, found, []).lines
    assert (
        "The description only assumed kp, kd, rotor_inertia of 2 drives: explain and improve look there first." in said
    )
    pool = candidates(problem.robot, only=["position_gain", "speed_gain", "coulomb_friction", "part_mass"])
    lines = explain_account(problem, explain(problem, pool), None).lines
    assert guessed_text(()) in lines
    assert "late" in guessed_text((term("command_delay", "all_joints", delay_s=0.01),)) and "late" not in guessed_text(
        ()
    )


def test_friction_that_slows_as_back_emf_does_is_worth_trying_where_the_stated_speed_is_nobodys() -> None:
    """A file's 20 rad/s, and a motor that is slowed to 3: all of its torque at a speed that the joint had is not too much."""
    sample = samples()["arm"]
    stated = replace(sample.robot, joints=tuple(replace(j, top_speed=40.0) for j in sample.robot.joints))
    problem = problem_by("open_loop", measure(sample, ()), stated)
    own = candidate(stated, "viscous_friction", "elbow")
    assert as_slow(problem, own) is own, "where the drives are known the range is as it was"
    unknown = replace(stated, assumed=tuple((j, "kp") for j in stated.motor_names))
    guess = problem_by("open_loop", measure(sample, ()), unknown)
    wider = as_slow(guess, candidate(unknown, "viscous_friction", "elbow"))
    fastest = max(
        float(np.quantile(np.abs(np.gradient(t.log.sensors[:, 1], t.log.times_s)), 0.99)) for t in guess.measured
    )
    drive = unknown.drives[unknown.motor_names.index("elbow")]
    assert wider.bounds[0][1] == pytest.approx(min(1.2 * drive.torque_limit / fastest, 10 * own.bounds[0][1]), rel=0.2)
    # A motor whose own speed is stated is believed, and other effects are as they were.
    believed = unknown.map_drive("elbow", lambda d: replace(d, speed_limit=40.0))
    known = candidate(believed, "viscous_friction", "elbow")
    assert as_slow(problem_by("open_loop", measure(sample, ()), believed), known).bounds == known.bounds
    dry = candidate(unknown, "coulomb_friction", "elbow")
    assert as_slow(guess, dry) is dry
