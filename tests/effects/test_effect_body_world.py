"""Effects on the body and of the surroundings do what their numbers say."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from effect_robots import ARM_M, MASS_KG, Bench, G, block, lever

from ee_dist.effects import apply, term
from ee_dist.robots.model import Robot, Shape
from ee_dist.robots.quadruped import quadruped

BOX = Shape("box", (0.1, 0.1, 0.1))
BALL = Shape("sphere", (0.1,))
BLOCK_KG = MASS_KG + 1e-3


def holding_torque(bench: Bench, robot: Robot, *terms: object) -> float:
    """What the drive of a lever gives to hold it, with the angle's share taken out."""
    log = bench.run(robot, *terms, steps=2000)  # type: ignore[arg-type]
    return float(log.channel("torque")[-1] / math.cos(log.channel("position")[-1]))


def test_part_lost_takes_its_weight_and_its_touch_along(bench: Bench) -> None:
    robot = replace(quadruped(), world=replace(quadruped().world, has_floor=False))
    push = term("push", "body", along_x_n=10.0)
    for terms in ((), (term("part_lost", "upper_front_left"),)):
        kg = sum(p.mass_kg for p in apply(robot, terms).present_parts)
        log = bench.run(robot, *terms, push, steps=20)
        # Legs hang on springy drives, so the body alone starts ahead of the whole.
        assert log.travel_m == pytest.approx(0.5 * 10.0 / kg * 0.19**2, rel=0.15)
    standing = bench.run(quadruped(), term("part_lost", "lower_front_left"), steps=60)
    assert (standing.channel("touch_front_left") == -1).all()
    assert (standing.channel("touch_rear_right") == 1).any()
    assert standing.joints is not None
    assert (standing.joints[:, 1] == 0).all()


@pytest.mark.parametrize("change", [-0.5, 1.0])
def test_part_mass_changes_the_weight_that_the_joint_holds(bench: Bench, change: float) -> None:
    robot = lever(kp=100.0, kd=10.0)
    assert abs(holding_torque(bench, robot, term("part_mass", "arm", change=change))) == pytest.approx(
        (1 + change) * MASS_KG * G * ARM_M, rel=1e-3
    )


def test_com_shifted_changes_the_arm_that_the_weight_has(bench: Bench) -> None:
    robot = lever(kp=100.0, kd=10.0)
    assert abs(holding_torque(bench, robot, term("com_shifted", "arm", along_x_m=0.06))) == pytest.approx(
        MASS_KG * G * (ARM_M + 0.06), rel=1e-3
    )


def test_floor_tilt_turns_gravity(bench: Bench) -> None:
    log = bench.run(block(), term("floor_tilt", "floor", sideways_deg=20.0, forward_deg=10.0), steps=501)
    assert log.base_pose is not None
    fall = (log.base_pose[-1, :3] - log.base_pose[0, :3]) / (0.5 * 0.5**2 * G)
    a, b = math.radians(20.0), math.radians(10.0)
    assert fall == pytest.approx([math.sin(b) * math.cos(a), -math.sin(a), -math.cos(a) * math.cos(b)], rel=5e-3)
    assert np.linalg.norm(fall) == pytest.approx(1.0, rel=5e-3), "a slope changes the direction of gravity only"


@pytest.mark.parametrize("change", [-0.5, 0.5])
def test_floor_friction_slows_a_block_by_its_coefficient(bench: Bench, change: float) -> None:
    robot = block(height_m=0.1, shape=BOX, friction=0.4)
    log = bench.run(robot, term("floor_friction", "floor", change=change), steps=251, twist=(2.0, 0, 0, 0, 0, 0))
    assert log.base_pose is not None
    x = log.base_pose[:, 0]
    slowed = (x[200] - 2 * x[125] + x[50]) / 0.075**2
    assert slowed == pytest.approx(-(1 + change) * 0.4 * G, rel=0.05)


def test_floor_compliance_is_depth_over_weight(bench: Bench) -> None:
    soft = [
        bench.run(
            block(height_m=0.1, shape=BALL), term("floor_compliance", "floor", compliance_m_n=give), steps=1500
        ).channel("height")[-1]
        for give in (1e-4, 5e-4)
    ]
    assert soft[0] - soft[1] == pytest.approx(4e-4 * BLOCK_KG * G, rel=0.05)


def test_push_accelerates_a_free_body_by_force_over_mass(bench: Bench) -> None:
    log = bench.run(block(), term("push", "body", along_x_n=6.0, along_y_n=-3.0), steps=501)
    assert log.base_pose is not None
    moved = (log.base_pose[-1, :2] - log.base_pose[0, :2]) / (0.5 * 0.5**2)
    assert moved == pytest.approx([6.0 / BLOCK_KG, -3.0 / BLOCK_KG], rel=5e-3)


def test_drag_lets_speed_decay_with_mass_over_damping(bench: Bench) -> None:
    log = bench.run(block(), term("drag", "body", damping_n_s_m=4.0), steps=501, twist=(1.0, 0.5, 0, 0, 0, 0))
    assert log.base_pose is not None
    speed = (log.base_pose[-1, :2] - log.base_pose[-2, :2]) / 0.001
    assert speed == pytest.approx(np.array([1.0, 0.5]) * math.exp(-0.5 * 4.0 / BLOCK_KG), rel=0.01)
    fall = (log.base_pose[-1, 2] - log.base_pose[-2, 2]) / 0.001
    assert fall == pytest.approx(-BLOCK_KG * G / 4.0 * (1 - math.exp(-0.5 * 4.0 / BLOCK_KG)), rel=0.01)
