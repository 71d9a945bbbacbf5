"""A real robot that walks about begins as it was read: with its joints there, tilted as it said, its feet on the floor."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from ee_dist.discrepancy.measured_trial import MeasuredTrial
from ee_dist.discrepancy.starting import start_of
from ee_dist.discrepancy.ways.open_loop.falls import fallen
from ee_dist.discrepancy.ways.open_loop.in_units import farther_off
from ee_dist.engines.contract import Rollout
from ee_dist.engines.drivers import Commands
from ee_dist.robots.model import Part, Robot, Shape
from ee_dist.robots.quadruped_lab import quadruped_lab
from ee_dist.robots.standing import lowest_m, stood
from ee_dist.robots.urdf_attributes import turn_of_rpy
from ee_dist.tasks.config import Config, EngineConfig
from ee_dist.tasks.wiring import engine_maker
from ee_dist.trials.log import Array, SensorLog

TILT = turn_of_rpy((0.3, -0.2, 0.5))
SIZES = {"box": (0.2, 0.1, 0.05), "sphere": (0.1,), "capsule": (0.05, 0.3), "cylinder": (0.05, 0.3)}


def surface(kind: str, size: tuple[float, ...]) -> Array:
    """(N, 3) points of the surface of a shape, its lowest among them but for a little."""
    turn, along = np.meshgrid(np.linspace(0, 2 * np.pi, 721), np.linspace(-1, 1, 401))
    if kind == "box":
        return np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * size
    if kind == "cylinder":
        ring = np.stack([np.cos(turn), np.sin(turn), along * size[1] / 2 / size[0]], axis=-1)
        return ring.reshape(-1, 3) * size[0]
    high = np.sqrt(1 - along**2)
    ball = size[0] * np.stack([high * np.cos(turn), high * np.sin(turn), along], axis=-1).reshape(-1, 3)
    if kind == "sphere":
        return ball
    return np.concatenate([ball + np.array([0, 0, side * size[1] / 2]) for side in (-1, 1)])


@pytest.mark.parametrize("kind", SIZES)
def test_the_lowest_point_of_a_shape(kind: str) -> None:
    robot = quadruped_lab()
    part = Part(
        "alone", 1.0, (0.0, 0.0, 0.0), (1.0, 1.0, 1.0, 0, 0, 0), (Shape(kind, SIZES[kind], (0.1, 0.2, -0.1), TILT),)
    )
    alone = replace(robot, parts=(part,), joints=(), drives=(), sensors=())
    x, y, z, w = TILT
    up = np.array(
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]
    )  # the floor's z in the shape's axes
    wanted = 0.4 - 0.1 + (surface(kind, SIZES[kind]) @ up).min()
    (found,) = lowest_m(alone, np.array([[0, 0, 0.4, 0, 0, 0, 1.0]]), np.zeros((1, 0)))
    assert found == pytest.approx(wanted, abs=1e-5)


def test_a_robot_as_described_stands_where_it_is_described_to() -> None:
    robot = quadruped_lab()
    (pose,) = stood(robot, np.array([[robot.joint(m).start for m in robot.motor_names]]), None, None)
    assert pose[:3] == pytest.approx(robot.start_position_m, abs=2e-3)
    assert pose[3:] == pytest.approx(robot.start_rotation)


def trial_of(robot: Robot, joints: Array, tilt: tuple[float, float], real: bool) -> MeasuredTrial:
    read = {"roll": tilt[0], "pitch": tilt[1]}
    sensors = np.array([[read.get(s.kind, 0.0) for s in robot.sensors]] * 2)
    names, units = robot.sensor_names, tuple(s.unit for s in robot.sensors)
    both = np.array([joints, joints])
    log = SensorLog(np.array([0.0, 0.01]), sensors, both, names, units, robot.motor_names, joints=both)
    return MeasuredTrial("t", log, Commands(log.commands), commands_held=real)


@pytest.mark.parametrize("name", ["mujoco", "pybullet"])
def test_it_begins_as_it_was_read_in_both_engines(name: str) -> None:
    robot = quadruped_lab()
    joints = 0.3 * np.sin(np.arange(len(robot.motor_names)))
    start = start_of(trial_of(robot, joints, (0.15, -0.1), True), robot)
    assert start is not None
    engine = engine_maker(Config(engine=EngineConfig(name, 1)), alone=True)()
    try:
        (log,) = engine.rollout([Rollout(robot, Commands(np.tile(joints, (2, 1))), 2, start=start, pose=True)])
    finally:
        engine.close()
    first = dict(zip((s.kind for s in robot.sensors), log.sensors[0], strict=True))
    assert (first["roll"], first["pitch"]) == pytest.approx((0.15, -0.1), abs=5e-3)
    assert log.joints is not None and log.base_pose is not None
    assert log.joints[0] == pytest.approx(joints, abs=5e-3)
    assert lowest_m(robot, log.base_pose[:1], log.joints[:1]) == pytest.approx(0.0, abs=1e-3)


def test_a_simulated_one_begins_as_described() -> None:
    robot = quadruped_lab()
    joints = np.full(len(robot.motor_names), 0.2)
    assert start_of(trial_of(robot, joints, (0.0, 0.0), False), robot) is None


def test_a_real_one_stands_whichever_way_its_commands_are_read() -> None:
    robot = quadruped_lab()
    trial = trial_of(robot, np.full(len(robot.motor_names), 0.2), (0.0, 0.0), False)
    assert start_of(replace(trial, hardware=True), robot) is not None


def test_a_model_that_is_farther_off_in_plain_numbers_is_told_so() -> None:
    was = {("position", "rad"): 0.0251, ("roll", "rad"): 0.1}
    said = farther_off(was, {("position", "rad"): 0.0451, ("roll", "rad"): 0.05}, True)
    assert "position 25.1 mrad -> 45.1 mrad" in said and "roll" not in said
    assert not farther_off(was, {("position", "rad"): 0.0255, ("roll", "rad"): 0.05}, True)
    said = farther_off(was, {("position", "rad"): 0.0250, ("roll", "rad"): 0.0999}, True)
    assert said.startswith("Hardly nearer than before") and "position 25.1 mrad -> 25 mrad; roll" in said
    assert "though the error fell" in said


def test_an_error_that_did_not_fall_is_not_said_to_have_fallen() -> None:
    was = {("position", "rad"): 0.0251}
    said = farther_off(was, {("position", "rad"): 0.0451}, False)
    assert said.startswith("Farther off than before in plain numbers, and the error did not fall: position 25.1 mrad")
    assert not farther_off(was, {("position", "rad"): 0.0250}, False), "nothing got better, and nothing says so"


def test_a_base_without_a_floor_stays_as_high() -> None:
    robot = quadruped_lab()
    air = replace(robot, world=replace(robot.world, has_floor=False))
    (pose,) = stood(air, np.zeros((1, len(robot.motor_names))), np.array([math.pi / 3]), None)
    assert pose[2] == robot.start_position_m[2]
    assert pose[3] == pytest.approx(math.sin(math.pi / 6))


def test_a_simulated_robot_that_falls_over_where_the_real_one_stands_is_told() -> None:
    robot = quadruped_lab()
    joints = np.full(len(robot.motor_names), 0.2)
    upright, down = (np.array([[0, 0, 0.2, *turn_of_rpy((roll, 0.0, 0.0))]] * 2) for roll in (0.1, 1.5))
    down[0] = upright[0]

    def said(real: float, poses: Array) -> list[str]:
        trial = trial_of(robot, joints, (real, 0.0), True)
        return fallen(robot, [trial], [replace(trial.log, base_pose=poses)])

    (line,) = said(0.1, down)
    assert "t at 0.01 s" in line
    assert not said(0.1, upright)
    assert not said(1.5, down), "so did the real one"
    assert not fallen(replace(robot, free_base=False), [], [])
