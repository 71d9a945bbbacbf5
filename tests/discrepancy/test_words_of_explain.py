"""What explain says: ties by name, how sure it is, and what else is left."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from account_samples import account, made_up

from ee_dist.discrepancy.accounts.account import Account
from ee_dist.discrepancy.assumed import LABEL
from ee_dist.discrepancy.evidence.intervals import BOUND, HARDLY, NEUTRAL, ParameterReport
from ee_dist.discrepancy.evidence.left import Leftover
from ee_dist.effects.catalogue import term
from ee_dist.robots.servo_pendulum import servo_pendulum


@pytest.mark.parametrize(
    ("tied", "said"),
    [
        ([], "Missing: coulomb friction at servo (torque 0.3 N.m). Nothing"),
        (["part_lost@servo"], "(torque 0.3 N.m), or part lost at servo, which looks the same here. Nothing"),
        (["part_lost@servo", "b@c"], ", or part lost at servo or b at c, which look the same here. Nothing"),
        (["a@c", "b@c", "d@c"], ", or one of 3 others that look the same here. Nothing"),
    ],
)
def test_what_looks_the_same_is_named(tied: list[str], said: str) -> None:
    assert said in account(tied).headline


def test_a_rest_above_the_noise_is_no_contradiction_where_nothing_is_left() -> None:
    assert "; what it leaves of that stands out nowhere. Of 9" in account([], 0.66).sure
    assert "leaves" not in account([], 0.99).sure
    assert account([], 0.66).headline.endswith("Nothing else stands out.")
    assert account([], 0.99).headline.endswith("Nothing else is left above the noise.")


def test_that_no_motion_tried_helps_is_not_that_none_does() -> None:
    ahead = SimpleNamespace(separation=0.1)
    told_of = account(["a@c"], ahead=ahead, planner="plan it")
    assert told_of.advice == "None of the motions tried is expected to tell them apart."
    assert told_of.planner == "plan it" and told_of.first[-1].endswith(" plan it")
    assert told_of.first[-1].startswith("To look for other motions: ") and told_of.lead == "Next"
    assert not account([], ahead=None, planner="plan it").planner, "nothing is tied"


def test_a_noisy_sensor_explains_the_noise_that_it_leaves() -> None:
    noise = term("sensor_noise", "speed", deviation=0.4)
    quick, slow, other = (
        Leftover("a", c, 9.0, 3.0, t) for c, t in (("speed", False), ("speed", True), ("position", False))
    )
    its_own = account([], 0.23, what=noise, left=(quick,))
    assert its_own.good and its_own.headline.endswith("rad/s). What is left there is this noise itself.")
    assert "several" not in its_own.headline and not any("more than noise" in line for line in its_own.lines)
    for more in (slow, other):
        open_ = account([], 0.23, what=noise, left=(quick, more))
        assert (
            not open_.good and "among other things" in open_.headline and "in 1 curve; worst" in " ".join(open_.lines)
        )


def test_what_is_tied_is_open_and_told_apart_before_it_is_added() -> None:
    tied, alone = account(["a@c"], planner="plan it"), account([], planner="plan it")
    assert tied.first[-1] == "Next, to tell them apart: plan it" and tied.lead == "Or go on without" and not tied.good
    assert alone.lead == "Next" and alone.good


def test_where_more_is_missing_it_is_added_before_what_is_tied_is_told_apart() -> None:
    """Half an explanation each, as dry and viscous friction are: a trial between them tells which half is larger."""
    halves = account(["a@c"], planner="plan it", left=(Leftover("a", "position", 9.0, 3.0, True),))
    assert halves.more and halves.lead == "Next"
    assert halves.first[-1] == "To tell apart what may stay tied then: plan it"


def test_more_twins_than_a_headline_holds_are_named_below_it() -> None:
    assert "Of 9 explanations no other does as well." in account([]).sure
    assert "2 others do as well. " in account(["a@c", "b@c"]).sure, "the headline names them"
    assert "3 others do as well (a at c; b at c; d at c). " in account(["a@c", "b@c", "d@c"]).sure
    assert "(a at c; b at c; d at c; e at c and 2 more). " in account([f"{x}@c" for x in "abdefg"]).sure


def test_what_may_be_noise_is_no_proof_that_nothing_is_left() -> None:
    told_of = account([], unsure=("knee_left", "hip"))
    assert told_of.headline.endswith("Nothing else is left beyond what may be noise.") and not told_of.good
    assert "; the noise floor is only an upper bound at knee left, hip. " in told_of.sure
    assert told_of.advice.startswith("To tell, repeat the motion at a third of its pace")
    assert account([]).good and "beyond" not in " ".join(account([]).words)


def test_explain_says_how_sure_a_value_is_and_which_ended_at_its_bound() -> None:
    exact = ParameterReport(0, "torque_nm", 0.3, 0.28, 0.32, "")
    said = account([], parameters=(exact,)).sure
    assert "no other does as well; 95 % intervals: torque 0.28 to 0.32 N.m." in said
    at_end = account([], parameters=(replace(exact, flag=BOUND),)).sure
    assert f"; 95 % intervals: torque {BOUND}." in at_end and "0.28" not in at_end
    assert "interval" not in account([]).sure.partition("judged on")[2]


@pytest.mark.parametrize(("flag", "said"), [(NEUTRAL, "tell none by itself"), ("", "(torque 0.3 N.m)")])
def test_of_drives_that_were_assumed_only_what_the_data_tell_is_named(flag: str, said: str) -> None:
    """Six numbers go together, and each of them may stand in for the others."""
    robot = servo_pendulum()
    guessed = replace(robot, assumed=tuple((j, "kp") for j in robot.motor_names))
    still, moving = (np.full((4, 1), 0.3), np.linspace(0, 1, 4)[:, None])
    told_of = (ParameterReport(0, "torque_nm", 0.3, 0.0, 1.0, flag),)

    def of(commands: np.ndarray) -> Account:
        problem = made_up()
        problem.robot, problem.measured = guessed, (SimpleNamespace(log=SimpleNamespace(commands=commands)),)
        return account([], parameters=told_of, label=LABEL, problem=problem)

    head = of(moving).headline
    assert head.startswith("Not what was assumed: coulomb friction") and said in head
    assert not any("commanded to move" in line for line in of(moving).lines)
    assert any("Only 0 joints of 1 are commanded to move here" in line for line in of(still).lines)


@pytest.mark.parametrize(("flag", "said"), [(NEUTRAL, True), (HARDLY, True), ("", False)])
def test_an_effect_of_which_no_value_is_told_is_named_with_that(flag: str, said: bool) -> None:
    told_of = (ParameterReport(0, "torque_nm", 0.3, 0.0, 1.0, flag),)
    head = account([], parameters=told_of).headline
    assert ("(of which these data tell no value)" in head) == said and "coulomb friction" in head
