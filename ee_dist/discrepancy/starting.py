"""The speeds that a simulation of a measured motion starts with: what is wrong with them is in everything that follows.

A sensor of speed is often an estimate made on the way, late and smoothed. Of a real robot, whose positions are read finely, a
curve laid through a few of these can know the speed better: where it parts from the sensor by more than the noise of the
positions and its own lag explain, it is taken.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import scipy

from ee_dist.discrepancy.measured_trial import (
    MeasuredTrial,
    SpeedSensors,
    evenly_read,
    first_speeds_off,
    read_speeds,
    speed_sensors,
)
from ee_dist.discrepancy.slow_noise import slow_noise
from ee_dist.robots.model import Robot
from ee_dist.trials.log import Array, SensorLog, State

AROUND, CUBIC = (9, 5), 3
"""Readings that the curve is laid through, and fewer, which part from the first where it is too stiff; its order."""
STOOD = 0.99
"""Share of robots at rest whose sensors of speed read that little (a chi-square of as many degrees as joints)."""
BEYOND = 3.0
"""Standard deviations of what the curve's own errors explain."""


def start_of(trial: MeasuredTrial, robot: Robot) -> State | None:
    """Where a measured robot on a fixed base began; None where it stood at position zero, or that is not known."""
    log = trial.log
    if robot.free_base or log.joints is None or not np.abs(log.joints[0]).max() > 0:
        return None
    speeds, _ = _first_speeds(trial, speed_sensors(robot))
    return State(log.joints[0].copy(), speeds.copy())


def starts_beside(trial: MeasuredTrial, robot: Robot) -> list[State]:
    """Where it may have begun as well: one standard deviation of the noise that sensors of speed declare beside ``start_of``, a
    joint at a time. None where that is not told by them, or it stood."""
    start = start_of(trial, robot)
    if start is None:
        return []
    _, off = _first_speeds(trial, speed_sensors(robot))
    return [State(start.joints, start.speeds + step) for step in np.diag(off) if step.any()]


@lru_cache(maxsize=64)
def _first_speeds(trial: MeasuredTrial, sensors: SpeedSensors) -> tuple[Array, Array]:
    """(M,) with which a simulation begins, and (M,) standard deviations of their noise, of simulated logs as far as it is
    declared. What reads no more than its noise at all joints stood: what noise would make of a start is not simulated."""
    log, speeds = trial.log, _starting(trial, sensors)[0]
    if trial.commands_held:
        return speeds, np.zeros(len(speeds))
    read = [float(log.sensors[0, c]) / noise for _, c, noise in sensors if noise]
    if len(read) == len(speeds) and sum(v**2 for v in read) < 2.0 * scipy.special.gammaincinv(len(read) / 2, STOOD):
        return np.zeros(len(speeds)), np.zeros(len(speeds))
    return speeds, first_speeds_off(log, sensors, len(speeds))


def starting_speeds(trial: MeasuredTrial, robot: Robot) -> Array:
    """(T, M) with which a simulation from each row is to begin. Of a simulated log, what its sensors read. Of a robot, the best
    that is known, half a step before: the speed that a step begins with is that of half a step ago (see ``steps``)."""
    return _starting(trial, speed_sensors(robot))


@lru_cache(maxsize=64)
def _starting(trial: MeasuredTrial, read: SpeedSensors) -> Array:
    speeds = read_speeds(trial.log, read)
    if not trial.commands_held or len(trial.log) < 2:
        return speeds
    known = _through_positions(trial, read, speeds)
    return np.concatenate([known[:1] - (known[1:2] - known[:1]) / 2, (known[:-1] + known[1:]) / 2])


def speeds_off(trial: MeasuredTrial, robot: Robot) -> Array:
    """(M,) standard deviations of ``starting_speeds``: of the noise that a sensor shows, or of the curve through positions."""
    sensors = speed_sensors(robot)
    read = read_speeds(trial.log, sensors)
    even = evenly_read(trial.log)
    sensed = np.stack([np.interp(even.times_s, trial.log.times_s, v) for v in read.T], axis=1)
    noise = slow_noise(even.times_s, sensed)
    if not trial.commands_held or even.joints is None or len(even) < AROUND[0]:
        return noise
    _, _, better = _curve(trial, sensors, read)
    stiff, supple = _through(even)
    long, short = (scipy.signal.savgol_coeffs(n, CUBIC, deriv=1, delta=_step(even)) for n in AROUND)
    apart = long - np.pad(short, (len(long) - len(short)) // 2)
    read_noise = slow_noise(even.times_s, even.joints)
    # By what the curve is too stiff, beyond what noise makes it part from the more supple one.
    bent = np.maximum(_size(stiff - supple) ** 2 - (read_noise * np.linalg.norm(apart)) ** 2, 0.0)
    return np.where(better, np.sqrt((read_noise * np.linalg.norm(long)) ** 2 + bent), noise)


def _through_positions(trial: MeasuredTrial, sensors: SpeedSensors, read: Array) -> Array:
    """(T, M): speeds as ``sensors`` ``read`` them (T, M), and of joints whose positions know better, or alone, from these."""
    if evenly_read(trial.log).joints is None or len(evenly_read(trial.log)) < AROUND[0]:
        return read
    slopes, _, better = _curve(trial, sensors, read)
    return np.where(better, slopes, read)


def _curve(trial: MeasuredTrial, sensors: SpeedSensors, read: Array) -> tuple[Array, Array, Array]:
    """Speeds by positions (T, M), their standard deviations (M,), and whether they know better than what was read (M,)."""
    even = evenly_read(trial.log)
    assert even.joints is not None
    stiff, supple = _through(even)
    weights = scipy.signal.savgol_coeffs(AROUND[0], CUBIC, deriv=1, delta=_step(even))
    own = np.hypot(slow_noise(even.times_s, even.joints) * np.linalg.norm(weights), _size(stiff - supple))
    sensed = np.stack([np.interp(even.times_s, trial.log.times_s, v) for v in read.T], axis=1)
    alone = np.isin(np.arange(read.shape[1]), [joint for joint, _, _ in sensors], invert=True)
    better = (_size(sensed - stiff) > BEYOND * own) | alone
    slopes = np.stack([np.interp(trial.log.times_s, even.times_s, v) for v in stiff.T], axis=1)
    return slopes, own, better


def _through(even: SensorLog) -> tuple[Array, Array]:
    """(T, M) speeds by the two curves through the positions."""
    assert even.joints is not None
    stiff, supple = (
        np.asarray(scipy.signal.savgol_filter(even.joints, n, CUBIC, deriv=1, delta=_step(even), axis=0))
        for n in AROUND
    )
    return stiff, supple


def _step(even: SensorLog) -> float:
    """s from one reading to the next."""
    return float(np.median(np.diff(even.times_s)))


def _size(values: Array) -> Array:
    return np.asarray(np.sqrt(np.mean(values**2, axis=0)))
