"""How well a model runs by itself: position, speed, acceleration and force of a closed-loop simulation against the record.

The model gets the reference that the robot's controller got and nothing else. In a stiff loop positions agree for any
model, since the controller sees to it; what a model misses shows in the force (Janot, Gautier, Brunot 2019).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ee_dist.discrepancy.measured_trial import MeasuredTrial, released
from ee_dist.effects.catalogue import apply
from ee_dist.engines.contract import Engine, Rollout
from ee_dist.engines.drivers import Commands
from ee_dist.measurements.errors import MeasurementError
from ee_dist.measurements.sampling import LowPass
from ee_dist.robots.model import Robot
from ee_dist.trials.log import Array, State

SETTLING_ROWS = 49


@dataclass(frozen=True)
class SimulationErrors:
    """Relative errors (root mean square over root mean square), 0.01 is one per cent."""

    position: float
    speed: float
    acceleration: float
    force: float


def closed_loop(
    models: Sequence[Robot], trial: MeasuredTrial, engine: Engine, low_pass: LowPass | None = None
) -> list[SimulationErrors]:
    """Errors of each model on a trial whose joint positions and drive torques were measured.

    Measured speed and acceleration are central differences behind ``low_pass`` (100 Hz unless told); those of a model
    are its own. Raises MeasurementError where the log lacks what is compared.
    """
    log, smooth = trial.log, low_pass or LowPass(cutoff_hz=100.0)
    if log.joints is None or log.torques is None or not np.isfinite(log.torques).all():
        raise MeasurementError(
            f"trial {trial.name!r}: joint positions and torques are needed for a closed-loop comparison"
        )
    dt = float(np.median(np.diff(log.times_s)))
    commands, enabled = released(log.commands)
    begin = State(log.joints[0].copy(), np.zeros(len(log.motor_names)))
    rollouts = [
        Rollout(
            apply(m, trial.setup),
            Commands(commands),
            len(log),
            start=begin,
            supply_v=log.supply_v,
            enabled=enabled,
            external=log.external,
            pose=True,
        )
        for m in models
    ]
    position = np.stack([smooth(q, dt) for q in log.joints.T], axis=1)
    speed = np.gradient(position, dt, axis=0)
    measured = (position, speed, np.gradient(speed, dt, axis=0), log.torques)
    out = []
    for robot, found in zip(models, engine.rollout(rollouts), strict=True):
        assert found.joints is not None
        v = np.gradient(found.joints, dt, axis=0)
        force = _asked(robot, commands, found.joints)
        mine = (found.joints, v, np.gradient(v, dt, axis=0), force)
        out.append(SimulationErrors(*(_relative(a, b) for a, b in zip(measured, mine, strict=True))))
    return out


def _asked(robot: Robot, commands: Array, joints: Array) -> Array:
    """The torque (T, M) that the controllers ask for along a motion, from differences of its positions over two rows."""
    dt = robot.time_step_s
    past = np.concatenate([joints[:1], joints[:1], joints[:-2]])
    speed = (joints - past) / (2 * dt)
    kp, kd, limit = (np.array([getattr(d, n) for d in robot.drives]) for n in ("kp", "kd", "torque_limit"))
    return np.clip(kp * (commands - joints) - kd * speed, -limit, limit)


def _relative(measured: Array, simulated: Array) -> float:
    a, b = measured[SETTLING_ROWS:], simulated[SETTLING_ROWS:]
    return float(np.linalg.norm(a - b) / np.linalg.norm(a))
