"""A calibration says where it may hide a fault: at a joint that differs far from all joints like it, and nowhere else."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from way_samples import Sample, evaluator_for, measure

from ee_dist.discrepancy.accounts.of_improve import odd_text
from ee_dist.discrepancy.calibrated_away import TIMES, calibrated_away
from ee_dist.discrepancy.search.candidates import Candidate, candidates
from ee_dist.discrepancy.ways.open_loop.problem import OpenLoop
from ee_dist.effects.catalogue import Hypothesis, Term, term
from ee_dist.effects.groups import like_joints
from ee_dist.robots.model import Robot
from ee_dist.robots.quadruped_lab import quadruped_lab
from ee_dist.robots.servo_pendulum import servo_pendulum
from ee_dist.trials.excitation import Excitation
from ee_dist.trials.noise import with_noise

ROBOT = with_noise(quadruped_lab(), 0.005)
JOINTS = ROBOT.motor_names
FAULTY = "knee_front_right"
PLAN = (Excitation("multisine", 2.4, 0.6, 1, "stand"), Excitation("steps", 2.4, 0.5, 2, "stand"))
EFFECTS = ("zero_offset", "coulomb_friction", "command_gain", "sensor_bias")


def pool(robot: Robot = ROBOT) -> list[Candidate]:
    return candidates(robot, only=EFFECTS)


def a_little_off(seed: int) -> tuple[Term, ...]:
    """As every robot is: each joint by amounts of its own."""
    rng = np.random.default_rng(seed)
    off = [term("zero_offset", j, offset_rad=float(rng.normal(0, 0.005))) for j in JOINTS]
    return (*off, *(term("coulomb_friction", j, torque_nm=float(rng.uniform(0.05, 0.15))) for j in JOINTS))


def problem_of(hidden: Hypothesis, seed: int = 0) -> OpenLoop:
    sample = Sample(ROBOT, PLAN, (), ("open_loop",))
    return OpenLoop(measure(sample, hidden, seed), ROBOT, evaluator_for(ROBOT))


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_robot_that_is_a_little_off_everywhere_is_no_case(seed: int) -> None:
    assert calibrated_away(problem_of(a_little_off(seed), seed), (), pool()) == []


@pytest.mark.parametrize(("fault", "place"), [
    (term("zero_offset", FAULTY, offset_rad=0.1), FAULTY), (term("coulomb_friction", FAULTY, torque_nm=1.0), FAULTY),
    (term("sensor_bias", f"position_{FAULTY}", bias=0.1), f"position_{FAULTY}"),
])  # fmt: skip
def test_one_joint_that_has_far_more_than_its_mates_is_told(fault: Term, place: str) -> None:
    found = calibrated_away(problem_of((*a_little_off(5), fault), 5), (), pool())
    assert [o.joint for o in found] == [FAULTY]
    (odd,) = found
    assert (odd.term.effect, odd.term.target) == (fault.effect, place)
    value, true = (next(iter(dict(t.values).values())) for t in (odd.term, fault))
    assert value == pytest.approx(true, rel=0.35)
    assert odd.times >= TIMES and odd.times == pytest.approx(abs(value) / odd.typical)
    assert len(odd.mates) == 7 and place not in odd.mates and 0.3 < odd.share <= 1.0
    said = odd_text(odd, ROBOT)
    like = "joints" if place == FAULTY else "sensors"
    assert said.startswith(
        f"Calibrated away at {place.replace('_', ' ')}: {fault.effect.replace('_', ' ')} {value:.3g}"
    )
    assert f"times what its like {like} have: if this robot was not in order, this hides it." in said


def test_what_the_calibrated_model_has_at_each_joint_counts_too() -> None:
    """A fault that became one of many small values of the model leaves nothing in the residual."""
    own = tuple(
        replace(t, values=(("offset_rad", 0.1),)) if t.name == f"zero_offset@{FAULTY}" else t for t in a_little_off(7)
    )
    problem = problem_of(own, 7)
    (odd,) = calibrated_away(problem, own, pool())
    assert odd.term.name == f"zero_offset@{FAULTY}" and dict(odd.term.values)["offset_rad"] == pytest.approx(
        0.1, rel=0.1
    )
    shared = (term("coulomb_friction", "all_joints", torque_nm=0.1),)
    (odd,) = calibrated_away(problem, shared, pool())
    assert odd.term.name == f"zero_offset@{FAULTY}"


def test_a_robot_without_like_joints_has_nothing_to_hold_a_joint_against() -> None:
    robot = with_noise(servo_pendulum(), 0.001)
    sample = Sample(robot, (Excitation("sway", 2.0, 0.3, 1),), (), ("open_loop",))
    hidden = (term("zero_offset", "servo", offset_rad=0.1),)
    problem = OpenLoop(measure(sample, hidden), robot, evaluator_for(robot))
    assert like_joints(robot) == [] and calibrated_away(problem, (), candidates(robot)) == []
    assert like_joints(ROBOT) == [JOINTS]
    drives = [replace(d, kd=d.kd * (1 + 0.01 * k / 8)) for k, d in enumerate(ROBOT.drives)]
    drives[0] = replace(drives[0], kp=30.0)
    some = replace(ROBOT, drives=tuple(drives))
    assert like_joints(some) == [] and like_joints(some, 0.05) == [JOINTS[1:]]
