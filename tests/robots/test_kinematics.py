"""Part poses against cases worked out by hand."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from ee_dist.robots.kinematics import part_poses, quat_multiply, quat_rotate
from ee_dist.robots.model import Drive, Joint, Part, Robot, Wiring
from ee_dist.robots.quadruped import LEGS, UPPER_M, quadruped

HALF = math.sqrt(0.5)
INERTIA = (1.0, 1.0, 1.0, 0.0, 0.0, 0.0)
AT_ORIGIN = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])
QUARTER_Z = (0.0, 0.0, HALF, HALF)


def arm(*joints: Joint, driven: tuple[str, ...]) -> Robot:
    names = ["base", *(j.child for j in joints)]
    drives = tuple(Drive(j, 1.0, 0.0, 0.0, 1.0, 1.0) for j in driven)
    parts = tuple(Part(n, 1.0, (0.0, 0.0, 0.0), INERTIA) for n in names)
    return Robot("arm", parts, joints, drives, (), Wiring(tuple(range(len(drives)))))


SHOULDER = Joint("shoulder", "hinge", "base", "upper", (0.0, 0.0, 1.0), (0.0, 0.0, 1.0), -9.0, 9.0)
ELBOW = Joint("elbow", "hinge", "upper", "lower", (2.0, 0.0, 0.0), (0.0, 1.0, 0.0), -9.0, 9.0)
RAIL = Joint("rail", "slide", "lower", "hand", (0.0, 0.0, -1.0), (0.0, 0.0, 2.0), -9.0, 9.0)
TOOL = Joint("tool", "fixed", "hand", "tip", (0.5, 0.0, 0.0), (0.0, 0.0, 1.0), 0.0, 0.0, QUARTER_Z)


def test_chain_of_hinge_hinge_slide_and_bond() -> None:
    robot = arm(SHOULDER, ELBOW, RAIL, TOOL, driven=("shoulder", "elbow", "rail"))
    joints = np.array([[0.0, 0.0, 0.0], [math.pi / 2, 0.0, 0.0], [math.pi / 2, math.pi / 2, 0.25]])
    poses = part_poses(robot, AT_ORIGIN, joints)
    assert list(poses) == ["base", "upper", "lower", "hand", "tip"]
    assert all(p.shape == (3, 7) for p in poses.values())
    assert_allclose(poses["lower"][:, :3], [[2, 0, 1], [0, 2, 1], [0, 2, 1]], atol=1e-15)
    # Third row: the elbow turns the lower arm's -z to -x of the upper arm, which is -y of the base.
    assert_allclose(poses["hand"][:, :3], [[2, 0, 0], [0, 2, 0], [0, 1.25, 1]], atol=1e-15)
    assert_allclose(poses["tip"][:, :3], [[2.5, 0, 0], [0, 2.5, 0], [0, 1.25, 0.5]], atol=1e-15)
    assert_allclose(poses["upper"][:, 3:], [[0, 0, 0, 1], QUARTER_Z, QUARTER_Z], atol=1e-15)
    assert_allclose(np.abs(poses["tip"][1, 3:]), [0, 0, 1, 0], atol=1e-15)


def test_base_pose_carries_all_parts() -> None:
    robot = arm(SHOULDER, ELBOW, driven=("shoulder", "elbow"))
    base = np.array([[10.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], [0.0, 20.0, 0.0, *QUARTER_Z]])
    poses = part_poses(robot, base, np.zeros((2, 2)))
    assert_allclose(poses["base"], base)
    assert_allclose(poses["lower"][:, :3], [[12, 0, 1], [0, 22, 1]], atol=1e-15)


def test_turned_mounting_moves_the_axis_with_it() -> None:
    # Mounted with a quarter turn about z, the child's y axis points along -x of the base.
    mounted = replace(ELBOW, parent="base", rotation=QUARTER_Z)
    poses = part_poses(arm(mounted, driven=("elbow",)), AT_ORIGIN, np.array([[math.pi / 2]]))
    turned = quat_rotate(poses["lower"][:, 3:], np.array([0.0, 0.0, -1.0]))
    assert_allclose(turned, [[0.0, -1.0, 0.0]], atol=1e-15)


def test_joints_in_any_order_and_without_a_drive() -> None:
    shuffled = arm(RAIL, ELBOW, SHOULDER, driven=("elbow", "shoulder"))
    poses = part_poses(shuffled, AT_ORIGIN, np.array([[0.0, math.pi / 2]]))
    assert_allclose(poses["hand"][0, :3], [0.0, 2.0, 0.0], atol=1e-15)


def test_lost_leg_is_absent_and_the_others_stay() -> None:
    robot, base = quadruped(), np.array([0.0, 0.0, 0.148, 0.0, 0.0, 0.0, 1.0])
    joints = np.full((4, 8), 0.1)
    whole, broken = part_poses(robot, base, joints), part_poses(robot.without("upper_front_left"), base, joints)
    assert set(whole) - set(broken) == {"upper_front_left", "lower_front_left"}
    for name, pose in broken.items():
        assert pose.tobytes() == whole[name].tobytes()


def test_quadruped_stands_on_four_feet_at_rest() -> None:
    robot = quadruped()
    base = np.array([*robot.start_position_m, *robot.start_rotation])
    poses = part_poses(robot, base, np.zeros((1, 8)))
    for leg in LEGS:
        hip, knee = poses[f"upper_{leg}"][0], poses[f"lower_{leg}"][0]
        assert knee[2] == pytest.approx(0.148)
        assert np.hypot(*(knee - hip)[:2]) == pytest.approx(UPPER_M)
        assert (knee[0] > 0) == leg.startswith("front")
        assert (knee[1] > 0) == leg.endswith("left")


def test_rotation_agrees_with_multiplication() -> None:
    rng = np.random.default_rng(0)
    q = rng.normal(size=(50, 4))
    q /= np.linalg.norm(q, axis=1, keepdims=True)
    v = rng.normal(size=(50, 3))
    back = q * [-1, -1, -1, 1]
    product = quat_multiply(quat_multiply(q, np.concatenate([v, np.zeros((50, 1))], axis=1)), back)
    assert_allclose(quat_rotate(q, v), product[:, :3], atol=1e-14)


@pytest.mark.parametrize(
    ("base", "joints"),
    [(np.zeros((3, 7)), np.zeros((3, 7))), (np.zeros((2, 7)), np.zeros((3, 8))), (np.zeros(7), np.zeros(8))],
)
def test_wrong_shapes_are_refused(base: np.ndarray, joints: np.ndarray) -> None:
    with pytest.raises(ValueError, match="expected"):
        part_poses(quadruped(), base, joints)


def test_part_that_hangs_on_nothing_is_refused() -> None:
    robot = arm(SHOULDER, replace(ELBOW, parent="nowhere"), driven=("shoulder", "elbow"))
    with pytest.raises(ValueError, match="'elbow' hangs on 'nowhere'"):
        part_poses(robot, AT_ORIGIN, np.zeros((1, 2)))
