"""Noise that no description declares is expected all the same, of every channel as far as others of its kind have it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from way_samples import two_joint_arm

from ee_dist.discrepancy.explain import NOTHING_MISSING, explain
from ee_dist.discrepancy.measured_trial import MeasuredTrial, driver_of
from ee_dist.discrepancy.problem import error
from ee_dist.discrepancy.search.candidates import candidates
from ee_dist.discrepancy.ways.open_loop.problem import OpenLoop
from ee_dist.engines.mujoco.engine import MuJoCoEngine
from ee_dist.evaluation.physical import PhysicalRobot
from ee_dist.evaluation.serial import SerialEvaluator
from ee_dist.robots.model import Robot, Sensor
from ee_dist.trials.excitation import Excitation

JOINTS = ("shoulder", "elbow")


def robot(*noise: float) -> Robot:
    """An arm with two encoders at each joint."""
    names = [(f"{j}_{k}", j) for j in JOINTS for k in (1, 2)]
    sensors = [Sensor(n, "position", j, "rad", noise=s) for (n, j), s in zip(names, noise, strict=True)]
    return replace(two_joint_arm(), sensors=tuple(sensors))


def problem(*noise: float, declared: bool = False) -> OpenLoop:
    noisy, engine = robot(*noise), MuJoCoEngine(1)
    trials = []
    for k in range(2):
        motion = Excitation("multisine", 4.0, 0.3, k)
        log = PhysicalRobot(engine, noisy, (), np.random.SeedSequence(k)).trial(
            driver_of(motion, noisy), motion.steps(noisy)
        )
        trials.append(MeasuredTrial(f"m{k}", log, driver_of(motion, noisy)))
    return OpenLoop(trials, noisy if declared else robot(0, 0, 0, 0), SerialEvaluator(engine))


@pytest.mark.parametrize("size", [0.001, 0.01])
def test_a_right_model_is_as_near_its_floor_as_with_the_noise_declared(size: float) -> None:
    over = []
    for declared in (True, False):
        found = problem(*[size] * 4, declared=declared)
        over.append(error(found.residuals([()])[0]) / found.noise_floor()[0])
    assert over[1] < 1.15 * over[0]
    assert over[1] < 1.4


def test_nothing_is_missing_where_noise_is_all_there_is() -> None:
    found = problem(*[0.005] * 4)
    pool = candidates(found.robot, only=["sensor_noise", "sensor_delay", "coulomb_friction", "position_gain"])
    assert explain(found, pool).verdict == NOTHING_MISSING


def test_a_sensor_that_is_noisier_than_others_of_its_kind_stands_out() -> None:
    found = problem(0.002, 0.03, 0.002, 0.002)
    pool = candidates(found.robot, only=["sensor_noise", "sensor_dropout", "sensor_delay", "coulomb_friction"])
    best = explain(found, pool).best
    assert best is not None and [(t.effect, t.target) for t in best.terms] == [("sensor_noise", "shoulder_2")]
