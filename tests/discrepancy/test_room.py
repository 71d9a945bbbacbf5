"""Friction differs by direction by as much as there is of it: what is dry friction and a constant torque is named as such."""

from __future__ import annotations

import numpy as np
import pytest
from way_samples import measure, problem_by, samples

from ee_dist.discrepancy.draw import draw
from ee_dist.discrepancy.examine import Effort
from ee_dist.discrepancy.improve import improve
from ee_dist.discrepancy.search.candidates import candidate, parse, possible
from ee_dist.effects.catalogue import Hypothesis, apply, term
from ee_dist.robots.servo_pendulum import servo_pendulum

QUICK = Effort(first=6, second=4, final=3, starts=1)
POOL = ("coulomb_friction", "viscous_friction", "friction_asymmetry", "zero_offset", "offset_torque", "rotor_inertia")


def improved(hidden: Hypothesis) -> set[str]:
    sample = samples()["arm"]
    problem = problem_by("open_loop", measure(sample, hidden), sample.robot)
    found = improve(problem, [parse(problem.robot, f"{e}@elbow") for e in POOL], effort=QUICK)
    return {t.effect for t in found.terms}


def test_friction_and_a_constant_torque_are_not_told_as_friction_of_one_direction() -> None:
    hidden = (term("coulomb_friction", "elbow", torque_nm=0.2), term("offset_torque", "elbow", torque_nm=0.2))
    # Of a joint that holds a position a constant torque and a zero that is off are one and the same.
    assert improved(hidden) in ({"coulomb_friction", "offset_torque"}, {"coulomb_friction", "zero_offset"})


def test_friction_that_differs_by_direction_is_found_once_there_is_friction() -> None:
    hidden = (
        term("viscous_friction", "elbow", damping_nm_s_rad=0.3),
        term("friction_asymmetry", "elbow", dry_nm=0.0, viscous_nm_s_rad=0.2),
    )
    assert improved(hidden) == {"viscous_friction", "friction_asymmetry"}


def test_it_is_proposed_as_far_as_a_model_has_friction() -> None:
    robot = servo_pendulum()
    asked = candidate(robot, "friction_asymmetry", "servo")
    assert possible(robot, (), [asked]) == []
    (found,) = possible(robot, (term("coulomb_friction", "servo", torque_nm=0.03),), [asked])
    assert found.bounds == ((-0.03, 0.03), (0.0, 0.0))
    (most,) = possible(robot, (term("coulomb_friction", "servo", torque_nm=30.0),), [asked])
    assert most.bounds[0] == asked.bounds[0]


def test_of_several_joints_the_one_with_the_least_friction_says_how_far() -> None:
    robot = samples()["arm"].robot
    asked = candidate(robot, "friction_asymmetry", "all_joints")
    dry = [term("coulomb_friction", joint, torque_nm=k) for joint, k in zip(robot.motor_names, (0.2, 0.1), strict=True)]
    assert possible(robot, dry[:1], [asked]) == []
    assert possible(robot, tuple(dry), [asked])[0].bounds[0] == pytest.approx((-0.1, 0.1))


def test_nothing_is_hidden_that_a_robot_has_no_room_for() -> None:
    robot = servo_pendulum()
    rng = np.random.default_rng(0)
    assert "friction_asymmetry" not in {draw(robot, rng)[0].effect.name for _ in range(400)}
    rubbing = apply(robot, (term("coulomb_friction", "servo", torque_nm=0.1),))
    drawn = [t for _, t in (draw(rubbing, rng) for _ in range(400)) if t.effect == "friction_asymmetry"]
    assert drawn and max(abs(dict(t.values)["dry_nm"]) for t in drawn) < 0.1
