"""What a simulated motion is watched by: one rollout shows how a robot moves, whether it falls, and which joints are at their
torque limits."""

from __future__ import annotations

from dataclasses import dataclass, replace

from ee_dist.discrepancy.problem import Problem
from ee_dist.effects.catalogue import Hypothesis
from ee_dist.effects.targets import motors_with_torque_limit
from ee_dist.robots.instruments import MOTOR_TORQUE
from ee_dist.robots.model import Robot, Sensor
from ee_dist.trials.log import SensorLog


@dataclass(frozen=True)
class AtLimit:
    """A joint whose simulated drive is at its torque ``limit`` (in ``unit``, as the model has it) in a ``share``, 0 to 1, of the
    rows in which the joint does not rest; ``assumed``: whether the description only assumed the limit."""

    joint: str
    limit: float
    unit: str
    share: float
    assumed: bool


def meters(robot: Robot) -> tuple[Sensor, ...]:
    """What tells whether joints are at their torque limits: torques of motors, of which a log by itself has those behind gears
    alone, then speeds."""
    joints = motors_with_torque_limit(robot)
    return tuple(Sensor(f"{kind}@{j}", kind, j) for kind in (MOTOR_TORQUE, "velocity") for j in joints)


def motions(problem: Problem, hypothesis: Hypothesis) -> list[SensorLog | None]:
    """``Problem.simulated``, by the very rollouts that ``meters`` watch: whoever looked at limits has simulated these already."""
    beside = meters(problem.robot)
    return [None if m is None else _without_last(m, len(beside)) for m in problem.simulated(hypothesis, beside)]


def _without_last(log: SensorLog, count: int) -> SensorLog:
    own = len(log.sensor_names) - count
    names, units = log.sensor_names[:own], log.sensor_units[:own]
    return replace(log, sensors=log.sensors[:, :own].copy(), sensor_names=names, sensor_units=units)
