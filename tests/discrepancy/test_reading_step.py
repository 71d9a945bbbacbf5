"""Readings in coarse steps: the steps are noise, though most readings repeat the last one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from way_samples import evaluator_for, samples

from ee_dist.discrepancy.measured_trial import MeasuredTrial
from ee_dist.discrepancy.slow_noise import slow_noise
from ee_dist.discrepancy.ways.free_run.problem import FreeRun
from ee_dist.engines.contract import Rollout
from ee_dist.engines.drivers import Commands
from ee_dist.trials.grid import reading_step

T = np.arange(1500) * 0.02
TICK = 2 * np.pi / 4096


def motion(amplitude: float = 0.15) -> np.ndarray:
    return amplitude * np.sin(0.9 * T) + 0.3 * amplitude * np.sin(2.2 * T)


def stepped(size: float, amplitude: float = 0.15) -> np.ndarray:
    return size * np.round(motion(amplitude) / size)


@pytest.mark.parametrize("ticks", [1, 4])
def test_steps_leave_what_lies_between_them_open(ticks: int) -> None:
    values = stepped(ticks * TICK)
    assert reading_step(values) == pytest.approx(ticks * TICK)
    (noise,) = slow_noise(T, values[:, None])
    assert 0.9 < noise / (ticks * TICK / np.sqrt(12)) < 3


def test_a_log_that_was_brought_to_another_grid_has_them_still() -> None:
    at = T[:-1] + 0.0007
    values = np.interp(at, T, stepped(TICK))
    assert reading_step(values) == pytest.approx(TICK)


def test_noise_dropouts_and_rest_are_no_steps() -> None:
    rng = np.random.default_rng(0)
    noisy = motion() + 1e-3 * rng.standard_normal(len(T))
    assert reading_step(noisy) == 0.0
    for k in np.flatnonzero(rng.uniform(size=len(T)) < 0.3)[1:]:
        noisy[k] = noisy[k - 1]
    assert reading_step(noisy) == 0.0
    assert reading_step(np.zeros(len(T))) == 0.0
    (noise,) = slow_noise(T, (motion() + 1e-3 * rng.standard_normal(len(T)))[:, None])
    assert 0.7e-3 < noise < 1.3e-3


def test_steps_that_were_written_with_few_digits_are_whole_ones_all_the_same() -> None:
    """Ticks of 4096 a turn in degrees with three digits: the least gap is a hundredth too small, and ten steps of it a tenth."""
    turn = 360.0 / 4096
    swing = np.degrees(motion(0.3))
    written = np.round(np.round(swing / turn) * turn, 3)
    assert reading_step(written) == pytest.approx(turn, rel=1e-3)
    assert slow_noise(T, written[:, None])[0] >= 0.9 * turn / np.sqrt(12)


def test_coarse_steps_are_seen_on_few_levels_only_if_that_is_asked_for() -> None:
    values = stepped(0.1)
    assert len(np.unique(values)) == 5
    few = values[np.abs(values) < 0.15]
    assert reading_step(few) == 0.0
    assert reading_step(few, 3) == pytest.approx(0.1)


@pytest.mark.parametrize("windows_s", [None, 0.5])
def test_the_steps_of_a_sensor_are_known_where_its_joint_hardly_moves(windows_s: float | None) -> None:
    sample = samples()["pendulum"]
    robot, step = replace(sample.robot, sensors=sample.robot.sensors[:1]), 0.012
    evaluator = evaluator_for(robot)
    slow = 0.3 * np.sin(0.9 * np.arange(0.0, 6.0, robot.time_step_s))[:, None]
    trials = []
    for name, commands in (("slow", slow), ("still", np.zeros_like(slow))):
        (log,) = evaluator.engine.rollout([Rollout(robot, Commands(commands), len(commands), pose=True)])  # type: ignore[attr-defined]
        read = step * np.round(log.sensors / step)
        trials.append(MeasuredTrial(name, replace(log, sensors=read, joints=read), Commands(commands)))
    problem = FreeRun(trials, robot, evaluator, windows_s=windows_s)
    (noise,) = problem.noise
    assert 0.9 < noise / (step / 4) < 2, "between two steps all is alike, so that a quarter of one is left on average"
