"""Nominal numbers that a fit puts straight, and how a robot is held, do what they say."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from effect_robots import ARM_M, MASS_KG, Bench, G, lever, slider
from scipy.spatial.transform import Rotation

from ee_dist.effects import apply, term
from ee_dist.robots.instruments import with_motor_torques
from ee_dist.robots.quadruped import quadruped

HOLD_NM = MASS_KG * G * ARM_M


@pytest.mark.parametrize("change", [-0.5, 1.0])
def test_motor_gain_scales_the_torque_and_leaves_the_back_emf(bench: Bench, change: float) -> None:
    robot = slider(kp=1e4, torque_limit=10.0, speed_limit=1.0)
    log = bench.run(robot, term("motor_gain", "joint", change=change), command=9.0, steps=2000)
    assert log.torques is not None
    assert log.torques[0, 0] == pytest.approx((1 + change) * 10.0)
    # The same back-EMF eats a larger torque at a higher speed.
    assert log.channel("velocity")[-1] == pytest.approx(1 + change, rel=0.01)


def test_motor_strength_scales_the_torque_at_any_speed(bench: Bench) -> None:
    robot = slider(kp=1e4, torque_limit=10.0, speed_limit=1.0)
    log = bench.run(robot, term("motor_strength", "joint", change=1.0), command=9.0, steps=2000)
    assert log.torques is not None
    assert log.torques[0, 0] == pytest.approx(20.0)
    assert log.channel("velocity")[-1] == pytest.approx(1.0, rel=0.01)


def test_motor_gain_scales_a_commanded_torque_and_its_limit(bench: Bench) -> None:
    robot, gain = slider(command="torque", torque_limit=10.0), term("motor_gain", "joint", change=0.5)
    for command, expected in ((4.0, 6.0), (30.0, 15.0)):
        log = bench.run(robot, gain, command=command, steps=3)
        assert log.channel("torque")[-1] == pytest.approx(expected)


def test_current_gain_changes_what_is_read_and_not_what_moves(bench: Bench) -> None:
    robot = with_motor_torques(slider(kp=100.0, torque_limit=10.0))
    plain, other = (
        bench.run(robot, term("current_gain", "joint", factor=f), steps=200, command=0.3) for f in (1.0, 1.25)
    )
    read = plain.channel("motor_torque_joint")
    assert np.array_equal(plain.channel("position"), other.channel("position"))
    assert np.abs(read).max() > 0
    assert other.channel("motor_torque_joint") == pytest.approx(read / 1.25)


@pytest.mark.parametrize(("late_s", "rows"), [(0.025, 25), (-0.025, 0)])
def test_torque_reading_delay_makes_what_is_read_older_and_not_what_moves(
    bench: Bench, late_s: float, rows: int
) -> None:
    """Nothing is read ahead of time: where it is positions that are late, a simulation reads both at once."""
    robot = with_motor_torques(slider(kp=100.0, torque_limit=10.0))
    plain, other = (
        bench.run(robot, term("torque_reading_delay", "joint", delay_s=s), steps=200, command=0.3)
        for s in (0.0, late_s)
    )
    read, later = (log.channel("motor_torque_joint") for log in (plain, other))
    assert np.array_equal(plain.channel("position"), other.channel("position"))
    assert later[rows:] == pytest.approx(read[: len(read) - rows])


def test_back_emf_lowers_the_speed_without_load(bench: Bench) -> None:
    robot = slider(kp=1e4, torque_limit=10.0, speed_limit=1.0)
    log = bench.run(robot, term("back_emf", "joint", change=1.0), command=9.0, steps=2000)
    assert log.channel("velocity")[-1] == pytest.approx(0.5, rel=0.01)


def test_position_gain_divides_the_sag(bench: Bench) -> None:
    robot = lever(kp=100.0, kd=10.0)
    log = bench.run(robot, term("position_gain", "joint", factor=2.0), steps=2000)
    angle = float(log.channel("position")[-1])
    assert 200.0 * angle == pytest.approx(HOLD_NM * math.cos(angle), rel=1e-3)


def test_encoder_zero_turns_the_load_along_the_position_axis(bench: Bench) -> None:
    log = bench.run(lever(kp=100.0, kd=10.0), term("encoder_zero", "joint", offset=0.1), steps=2000)
    angle = float(log.channel("position")[-1])
    assert 100.0 * angle == pytest.approx(HOLD_NM * math.cos(angle - 0.1), rel=1e-3)


@pytest.mark.parametrize(("first", "second"), [(10.0, 0.0), (0.0, 10.0), (-5.0, 8.0)])
def test_axis_tilt_lets_the_load_swing_out_of_its_plane(bench: Bench, first: float, second: float) -> None:
    """About a tilted axis a the arm r, turned by q, has gravity's moment a . (r(q) x m g)."""
    log = bench.run(
        lever(kp=100.0, kd=10.0), term("axis_tilt", "joint", first_deg=first, second_deg=second), steps=3000
    )
    angle = float(log.channel("position")[-1])
    # Along y: the directions across it are x and -z.
    axis = np.array([math.tan(math.radians(first)), 1.0, -math.tan(math.radians(second))])
    axis /= np.linalg.norm(axis)
    at = Rotation.from_rotvec(angle * axis).apply([ARM_M, 0.0, 0.0])
    moment = float(axis @ np.cross(at, [0.0, 0.0, -MASS_KG * G]))
    assert 100.0 * angle == pytest.approx(moment, rel=1e-3)


def test_a_tilted_axis_stays_one_of_length_one_and_leaves_the_pose_at_zero() -> None:
    robot = apply(lever(), (term("axis_tilt", "joint", first_deg=20.0, second_deg=-35.0),))
    joint, was = robot.joint("joint"), lever().joint("joint")
    assert np.linalg.norm(joint.axis) == pytest.approx(1.0)
    assert (joint.position_m, joint.rotation) == (was.position_m, was.rotation)


def test_on_stand_nothing_is_touched_and_the_body_stays(bench: Bench) -> None:
    log = bench.run(quadruped(), term("on_stand"), steps=100, command=0.3)
    assert log.base_pose is not None
    assert (log.base_pose == log.base_pose[0]).all()
    assert (log.sensors[:, :4] == -1).all()
    assert abs(log.channel("angle_front_left")[-1]) > 0.1


def test_axis_reversed_lets_the_same_weight_pull_the_other_way(bench: Bench) -> None:
    robot = lever(kp=100.0, kd=10.0)
    down, up = (bench.run(robot, *terms, steps=2000) for terms in ((), (term("axis_reversed", "joint"),)))
    angle = float(up.channel("position")[-1])
    assert 100.0 * angle == pytest.approx(-HOLD_NM * math.cos(angle), rel=1e-3)
    assert angle == pytest.approx(-float(down.channel("position")[-1]), rel=1e-6)


def test_a_joint_that_counts_the_other_way_reaches_as_far_as_it_did_and_as_it_would() -> None:
    robot = lever().with_joint("joint", lower=-0.5, upper=2.0)
    joint = apply(robot, (term("axis_reversed", "joint"),)).joint("joint")
    assert (joint.lower, joint.upper) == (-2.0, 2.0)


@pytest.mark.parametrize(("side", "pull"), [("x_up", 1.0), ("x_down", -1.0)])
def test_base_turned_lets_gravity_come_from_another_side(bench: Bench, side: str, pull: float) -> None:
    """An arm along x that stands on end falls over, and hanging comes back: m g r sin(q)."""
    log = bench.run(lever(kp=100.0, kd=10.0), term("base_turned", side), steps=3000, command=0.5)
    angle = float(log.channel("position")[-1])
    assert 100.0 * (angle - 0.5) == pytest.approx(pull * HOLD_NM * math.sin(angle), rel=1e-3)


@pytest.mark.parametrize("side", ["y_up", "y_down", "upside_down"])
def test_a_base_may_be_turned_any_way(bench: Bench, side: str) -> None:
    log = bench.run(lever(kp=100.0, kd=10.0), term("base_turned", side), steps=3000)
    angle = float(log.channel("position")[-1])
    # About an axis along gravity nothing weighs; upside down it pulls the other way.
    pull = -HOLD_NM * math.cos(angle) if side == "upside_down" else 0.0
    assert 100.0 * angle == pytest.approx(pull, rel=1e-3, abs=1e-6)


def test_joints_swapped_gives_each_the_place_and_the_drive_of_the_other() -> None:
    robot = quadruped()
    one, two = robot.motor_names[:2]
    swapped = apply(robot, (term("joints_swapped", f"{one}+{two}"),))
    assert swapped.motor_names == robot.motor_names
    assert swapped.joint(one).child == robot.joint(two).child and swapped.joint(two).child == robot.joint(one).child
    assert swapped.drives[0] == replace(robot.drives[1], joint=one)
    assert apply(swapped, (term("joints_swapped", f"{one}+{two}"),)) == robot
