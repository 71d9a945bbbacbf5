"""Torques that a motion needs, against a pendulum by hand and against the engines."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ee_dist.effects.catalogue import apply, term
from ee_dist.engines.contract import Rollout
from ee_dist.engines.drivers import Commands
from ee_dist.engines.mujoco.engine import MuJoCoEngine
from ee_dist.engines.one_joint import OneJointEngine, fits
from ee_dist.engines.pybullet.engine import PyBulletEngine
from ee_dist.robots.describe import load_robot
from ee_dist.robots.inverse_dynamics import (
    geometry,
    gravity,
    gravity_regressor,
    joint_torques,
    parameters,
    regressor,
    rotors,
    torques_of_parts,
    weights,
)
from ee_dist.robots.linear_stage import linear_stage
from ee_dist.robots.model import RobotError, Shape
from ee_dist.robots.quadruped import quadruped
from ee_dist.robots.servo_pendulum import servo_pendulum
from ee_dist.trials.log import State

ARM = Path(__file__).parents[2] / "docs" / "examples" / "arm.yaml"


def test_a_pendulum_by_hand() -> None:
    robot = servo_pendulum(mass_kg=0.5, length_m=0.2)
    q, w, a = (np.array([[0.3], [1.0], [-2.0]]), np.array([[0.0], [2.0], [-1.0]]), np.array([[0.0], [5.0], [-3.0]]))
    expected = (0.5 * 0.2**2 + robot.drives[0].rotor_inertia) * a + 0.5 * 9.81 * 0.2 * np.sin(q)
    assert joint_torques(robot, q, w, a) == pytest.approx(expected, rel=1e-6)


def test_a_slide_on_a_slope_by_hand() -> None:
    robot = linear_stage(mass_kg=10.0).with_world(tilt_y_rad=0.2)
    one = np.ones((1, 1))
    assert joint_torques(robot, one, one, 2 * one)[0, 0] == pytest.approx(10 * (2 - 9.81 * np.sin(0.2)))


def test_an_arm_moves_as_its_torques_say() -> None:
    robot, _ = load_robot(ARM)
    robot = replace(robot, time_step_s=0.0005, sensors=(), drives=tuple(replace(d, viscous=0.0) for d in robot.drives))
    t = np.arange(2000) * robot.time_step_s
    commands = np.stack([0.5 * np.sin(3 * t), 0.4 * np.sin(4 * t), 0.6 * np.sin(5 * t)], axis=1)
    log = MuJoCoEngine(threads=1).rollout([Rollout(robot, Commands(commands), len(t), pose=True)])[0]
    assert log.joints is not None
    assert log.torques is not None
    speed = np.gradient(log.joints, robot.time_step_s, axis=0)
    needed = joint_torques(robot, log.joints, speed, np.gradient(speed, robot.time_step_s, axis=0))
    rest = slice(200, -10)
    assert np.abs(needed - log.torques)[rest].max() < 0.02 * np.abs(log.torques).max()


def test_what_it_cannot_do() -> None:
    with pytest.raises(RobotError, match="base moves freely"):
        joint_torques(quadruped(), *(np.zeros((1, 8)),) * 3)
    robot, _ = load_robot(ARM)
    with pytest.raises(RobotError, match="'turn' has no drive"):
        joint_torques(replace(robot, drives=robot.drives[1:]), *(np.zeros((1, 2)),) * 3)


@pytest.mark.parametrize(
    "robot", [servo_pendulum(viscous=0.005).with_drive("servo", coulomb=0.01), linear_stage(viscous=200.0)]
)
def test_three_engines_agree_on_one_joint(robot) -> None:  # type: ignore[no-untyped-def]
    t = np.arange(800) * robot.time_step_s
    commands = 0.1 * np.sin(5 * t)[:, None]
    job = [Rollout(robot, Commands(commands), len(t), start=State(np.array([0.05]), np.array([0.1])))]
    logs = [e.rollout(job)[0] for e in (OneJointEngine(), MuJoCoEngine(threads=1), PyBulletEngine())]
    for other in logs[1:]:
        assert logs[0].sensors == pytest.approx(other.sensors, abs=1e-7)


def test_one_joint_rows_do_not_depend_on_their_batch() -> None:
    robots = [servo_pendulum().with_drive("servo", coulomb=c) for c in (0.0, 0.01, 0.05)]
    jobs = [Rollout(r, Commands(np.full((1, 1), 0.7)), 300) for r in robots]
    together = OneJointEngine().rollout(jobs)
    for job, log in zip(jobs, together, strict=True):
        assert np.array_equal(OneJointEngine().rollout([job])[0].sensors, log.sensors)
    assert not fits(quadruped())


def test_one_joint_knows_no_floor_that_its_body_could_touch() -> None:
    hinge = servo_pendulum()
    joint = hinge.joints[0]
    ball = Shape("sphere", (0.1,), (0.0, 0.0, -0.3))
    for robot in (hinge, hinge.with_joint(joint.name, kind="slide", axis=(0.0, 0.0, 1.0), lower=-0.3, upper=0.3)):
        shaped = robot.with_part(joint.child, shapes=(ball,)).with_joint(joint.name, position_m=(0.0, 0.0, 0.0))
        shaped = replace(shaped, start_position_m=(0.0, 0.0, 0.3))
        high = replace(shaped, start_position_m=(0.0, 0.0, 1.0))
        assert fits(shaped)
        assert not fits(shaped.with_world(has_floor=True))
        assert fits(high.with_world(has_floor=True))
        assert fits(robot.with_part(joint.child, shapes=()).with_world(has_floor=True))


def test_an_encoder_mounted_turned() -> None:
    """Reading zero, the arm stands 0.1 rad aside, and gravity pulls there."""
    robot = apply(servo_pendulum(), (term("encoder_zero", "servo", offset=0.1),))
    still = np.zeros((1, 1))
    assert joint_torques(robot, still, still, still)[0, 0] == pytest.approx(0.49 * 9.81 * 0.1 * np.sin(-0.1))
    assert joint_torques(robot, still + 0.1, still, still)[0, 0] == pytest.approx(0.0, abs=1e-12)


def test_gravity_adds_what_is_linear_in_it() -> None:
    robot, _ = load_robot(ARM)
    rng = np.random.default_rng(0)
    q, v, a = rng.normal(size=(3, 4, len(robot.drives)))
    tilted = robot.with_world(tilt_x_rad=0.2, tilt_y_rad=-0.3)
    pull = np.tensordot(gravity(tilted) - gravity(robot), gravity_regressor(robot, q), 1)
    level, tipped = regressor(robot, q, v, a), regressor(tilted, q, v, a)
    np.testing.assert_allclose(weights(level) + pull, weights(tipped), atol=1e-9)
    masses = parameters(robot)
    np.testing.assert_allclose(level @ masses + pull @ weights(masses), tipped @ masses, atol=1e-9)
    assert geometry(robot) == geometry(tilted.with_part("forearm", mass_kg=3.0).with_joint("elbow", freedom=0.5))
    assert geometry(robot) != geometry(robot.with_joint("elbow", axis=(1.0, 0.0, 0.0)))


@pytest.mark.parametrize("tilted", [False, True])
def test_torques_of_one_set_of_masses_are_those_of_the_regressor(tilted: bool) -> None:
    rng = np.random.default_rng(4)
    arm, _ = load_robot(ARM)
    if tilted:
        arm = replace(arm.with_world(tilt_x_rad=0.3, tilt_y_rad=-0.2), start_rotation=(0.5, 0.5, 0.5, 0.5))
    for robot in (arm, linear_stage(mass_kg=3.0), servo_pendulum()):
        q, w, a = rng.standard_normal((3, 50, len(robot.drives)))
        linear = regressor(robot, q, w, a) @ parameters(robot)
        np.testing.assert_allclose(torques_of_parts(robot, q, w, a), linear, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(joint_torques(robot, q, w, a), linear + rotors(robot) * a, rtol=1e-9, atol=1e-9)
