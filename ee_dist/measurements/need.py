"""What a measured motion needs of its drives by the model, and how torques or currents go with it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ee_dist.basics.altered import altered
from ee_dist.basics.names import listed
from ee_dist.measurements import signals
from ee_dist.robots.inverse_dynamics import joint_torques
from ee_dist.robots.model import Robot, RobotError
from ee_dist.trials.log import Array, SensorLog

HELD, BEYOND, HELD_ROWS = 0.05, 1.2, 500
"""Share of the readings in which more than so many times the limit of a drive is held from which that is told, of how many."""
WINDOW_S = 0.06
"""Of the means through which torques are compared with what the motion needs."""


def torques_needed(robot: Robot, position: Array, step_s: float) -> tuple[Array, Array] | None:
    """Torques (T, J) that a motion (T, J) of the driven joints needs by the model without friction, and its speeds; None where
    the model cannot say, as for a base that moves about."""
    if robot.free_base:
        return None
    q = signals.smooth(position, max(3, round(WINDOW_S / step_s)))
    speed = signals.change(q, step_s, WINDOW_S)
    try:
        acceleration = signals.change(speed, step_s, WINDOW_S)
        # Row by row, but with hundreds of numbers for each on the way: a long log would fill the memory.
        stretches = (slice(k, k + signals.MOST_ROWS) for k in range(0, len(q), signals.MOST_ROWS))
        found = np.concatenate([joint_torques(robot, q[s], speed[s], acceleration[s]) for s in stretches])
    except (RobotError, np.linalg.LinAlgError):
        return None
    return (found, speed) if np.isfinite(found).all() else None


def beside_need(values: Array, needed: tuple[Array, Array], step_s: float) -> list[signals.Relation]:
    """How torques or currents (T, J) go with what the motion needs, joint by joint, friction left aside."""
    need, speed = needed
    width = max(3, round(WINDOW_S / step_s))
    for _ in range(3):
        values = signals.smooth(values, width)
    found = []
    for k in range(values.shape[1]):
        own = speed[:, k]
        friction = np.stack([own, np.tanh(own / (0.05 * np.abs(own).max() + 1e-12))], axis=1)
        found.append(signals.beside(values[:, k], need[:, k], friction))
    return found


def torques_beside_need(
    robot: Robot, torques: Array, position: Array, step_s: float, known: Sequence[bool]
) -> list[signals.Relation] | None:
    """How the torques (T, J) of the joints at which they are ``known`` go with what their motion (T, J) needs: by the robot
    as described, or without the rotors that somebody guessed at, whichever tells more. Rotors that are an order of
    magnitude off hide what links need."""
    found = []
    guessed = {joint for joint, field in robot.assumed if field == "rotor_inertia"}
    bare = tuple(altered(d, rotor_inertia=0.0) if d.joint in guessed else d for d in robot.drives)
    for model in (robot, altered(robot, drives=bare)) if guessed else (robot,):
        needed = torques_needed(model, position, step_s)
        if needed is not None:
            need, speed = (of_all[:, known] for of_all in needed)
            found.append(beside_need(torques[:, known], (need, speed), step_s))
    return [max(of_one, key=lambda r: abs(r.correlation)) for of_one in zip(*found, strict=True)] if found else None


def held_beyond(robots: Sequence[Robot], logs: Sequence[tuple[str, SensorLog]]) -> list[str]:
    """A line on joints that were led slowly to where the model's weight asks more of a drive than its limit: a drive that is led
    to positions held it there. ``robots``: as they were in each of the named ``logs``."""
    where: dict[str, list[str]] = {}
    most: dict[str, tuple[float, float]] = {}
    for robot, (name, log) in zip(robots, logs, strict=True):
        if log.joints is None or robot.free_base or len(log) < 3:
            continue
        rows = log.readings[:: max(1, len(log.readings) // HELD_ROWS)]
        q = log.joints[rows]
        if not np.isfinite(q).all() or len(q) < 3:
            continue
        speed = np.abs(np.gradient(q, log.times_s[rows], axis=0))
        try:
            need = np.abs(joint_torques(robot, q, np.zeros_like(q), np.zeros_like(q)))
        except (RobotError, np.linalg.LinAlgError):
            continue
        for k, d in enumerate(robot.drives):
            if d.command != "position" or not 0 < d.torque_limit < np.inf:
                continue
            slow = speed[:, k] <= np.median(speed[:, k])
            if (need[slow, k] > BEYOND * d.torque_limit).sum() >= HELD * len(q):
                where.setdefault(d.joint, []).append(name)
                most[d.joint] = max(most.get(d.joint, (0.0, 0.0)), (float(need[slow, k].max()), d.torque_limit))
    kinds = {j.name: "N.m" if j.kind == "hinge" else "N" for j in robots[0].joints} if robots else {}
    return [
        f"{joint} was led to where its weight takes {most[joint][0]:.3g} {kinds[joint]} by the model, during {listed(trials)}, "
        f"and its torque_limit is {most[joint][1]:.3g}: is the effort in the file nobody's, or are parts described too heavy?"
        for joint, trials in where.items()
    ]
