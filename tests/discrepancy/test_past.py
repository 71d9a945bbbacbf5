"""A window begins with what a controller made of the commands before it."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from way_samples import Sample, evaluator_for, measure

from ee_dist.discrepancy.past import Past
from ee_dist.discrepancy.problem import error
from ee_dist.discrepancy.ways.free_run.problem import FreeRun
from ee_dist.effects.catalogue import apply, term
from ee_dist.robots.servo_pendulum import servo_pendulum
from ee_dist.trials.excitation import Excitation
from ee_dist.trials.noise import with_noise

ROBOT = with_noise(servo_pendulum(), 5e-5)
SLOW = term("command_speed", ROBOT.motor_names[0], slowness_s_rad=0.4)


@cache
def windows() -> FreeRun:
    plan = tuple(Excitation(kind, 3.0, 0.7, k) for k, kind in enumerate(("steps", "multisine")))
    trials = measure(Sample(ROBOT, plan, (SLOW,), ()), (SLOW,))
    return FreeRun(trials, ROBOT, evaluator_for(ROBOT), windows_s=0.5)


def test_a_goal_under_a_limit_goes_on_from_window_to_window(monkeypatch: pytest.MonkeyPatch) -> None:
    right = error(windows().residuals([(SLOW,)])[0])
    assert right < 1.5 * windows().noise_floor()[0]
    assert error(windows().residuals([()])[0]) > 10 * right
    model = apply(ROBOT, [SLOW])
    none = np.full((3, len(ROBOT.drives)), np.nan)
    monkeypatch.setattr(Past, "goals", lambda self, _: np.concatenate([self.joints[[self.begin]], none]))
    windows().evaluator.close()
    forgetful = FreeRun(windows().measured, model, evaluator_for(ROBOT), windows_s=0.5)
    assert error(forgetful.residuals([()])[0]) > 5 * right


def test_a_goal_that_gathers_speed_goes_on_from_window_to_window() -> None:
    gentle = term("command_acceleration", ROBOT.motor_names[0], reluctance_s2_rad=0.03)
    trials = measure(Sample(ROBOT, (Excitation("steps", 3.0, 0.7, 0),), (gentle,), ()), (gentle,))
    problem = FreeRun(trials, ROBOT, evaluator_for(ROBOT), windows_s=0.5)
    right = error(problem.residuals([(gentle,)])[0])
    assert right < 1.5 * problem.noise_floor()[0]
    assert error(problem.residuals([()])[0]) > 10 * right


def test_goals_follow_commands_no_faster_than_their_limit_and_joints_while_released() -> None:
    commands = np.concatenate([np.zeros((5, 1)), np.ones((45, 1))])
    joints = np.full((50, 1), -0.3)
    model = apply(ROBOT, [SLOW])

    def goal(begin: int, enabled: np.ndarray | None = None) -> float:
        return float(Past(commands, enabled, joints, 0.01, begin).goals(model)[0, 0])

    assert goal(4) == pytest.approx(-0.3 + 4 * 0.025)
    assert goal(40) == pytest.approx(-0.3 + 40 * 0.025)
    assert goal(50) == pytest.approx(0.95)
    released = np.where(np.arange(50) < 20, 0.0, 1.0)
    assert goal(30, released) == pytest.approx(-0.3 + 11 * 0.025)
