"""A model that flies apart is refused with the drive that is to blame, and never passes for one that agrees."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from linear_problem import Linear

from ee_dist.discrepancy.base_model import residual_as_it_is
from ee_dist.discrepancy.ways.open_loop.prediction import digest
from ee_dist.effects.catalogue import Hypothesis
from ee_dist.robots.model import RobotError
from ee_dist.trials.log import Array


class Apart(Linear):
    """Whose model leaves the finite numbers."""

    def residuals(self, hypotheses: list[Hypothesis], trials: list[int] | None = None) -> Array:  # type: ignore[override]
        return np.asarray(super().residuals(hypotheses, trials)) * np.inf


def test_the_drive_that_is_too_stiff_for_what_it_moves_is_named() -> None:
    problem = Apart(())
    robot = problem.robot
    stiff = replace(robot.drives[3], command="position", kp=1e6, kd=0.0, rotor_inertia=0.0)
    problem.robot = replace(robot, drives=(*robot.drives[:3], stiff, *robot.drives[4:]))
    with pytest.raises(RobotError, match=f"leaves the finite numbers.*{stiff.joint} .kp 1e.06.*rotor_inertia"):
        residual_as_it_is(problem, ())


def test_one_that_can_be_simulated_is_passed_on() -> None:
    problem = Linear(())
    assert np.array_equal(residual_as_it_is(problem, ()), problem.residuals([()])[0])


@pytest.mark.parametrize("size", [1e30, 1e200, np.inf])
def test_numbers_beyond_what_is_kept_are_no_finite_motion(size: float) -> None:
    values = np.zeros((120, 2))
    values[60:, 1] = size * np.resize([1.0, -1.0], 60)
    assert not digest(values, 4, 60).finite
    assert digest(np.ones((120, 2)), 4, 60).finite
