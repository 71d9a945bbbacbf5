"""What steps make of a robot that lives in continuous time, and what makes up for it.

Engines take a force at the start of a step, then speed, then position. That is a leapfrog (Hairer, Lubich and Wanner, Acta
Numerica 2003): a force counts from half a step before its row to half a step after, and the speed that a step begins with is
that of half a step ago. Of what is as fast as a few steps that is an error as large as a late sensor or a heavier rotor. Robots
that no controller holds go by half steps (``engines.halfway``): there only damping is made up for.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np

from ee_dist.basics.altered import altered
from ee_dist.engines.drive import LOOK_SHARE
from ee_dist.robots.inertia import felt_inertia, steady_inertia
from ee_dist.robots.model import Drive, Robot
from ee_dist.trials.log import Array

SPEEDS = ("velocity", "speed_x", "turn_rate")
"""Kinds of sensors that read a speed."""


def held(commands: Array) -> Array:
    """Commands (T, M) that hold from their row to the next, as the steps of a simulation are to take them: the mean of the one
    before and this one. Taken as they are they come half a step early."""
    before = np.concatenate([commands[:1], commands[:-1]])
    both = np.isfinite(before) & np.isfinite(commands)
    return np.where(both, (np.nan_to_num(before) + np.nan_to_num(commands)) / 2, commands)


def centred(values: Array, columns: Sequence[int]) -> Array:
    """Channels (T, S) of a simulation, those ``columns`` that are speeds brought from half a step before their row to it."""
    if not columns:
        return values
    out, speeds = np.array(values), values[:, list(columns)]
    out[:-1, list(columns)] = (speeds[:-1] + speeds[1:]) / 2
    return out


def between_steps(robot: Robot) -> Robot:
    """The robot whose steps follow what this one does in continuous time. Damping by the speed of half a step ago pushes where
    it should resist, as if half a step's damping were missing from the inertia: it is put back on the rotor. Passive damping,
    which engines take at the end of a step, is as much too much.

    Of damping that stops a joint in half a step or less so much is put on it that it stops in one, whatever the engine. Such a
    joint goes as fast as damping lets it be pushed, whatever its inertia is: the step of an implicit method. Likewise a joint
    whose controller would swing it by more than a radian in a step gets the rotor with which it swings by one: it is at its
    goal within a few steps all the same."""
    dt, felt = robot.time_step_s, felt_inertia(robot)
    slopes = np.array([_active(d) for d in robot.drives])
    looks = np.any(slopes * dt > LOOK_SHARE * felt)
    stopped = (steady_inertia(robot) / dt).tolist() if looks else [math.inf] * len(slopes)
    short = [max(0.0, _stiffness(d) * dt**2 - own) for d, own in zip(robot.drives, felt.tolist(), strict=True)]
    drives = [_made_up(d, dt / 2, most, more) for d, most, more in zip(robot.drives, stopped, short, strict=True)]
    return altered(robot, drives=tuple(drives))


def _stiffness(drive: Drive) -> float:
    """N.m/rad of the controller that holds the joint at its goal."""
    return drive.kp * drive.strength if drive.command == "position" else 0.0


@lru_cache(4096)
def _made_up(drive: Drive, half_s: float, stopped: float, short: float) -> Drive:
    """``stopped``: the damping (N.m.s/rad) that stops the joint in a step; ``short``: the inertia (kg.m^2) that it
    lacks to be held by its controller."""
    active = _active(drive)
    begin, end = max(active, 2 * (active - stopped)), drive.viscous + drive.back_emf * drive.strength
    return replace(drive, rotor_inertia=max(0.0, drive.rotor_inertia + half_s * (begin - end)) + short)


@lru_cache(4096)
def _active(drive: Drive) -> float:
    """N.m.s/rad by which the controller and its motor damp the joint at the speed that a step begins with."""
    controller = {"position": drive.kd, "speed": drive.kp}.get(drive.command, 0.0)
    voltage = drive.command in ("position", "speed") and np.isfinite(drive.speed_limit)
    return (controller + (drive.torque_limit / drive.speed_limit if voltage else 0.0)) * drive.strength
