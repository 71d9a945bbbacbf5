"""A joint that turns on and on has no range to take shares of."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from way_samples import evaluator_for, measure, samples

from ee_dist.discrepancy.compare import compare
from ee_dist.discrepancy.ways.open_loop.predictability import ensemble
from ee_dist.discrepancy.ways.open_loop.problem import OpenLoop
from ee_dist.robots.model import CONTINUOUS_RAD, Robot


def endless(robot: Robot) -> Robot:
    """The robot as an MJCF describes it whose joints have no range."""
    joints = tuple(replace(j, lower=-CONTINUOUS_RAD, upper=CONTINUOUS_RAD) for j in robot.joints)
    return replace(robot, joints=joints)


@pytest.mark.parametrize("name", ["pendulum", "arm"])
def test_neighbours_of_a_robot_without_ends_stand_no_farther_off_than_those_of_one_with_a_turn(name: str) -> None:
    robot = endless(samples()[name].robot)
    offsets = [abs(d.zero_offset) for r in ensemble(robot) for d in r.drives]
    assert 0 < max(offsets) < 0.001 * 2 * math.pi


def test_positions_of_a_servo_without_ends_weigh_as_much_as_those_of_one_with_a_turn() -> None:
    sample = samples()["pendulum"]
    trials = measure(sample, sample.hidden)
    turn = replace(sample.robot, joints=tuple(replace(j, lower=-math.pi, upper=math.pi) for j in sample.robot.joints))
    with_ends, without = (OpenLoop(trials, r, evaluator_for(r)) for r in (turn, endless(sample.robot)))
    column = [s.kind for s in turn.sensors].index("position")
    known, found = (np.concatenate([d[:, column] for d in p.weights.deviation]) for p in (with_ends, without))
    assert found == pytest.approx(known, rel=0.05)


def test_a_joint_without_ends_is_in_no_regime_near_them() -> None:
    sample = samples()["pendulum"]
    robot = endless(sample.robot)
    problem = OpenLoop(measure(sample, sample.hidden), robot, evaluator_for(robot))
    names = {r.name for r in compare(problem, problem.residuals([()])[0]).regimes}
    assert "moving" in names and not {n for n in names if "limit" in n}
