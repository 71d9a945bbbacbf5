"""A free run begins with the speed that the robot had: a late sensor of it is worse than a curve through the positions."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from way_samples import evaluator_for, samples

from ee_dist.discrepancy.measured_trial import MeasuredTrial, speeds_of
from ee_dist.discrepancy.problem import error
from ee_dist.discrepancy.starting import speeds_off, starting_speeds
from ee_dist.discrepancy.ways.free_run.problem import FreeRun
from ee_dist.engines.drivers import Commands
from ee_dist.robots.model import Drive, Robot
from ee_dist.trials.log import Array, SensorLog

STEP_S, LATE_S = 0.002, 0.01


def trial_of(robot: Robot, joints: Array, speeds: Array, real: bool = True) -> MeasuredTrial:
    read = {"position": joints, "velocity": speeds}
    place = {m: k for k, m in enumerate(robot.motor_names)}
    sensors = np.stack([read[s.kind][:, place[s.target]] for s in robot.sensors], axis=1)
    times = np.arange(len(joints)) * STEP_S
    units = tuple(s.unit for s in robot.sensors)
    log = SensorLog(times, sensors, np.zeros_like(joints), robot.sensor_names, units, robot.motor_names, joints=joints)
    return MeasuredTrial("swing", log, Commands(log.commands), commands_held=real)


@cache
def arm() -> Robot:
    robot = samples()["arm"].robot
    sensors = tuple(replace(s, noise=0.0) for s in robot.sensors if s.kind in ("position", "velocity"))
    return replace(robot, time_step_s=STEP_S, sensors=sensors)


def course(at_s: Array) -> tuple[Array, Array]:
    """Positions and speeds (T, 2)."""
    pace = 2 * np.pi * np.array([1.1, 2.3])
    return np.sin(np.outer(at_s, pace)), pace * np.cos(np.outer(at_s, pace))


def parted(found: Array, wanted: Array) -> float:
    return float(np.sqrt(np.mean((found - wanted)[20:-20] ** 2)))


@pytest.mark.parametrize("noise", [0.0, 1e-5, 1e-4])
def test_a_late_sensor_of_speed_gives_way_to_finely_read_positions(noise: float) -> None:
    t = np.arange(1000) * STEP_S
    joints = course(t)[0] + noise * np.random.default_rng(1).standard_normal((len(t), 2))
    late, wanted = course(t - LATE_S)[1], course(t - STEP_S / 2)[1]
    found = starting_speeds(trial_of(arm(), joints, late), arm())
    assert parted(found, wanted) < 0.1 * parted(late, wanted)


def test_an_exact_sensor_of_speed_is_kept_beside_coarse_positions() -> None:
    t = np.arange(1000) * STEP_S
    joints, exact = course(t)
    found = starting_speeds(trial_of(arm(), np.round(joints / 0.01) * 0.01, exact), arm())
    assert parted(found, course(t - STEP_S / 2)[1]) < 1e-3


def test_what_a_simulation_reads_is_what_it_starts_with() -> None:
    t = np.arange(300) * STEP_S
    joints, late = course(t)[0], course(t - LATE_S)[1]
    trial = trial_of(arm(), joints, late, real=False)
    assert np.array_equal(starting_speeds(trial, arm()), speeds_of(trial.log, arm()))


def noisy_arm(noise: float) -> Robot:
    sensors = tuple(replace(s, noise=noise if s.kind == "velocity" else 0.0) for s in arm().sensors)
    return replace(arm(), sensors=sensors)


def test_a_joint_that_was_at_rest_begins_at_rest_although_it_jumped_in_the_next_step() -> None:
    """A smooth course through its noisy speeds has it under way before it was."""
    t, noise = np.arange(300) * STEP_S, 0.0075
    speeds = np.where(t > 0, -20.0 * np.exp(-t / 0.005), 0.0)[:, None] * np.ones(2)
    seen = speeds + noise * np.random.default_rng(2).standard_normal(speeds.shape)
    trial = trial_of(noisy_arm(noise), np.cumsum(speeds, axis=0) * STEP_S, seen, real=False)
    assert np.abs(starting_speeds(trial, noisy_arm(noise))[0]).max() < 5 * noise


def test_of_a_noisy_sensor_of_speed_a_smooth_course_is_taken() -> None:
    t, noise = np.arange(300) * STEP_S, 0.2
    joints, speeds = course(t)
    seen = speeds + noise * np.random.default_rng(3).standard_normal(speeds.shape)
    trial = trial_of(noisy_arm(noise), joints, seen, real=False)
    assert parted(starting_speeds(trial, noisy_arm(noise)), speeds) < 0.5 * parted(seen, speeds)


def test_a_swing_is_foretold_although_its_speed_was_read_late() -> None:
    """One link in true time: what is left is a tenth of what the sensor's own lateness makes of it."""
    robot = samples()["pendulum"].robot
    (servo,) = robot.drives
    loose = Drive(joint=servo.joint, kp=0.0, ki=0.0, kd=0.0, torque_limit=1.0, speed_limit=np.inf, rotor_inertia=0.0,
                  supply_nominal_v=0.0, command="none")  # fmt: skip
    sensors = tuple(replace(s, noise=0.0) for s in robot.sensors if s.kind in ("position", "velocity"))
    robot = replace(robot, time_step_s=STEP_S, drives=(loose,), sensors=sensors, laws=())
    moved = next(p for p in robot.parts if p.name == robot.joints[0].child)
    arm_m = float(np.linalg.norm(moved.com_m))
    inertia = moved.inertia_kg_m2[0] + moved.mass_kg * arm_m**2
    pull = moved.mass_kg * arm_m * robot.world.gravity_m_s2 / inertia
    t = np.arange(1500) * STEP_S
    swing = solve_ivp(
        lambda _, y: [y[1], -pull * np.sin(y[0])], (0, 3), [1.2, 0.0], dense_output=True, rtol=1e-10, atol=1e-12
    )
    joints, late = swing.sol(t)[:1].T, swing.sol(np.maximum(t - LATE_S, 0.0))[1:].T
    left = {}
    for real in (True, False):
        problem = FreeRun((trial_of(robot, joints, late, real),), robot, evaluator_for(robot), windows_s=0.5)
        left[real] = problem.natural(error(problem.residuals([()])[0]))
    assert left[True] < 0.1 * left[False]


def test_a_blow_is_no_doubt_about_the_speed_long_before_it() -> None:
    t = np.arange(1500) * STEP_S
    joints, speeds = course(t)
    stopped = np.where(t[:, None] < 2.0, joints, joints[1000])
    robot = replace(arm(), sensors=tuple(s for s in arm().sensors if s.kind == "position"))
    off = speeds_off(trial_of(robot, stopped, speeds), robot)
    assert off.shape == joints.shape
    before, there, after = (
        np.sqrt(np.mean(off[rows] ** 2)) for rows in (slice(0, 900), slice(990, 1010), slice(1100, None))
    )
    assert there > 100 * max(before, after)
