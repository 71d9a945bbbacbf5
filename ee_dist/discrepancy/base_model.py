"""The model as it is, before anything is added to it: what it leaves, or why it cannot be simulated at all."""

from __future__ import annotations

import numpy as np

from ee_dist.discrepancy.problem import Problem
from ee_dist.effects.catalogue import Hypothesis, apply
from ee_dist.robots.model import RobotError
from ee_dist.robots.time_step import coarsest_step_s, too_light
from ee_dist.trials.log import Array


def residual_as_it_is(problem: Problem, before: Hypothesis) -> Array:
    """The residual (n,) of the model ``before``. Raises RobotError where its motion leaves the finite numbers, which a
    description is to blame for, not the measurements: without a word on it nobody would know which number to put right."""
    residual = np.asarray(problem.residuals([before])[0])
    if np.isfinite(residual).all():
        return residual
    robot = apply(problem.robot, before)
    hint = f": {too_light(robot)}" if robot.time_step_s > coarsest_step_s(robot) else ""
    raise RobotError(
        f"{robot.name} cannot be simulated on these commands: its motion leaves the finite numbers in steps of "
        f"{robot.time_step_s:g} s{hint}"
    )
