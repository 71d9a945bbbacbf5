"""What second differences find of a quick motion is motion, however seldom it is read; of noise all differences find the same."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from way_samples import evaluator_for, samples

from ee_dist.discrepancy.measured_trial import MeasuredTrial
from ee_dist.discrepancy.slow_noise import without_motion
from ee_dist.discrepancy.ways.free_run.problem import FreeRun
from ee_dist.discrepancy.ways.open_loop.prediction import roughness
from ee_dist.discrepancy.ways.open_loop.scale import channel_scale
from ee_dist.engines.drivers import Commands
from ee_dist.robots.model import Robot
from ee_dist.trials.log import Array, SensorLog

STEP_S = 0.01


def second(values: Array) -> Array:
    return np.asarray(np.sqrt(np.median(roughness(values), axis=0) / 0.455))


@pytest.mark.parametrize("hz", [0.3, 1.0, 3.0])
def test_a_swing_read_thirty_times_a_turn_is_not_taken_for_noise(hz: float) -> None:
    t = np.arange(0, 6, STEP_S)
    for noise in (1e-4, 1e-3):
        read = np.sin(2 * np.pi * hz * t)[:, None] + noise * np.random.default_rng(1).standard_normal((len(t), 1))
        found = float(without_motion(second(read), t, read)[0])
        assert 0.7 * noise < found < 2.2 * noise


def test_noise_stays_what_second_differences_find() -> None:
    t = np.arange(0, 6, STEP_S)
    for seed in range(30):
        read = np.random.default_rng(seed).standard_normal((len(t), 3))
        assert np.array_equal(without_motion(second(read), t, read), second(read))


def swinging(robot: Robot, noise: float) -> MeasuredTrial:
    t = np.arange(0, 6, robot.time_step_s)
    joints = np.stack([np.sin(2 * np.pi * f * t) for f in (2.0, 3.1)], axis=1)
    read = joints + noise * np.random.default_rng(2).standard_normal(joints.shape)
    speeds = np.gradient(read, t, axis=0)
    sensors = np.stack(
        [(read if s.kind == "position" else speeds)[:, robot.motor_names.index(s.target)] for s in robot.sensors],
        axis=1,
    )
    log = SensorLog(
        t,
        sensors,
        joints.copy(),
        robot.sensor_names,
        tuple(s.unit for s in robot.sensors),
        robot.motor_names,
        joints=read,
    )
    return MeasuredTrial("swing", log, Commands(log.commands))


def test_the_floor_of_both_simulations_is_the_readings_own() -> None:
    robot = samples()["arm"].robot
    robot = replace(robot, time_step_s=STEP_S, sensors=tuple(replace(s, noise=0.0) for s in robot.sensors))
    trial = swinging(robot, 1e-4)
    position = [k for k, s in enumerate(robot.sensors) if s.kind == "position"]
    assert channel_scale(robot, [trial]).noise[position] == pytest.approx(1e-4, rel=1.0)
    floor = FreeRun((trial,), robot, evaluator_for(robot), windows_s=0.5).noise
    assert (floor < 3e-4).all()
