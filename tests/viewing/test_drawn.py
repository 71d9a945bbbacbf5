"""The solids that stand for a part."""

from __future__ import annotations

import numpy as np
import pytest

from ee_dist.robots.kinematics import quat_rotate
from ee_dist.robots.model import Joint, Part, Robot, Shape, Wiring
from ee_dist.robots.pictured import solids_of
from ee_dist.robots.quadruped import FOOT_M, LOWER_M, UPPER_M, quadruped
from ee_dist.robots.servo_pendulum import servo_pendulum
from ee_dist.viewing.drawn import columns

INERTIA = (1e-3, 1e-3, 1e-3, 0.0, 0.0, 0.0)


def ends(shape: Shape) -> np.ndarray:
    """Both ends of a rod, lower z first."""
    half = quat_rotate(np.array(shape.rotation), np.array((0.0, 0.0, shape.size[1] / 2)))
    both = np.array([np.array(shape.position_m) - half, np.array(shape.position_m) + half])
    return both[np.lexsort(both.T)]


def test_a_lower_leg_is_a_foot_and_a_rod_from_the_knee_to_it() -> None:
    robot = quadruped()
    foot, rod = solids_of(robot, robot.part("lower_rear_left"))
    assert (foot.shape.kind, foot.shape.size, foot.senses) == ("sphere", (FOOT_M,), True)
    np.testing.assert_allclose(ends(rod.shape), [(0, 0, -LOWER_M), (0, 0, 0)], atol=1e-12)
    assert not rod.senses


def test_parts_whose_shapes_reach_their_joints_get_no_rods() -> None:
    robot = quadruped()
    assert [s.name for s in solids_of(robot, robot.part("upper_rear_left"))] == ["capsule_0"]


@pytest.mark.parametrize("end", [(0.1, 0.0, 0.0), (0.0, 0.0, -0.2), (0.0, 0.0, 0.2), (0.05, -0.1, 0.03)])
def test_a_rod_points_to_the_joint_that_it_carries(end: tuple[float, float, float]) -> None:
    parts = (Part("a", 1.0, (0.0, 0.0, 0.0), INERTIA), Part("b", 1.0, (0.0, 0.0, 0.0), INERTIA))
    joint = Joint("j", "hinge", "a", "b", end, (0.0, 1.0, 0.0), -1.0, 1.0)
    robot = Robot("two", parts, (joint,), (), (), Wiring(()))
    rod = solids_of(robot, parts[0])[-1].shape
    expected = np.array([(0.0, 0.0, 0.0), end])
    np.testing.assert_allclose(ends(rod), expected[np.lexsort(expected.T)], atol=1e-12)


def test_a_pendulum_without_shapes_is_a_block_a_rod_and_a_ball_at_its_mass() -> None:
    robot = servo_pendulum(length_m=0.2)
    assert [s.shape.kind for s in solids_of(robot, robot.root)] == ["box"]
    ball, rod = solids_of(robot, robot.part("arm"))
    assert ball.shape.kind == "sphere"
    assert ball.shape.position_m == (0.0, 0.0, -0.2)
    np.testing.assert_allclose(ends(rod.shape), [(0, 0, -0.2), (0, 0, 0)], atol=1e-12)


def test_a_capsule_begins_half_its_length_before_its_middle() -> None:
    robot = quadruped()
    (solid,) = solids_of(robot, robot.part("upper_rear_left"))
    found = {c.component_descriptor().component: c.as_arrow_array().to_pylist() for c in columns(solid, None, False, 1)}
    np.testing.assert_allclose(found["Capsules3D:translations"][0][0], (0.0, 0.0, 0.0), atol=1e-7)
    assert found["Capsules3D:lengths"][0][0] == pytest.approx(UPPER_M)
    assert "Capsules3D:colors" not in found
