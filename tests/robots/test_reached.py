"""A joint that was measured beyond its stop has its stop elsewhere."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ee_dist.robots.model import Robot
from ee_dist.robots.reached import told, with_room
from ee_dist.robots.servo_pendulum import servo_pendulum


def stopped(lower: float, upper: float, noise: float = 0.0) -> Robot:
    robot = servo_pendulum()
    sensors = tuple(replace(s, noise=noise) for s in robot.sensors)
    return replace(robot, sensors=sensors, joints=tuple(replace(j, lower=lower, upper=upper) for j in robot.joints))


def readings(robot: Robot, position: np.ndarray) -> np.ndarray:
    """Of every sensor, the position of the joint: only that of the position sensor may count."""
    other = np.full(len(position), 9.0)
    return np.stack([position if s.kind == "position" else other for s in robot.sensors], axis=1)


def ends(robot: Robot) -> tuple[float, float]:
    (joint,) = robot.joints
    return joint.lower, joint.upper


def test_a_stop_that_was_passed_moves_to_where_the_joint_was_seen_and_the_other_stays() -> None:
    robot = stopped(-1.0, 1.0)
    found, lines = with_room(robot, [readings(robot, np.linspace(-0.2, 0.5)), readings(robot, np.linspace(-1.3, 0.9))])
    assert ends(found) == pytest.approx((-1.3, 1.0))
    (line,) = lines
    assert "-1.3 rad, 0.3 beyond the stop at -1" in line


def test_both_stops_and_none() -> None:
    robot = stopped(-0.1, 0.2)
    found, lines = with_room(robot, [readings(robot, np.linspace(-0.4, 0.5))])
    assert ends(found) == pytest.approx((-0.4, 0.5)) and len(lines) == 2
    assert with_room(found, [readings(robot, np.linspace(-0.4, 0.5))]) == (found, ())
    assert with_room(robot, []) == (robot, ())


@pytest.mark.parametrize(("noise", "beyond", "said"), [(0.0, 0.015, 0), (0.0, 0.03, 1), (0.01, 0.03, 0)])
def test_stops_give_way_a_little_and_sensors_are_noisy(noise: float, beyond: float, said: int) -> None:
    robot = stopped(-1.0, 1.0, noise)
    assert len(with_room(robot, [readings(robot, np.linspace(-0.3, 1.0 + beyond))])[1]) == said


def test_a_joint_without_ends_passes_none() -> None:
    (joint,) = stopped(-1e9, 1e9).joints
    assert not list(told(joint, -1e4, 1e4))
