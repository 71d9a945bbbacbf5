"""What a description only assumed goes before what somebody knew: in the pool, in the order of explanations, and in words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from assumed_samples import guessed, the_problem
from linear_problem import ROBOT as LINEAR
from linear_problem import Linear
from way_samples import samples

from ee_dist.discrepancy.accounts.of_compare import compare_account
from ee_dist.discrepancy.accounts.of_explain import explain_account
from ee_dist.discrepancy.assumed import guessed_text, of_one_guess, puts_right
from ee_dist.discrepancy.compare import compare
from ee_dist.discrepancy.everywhere import instead
from ee_dist.discrepancy.evidence import judge
from ee_dist.discrepancy.examine import Current, Effort
from ee_dist.discrepancy.explain import explain
from ee_dist.discrepancy.pruning import units_of
from ee_dist.discrepancy.search.candidates import Proposal, candidate, candidates
from ee_dist.discrepancy.search.fitted import Model
from ee_dist.effects.catalogue import Hypothesis, apply, term
from ee_dist.trials.log import Array


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
            name=name, proposal=proposal, vague=False, earned=True, stands=True, held=np.array([left]), gain=10.0 - left
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
