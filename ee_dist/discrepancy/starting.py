"""The speeds that a simulation of a measured motion starts with: what is wrong with them is in everything that follows.

A sensor of speed is often an estimate made on the way, late and smoothed. Of a real robot, whose positions are read finely, a
curve laid through a few of these can know the speed better: where it parts from the sensor by more than the noise of the
positions and its own lag explain, it is taken.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
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
from ee_dist.engines.halfway import goes_halfway
from ee_dist.robots.model import Robot
from ee_dist.trials.log import Array, SensorLog, State
from ee_dist.trials.motion import base_poses

AROUND, CUBIC = (9, 5), 3
"""Readings that the curve is laid through, and fewer, which part from the first where it is too stiff; its order."""
STOOD = 0.99
"""Share of robots at rest whose sensors of speed read that little (a chi-square of as many degrees as joints)."""
BEYOND = 3.0
"""Standard deviations of what the curve's own errors explain."""


def start_of(trial: MeasuredTrial, robot: Robot) -> State | None:
    """Where a measured robot began; None where it stood at position zero, or that is not known. One that walks about begins where
    its description says if it is simulated; a real one with its joints as they were read, tilted as its sensors say, and on the
    floor."""
    log = trial.log
    if trial.begun is not None:
        return trial.begun.start(robot)
    if log.joints is None or not np.abs(log.joints[0]).max() > 0 or (robot.free_base and not trial.real):
        return None
    speeds, _ = _first_speeds(trial, speed_sensors(robot), goes_halfway(robot))
    base = base_poses(robot, log, np.zeros(1, dtype=np.intp))[0] if robot.free_base else None
    return State(log.joints[0].copy(), speeds.copy(), base)


def starts_beside(trial: MeasuredTrial, robot: Robot) -> list[State]:
    """Where it may have begun as well: one standard deviation of the noise that sensors of speed declare beside ``start_of``, a
    joint at a time. None where that is not told by them, or it stood."""
    start = start_of(trial, robot)
    if start is None or trial.begun is not None:
        return []  # what a stretch begins with is forgotten before it is compared
    _, off = _first_speeds(trial, speed_sensors(robot), goes_halfway(robot))
    return [replace(start, speeds=start.speeds + step) for step in np.diag(off) if step.any()]


@lru_cache(maxsize=64)
def _first_speeds(trial: MeasuredTrial, sensors: SpeedSensors, halfway: bool) -> tuple[Array, Array]:
    """(M,) with which a simulation begins, and (M,) standard deviations of their noise, of simulated logs as far as it is
    declared. What reads no more than its noise at all joints stood: what noise would make of a start is not simulated."""
    log, speeds = trial.log, _starting(trial, sensors, halfway)[0]
    if trial.commands_held:
        return speeds, np.zeros(len(speeds))
    read = [float(log.sensors[0, c]) / noise for _, c, noise in sensors if noise]
    if len(read) == len(speeds) and sum(v**2 for v in read) < 2.0 * scipy.special.gammaincinv(len(read) / 2, STOOD):
        return np.zeros(len(speeds)), np.zeros(len(speeds))
    return speeds, first_speeds_off(log, sensors, len(speeds))


def starting_speeds(trial: MeasuredTrial, robot: Robot) -> Array:
    """(T, M) with which a simulation from each row is to begin. Of a simulated log, what its sensors read. Of a robot, the best
    that is known, half a step before: the speed that a step begins with is that of half a step ago (see ``steps``), but for
    robots that go by half steps."""
    return _starting(trial, speed_sensors(robot), goes_halfway(robot))


@lru_cache(maxsize=64)
def _starting(trial: MeasuredTrial, read: SpeedSensors, halfway: bool) -> Array:
    speeds = read_speeds(trial.log, read, halfway)
    if not trial.commands_held or len(trial.log) < 2:
        return speeds
    known = _through_positions(trial, read, speeds)
    if halfway:
        return known
    return np.concatenate([known[:1] - (known[1:2] - known[:1]) / 2, (known[:-1] + known[1:]) / 2])


def speeds_off(trial: MeasuredTrial, robot: Robot) -> Array:
    """(T, M) standard deviations of ``starting_speeds``: of the noise that a sensor shows, or of the curve through positions
    about there. A slide that runs into its stop for a moment is no doubt about how fast it went before."""
    sensors, even = speed_sensors(robot), evenly_read(trial.log)
    sensed = _at(even, trial.log, read_speeds(trial.log, sensors, goes_halfway(robot)))
    noise = np.broadcast_to(slow_noise(even.times_s, sensed), sensed.shape)
    curve = _curve(even) if trial.commands_held else None
    off = noise if curve is None else np.where(curve.better(sensors, sensed), curve.noise, noise)
    return _at(trial.log, even, off)


def _through_positions(trial: MeasuredTrial, sensors: SpeedSensors, read: Array) -> Array:
    """(T, M): speeds as ``sensors`` ``read`` them (T, M), and of joints whose positions know better, or alone, from these."""
    even = evenly_read(trial.log)
    curve = _curve(even)
    if curve is None:
        return read
    slopes = _at(trial.log, even, curve.speeds)
    return np.where(curve.better(sensors, _at(even, trial.log, read)), slopes, read)


@dataclass(frozen=True, eq=False)
class _Curve:
    """Speeds by a curve through the positions (T, M); how far off they may be at most (M,), their noise and all by which a more
    supple curve parts from it; and their standard deviations (T, M), of what it parts by about there only what noise does not
    make."""

    speeds: Array
    off: Array
    noise: Array

    def better(self, sensors: SpeedSensors, sensed: Array) -> Array:
        """(M,) whether they know better than what was ``sensed`` (T, M), or alone."""
        alone = np.isin(np.arange(sensed.shape[1]), [joint for joint, _, _ in sensors], invert=True)
        return np.asarray((_size(sensed - self.speeds) > BEYOND * self.off) | alone)


def _curve(even: SensorLog) -> _Curve | None:
    """None where too little was read."""
    if even.joints is None or len(even) < AROUND[0]:
        return None
    step_s = float(np.median(np.diff(even.times_s)))
    stiff, supple = (scipy.signal.savgol_filter(even.joints, n, CUBIC, deriv=1, delta=step_s, axis=0) for n in AROUND)
    long, short = (scipy.signal.savgol_coeffs(n, CUBIC, deriv=1, delta=step_s) for n in AROUND)
    read = slow_noise(even.times_s, even.joints)
    noise, parts = read * np.linalg.norm(long), _size(stiff - supple)
    apart = read * np.linalg.norm(long - np.pad(short, (len(long) - len(short)) // 2))
    near = scipy.ndimage.uniform_filter1d((stiff - supple) ** 2, 2 * AROUND[0] + 1, axis=0, mode="nearest")
    return _Curve(stiff, np.hypot(noise, parts), np.sqrt(noise**2 + np.maximum(near - apart**2, 0.0)))


def _at(there: SensorLog, log: SensorLog, values: Array) -> Array:
    """(R, M) values (T, M) of a log's rows at the times of another's, by straight lines."""
    return np.stack([np.interp(there.times_s, log.times_s, v) for v in values.T], axis=1)


def _size(values: Array) -> Array:
    return np.asarray(np.sqrt(np.mean(values**2, axis=0)))
