"""A plan that would do harm: torques that are commanded hold nothing, and an arm falls on its stop."""

from __future__ import annotations

from dataclasses import replace
from unittest.mock import Mock

import numpy as np
import pytest

from ee_dist.discrepancy.plan import Contender, PlannedTrial, harm, predicted, ranked
from ee_dist.effects.catalogue import term
from ee_dist.engines.mujoco.engine import MuJoCoEngine
from ee_dist.evaluation.cache import CachedEvaluator
from ee_dist.evaluation.serial import SerialEvaluator
from ee_dist.robots.model import Robot
from ee_dist.robots.servo_pendulum import servo_pendulum
from ee_dist.tasks.plan import harmful
from ee_dist.trials.excitation import Excitation
from ee_dist.trials.noise import with_noise

LARGE, SMALL = Excitation("sway", 1.0, 0.9, 1), Excitation("sway", 1.0, 0.01, 1)
PAIR = [
    Contender((term("part_mass", "arm", change=0.25),)),
    Contender((term("viscous_friction", "servo", damping_nm_s_rad=0.01),)),
]


def pendulum(command: str, upper: float = 0.5, top_speed: float = float("inf")) -> Robot:
    robot = with_noise(servo_pendulum(), 0.001)
    joints = tuple(replace(j, lower=-upper, upper=upper, top_speed=top_speed) for j in robot.joints)
    return replace(robot, joints=joints, drives=tuple(replace(d, command=command) for d in robot.drives))


@pytest.fixture(scope="module")
def evaluator() -> CachedEvaluator:
    return CachedEvaluator(SerialEvaluator(MuJoCoEngine(1)))


@pytest.mark.parametrize(
    ("robot", "said"),
    [
        (pendulum("torque"), "servo meets its stop"),
        (pendulum("torque", 6.0, 0.5), "servo goes faster than 0.5 rad/s"),
        (pendulum("torque", 6.0), ""),
        (pendulum("position"), ""),
    ],
)
def test_torques_that_drive_a_joint_where_it_must_not_go_are_told(robot, said, evaluator) -> None:
    (large,) = predicted(robot, PAIR, [LARGE], evaluator)
    assert large.harm == said
    assert (large.separation == 0.0) == bool(said)


def test_a_trial_that_does_harm_goes_last_and_where_all_do_it_is_said(evaluator) -> None:
    robot = pendulum("torque")
    found = ranked(2, predicted(robot, PAIR, [LARGE, SMALL], evaluator))
    assert [t.excitation for t in found.trials] == [SMALL, LARGE]
    assert not found.best.harm
    bad = ranked(2, [PlannedTrial(LARGE, 0.0, (0.0,), "servo meets its stop")])
    assert "on each of 1 trials" in harmful(robot, bad) and "servo meets its stop" in harmful(robot, bad)


def test_a_joint_that_begins_at_its_stop_is_not_driven_there() -> None:
    robot = pendulum("torque")
    still = np.full((5, 1), robot.joints[0].upper)
    assert harm(robot, Mock(joints=still, finite=True)) == ""
    assert harm(robot, Mock(joints=still - np.linspace(0.4, 0.0, 5)[:, None], finite=True)) == "servo meets its stop"


def test_of_what_nobody_recorded_nothing_is_told() -> None:
    assert harm(pendulum("torque"), Mock(joints=None, finite=True)) == ""
