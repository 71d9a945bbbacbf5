"""What the noise of measured positions does to a balance of forces: twice differentiated, it becomes force.

That force is not the drives', and it grows with what is carried: a lighter model turns less of it into force, and would look
better for that alone, as in every regression with errors on both sides (Fuller 1987, Measurement Error Models, chapter 1). So
the energy of a model's residual is told as if it let through as much noise as the base model.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from ee_dist.discrepancy.measured_trial import MeasuredTrial
from ee_dist.discrepancy.problem import Mask
from ee_dist.discrepancy.ways.force_balance.motion import (
    Motion,
    Processing,
    judged_in,
    motion_of,
    motor_torques,
    noise_of,
    positions_of,
)
from ee_dist.measurements.errors import MeasurementError
from ee_dist.measurements.sampling import LowPass, decimated
from ee_dist.robots.inverse_dynamics import parameters, regressor
from ee_dist.robots.model import Robot
from ee_dist.trials.grid import reading_step
from ee_dist.trials.log import Array

BEARABLE = 0.2
"""Share of a drive's force that noise may make before positions are smoothed more."""
HOPELESS = 1.0
"""Share from which what is left is noise, whatever the model."""
FEWEST_ROWS = 60
"""Rows of forces that smoothing leaves at least."""
BENT = 1.5
"""Standard deviations of the noise beyond which a filter takes away motion, and not noise alone."""
NOISE, PLAIN = 3.5, 7.0
"""Standard deviations up to which a force may be noise, and from which it is none."""
RESOLVED = 5.0
"""Steps of its readings that a force is counted as at least: of a smaller one a relative error says next to nothing, and would
outweigh all others."""
MOVING = 2
"""Columns of a noise regressor beside those of the masses: acceleration and speed of the joint itself."""


def resting(held: Array, free: Array, rest: Mask) -> Array:
    """(rows, J) what is left, in standard deviations, where friction that holds what rests has (``held``) and has not
    (``free``) its say. It takes noise along with all else, and would look right for that alone: of what it takes, what may be
    noise stays, and one standard deviation of what cannot be."""
    size = np.abs(free)
    noise = np.where(size <= NOISE, size, np.interp(size, (NOISE, PLAIN), (NOISE, 1.0)))
    return np.where(rest & (np.abs(held) < size), np.sign(free) * np.maximum(noise, np.abs(held)), held)


def with_energy(left: Array, more: Array) -> Array:
    """(rows, J) with ``more`` (J,) added to each square, which stays positive."""
    return np.copysign(np.sqrt(np.maximum(left**2 + more, 0.0)), left)


@lru_cache
def _kept(every: int, passed: float) -> tuple[float, float, float]:
    """Of white noise of variance 1 that went through a low-pass with its cut-off at this share of the rate, and of which
    every n-th row is kept: its variance, and products of neighbours and of those next to them."""
    around = 200 * every
    found = np.zeros(3)
    for phase in range(every):
        pulse = np.zeros(2 * around)
        pulse[around + phase] = 1.0
        answer = decimated(LowPass(passed)(pulse, 1.0)[:, None], every)[:, 0]
        found += [answer @ answer, answer[1:] @ answer[:-1], answer[2:] @ answer[:-2]]
    return float(found[0]), float(found[1]), float(found[2])


def roughness_of_noise(every: int, passed: float) -> float:
    """Mean square of the second differences of such noise, over 6 times its variance: 1 for white noise. Filters leave neighbours
    alike, and less rough than white noise is."""
    own, next_, second = _kept(every, passed)
    return (6.0 * own - 8.0 * next_ + 2.0 * second) / (6.0 * own)


def share_of_noise(every: int, passed: float) -> float:
    """Share of the variance of white noise that is left of it."""
    return _kept(every, passed)[0]


class MotionNoise:
    """By judged drive: mean products (J, P, P) of the columns of a noise regressor, so that a model's noise is a quadratic form;
    and those of their second differences, for how rough it is.

    The columns are the inertial parameters, rotor inertia and viscous friction.
    """

    def __init__(
        self,
        trials: Sequence[MeasuredTrial],
        models: Sequence[Robot],
        motions: Sequence[Motion],
        processing: Processing,
    ) -> None:
        self.judged = motions[0].judged
        sums, rough, rows = np.zeros(()), np.zeros(()), 0
        for k, (trial, model, motion) in enumerate(zip(trials, models, motions, strict=True)):
            noise = decimated(_added(trial, model, motion, processing, k), processing.keep_every)
            sums = sums + _products(noise)
            rough = rough + _products(np.diff(noise, 2, axis=0)) / 6.0
            rows += len(noise)
        self.products, self._rough = sums / rows, rough / rows
        self.first = np.mean([self._of(self.products, m) for m in models], axis=0)
        self.first_roughness = np.mean([self._of(self._rough, m) for m in models], axis=0)

    def variance(self, robot: Robot) -> Array:
        """(J,) of the force that noise makes at each judged drive, in terms of its measured force. A robot that has lost parts is
        told by its first model's noise."""
        same = len(parameters(robot)) + MOVING == self.products.shape[1]
        return self._of(self.products, robot) if same else self.first

    def _of(self, products: Array, robot: Robot) -> Array:
        masses, found = parameters(robot), np.empty(len(self.judged))
        for k, d in enumerate(robot.drives[j] for j in self.judged):
            column = np.array([*masses, d.rotor_inertia, d.viscous])
            through = max(d.strength * d.current_gain, 1e-3)
            found[k] = column @ products[k] @ column / through**2
        return found


def _products(columns: Array) -> Array:
    """(J, P, P) sums over time of products of columns (T, J, P)."""
    by_drive = np.moveaxis(columns, 1, 0)
    return np.asarray(by_drive.swapaxes(1, 2) @ by_drive)


def _added(trial: MeasuredTrial, model: Robot, motion: Motion, processing: Processing, number: int) -> Array:
    """(T, J, P): the regressor of the measured motion with noise of the same size once more, less without it."""
    joints = positions_of(trial.log, model)
    assert joints is not None
    dt = float(np.median(np.diff(trial.log.times_s)))
    drawn = np.random.default_rng([len(joints), number]).normal(size=joints.shape) * noise_of(joints)
    position, speed, acceleration = processing.differentiated(drawn, dt)
    moved = (motion.position + position, motion.speed + speed, motion.acceleration + acceleration)
    more = regressor(model, *moved) - regressor(model, motion.position, motion.speed, motion.acceleration)
    return motion.of_judged(np.concatenate([more, acceleration[:, :, None], speed[:, :, None]], axis=2))


@dataclass(frozen=True, eq=False)
class Prepared:
    """Measured motions, how they were processed, and what noise does to them; ``size`` (J,): root mean square of the force
    of each of the ``judged`` drives, or RESOLVED of the steps (J,) that its readings come in, where that is more."""

    processing: Processing
    motions: list[Motion]
    noise: MotionNoise
    size: Array
    steps: Array

    @property
    def coarse(self) -> tuple[int, ...]:
        """Places of the judged drives whose forces are no more than a few steps of their readings."""
        pairs = enumerate(zip(self.size.tolist(), self.steps.tolist(), strict=True))
        return tuple(k for k, (size, step) in pairs if size <= RESOLVED * step)

    @property
    def judged(self) -> tuple[int, ...]:
        return self.noise.judged


def torque_steps(trials: Sequence[MeasuredTrial], models: Sequence[Robot]) -> Array:
    """(M,) steps in which the torques of the drives were read, N.m; 0 where none are seen."""
    read = [motor_torques(t.log, m) for t, m in zip(trials, models, strict=True)]
    found = np.array([[reading_step(c[np.isfinite(c)]) for c in r.T] for r in read if r is not None])
    return np.asarray(found.max(axis=0, initial=0.0))


def prepared(
    trials: Sequence[MeasuredTrial], models: Sequence[Robot], processing: Processing, steps: Array
) -> Prepared:
    """Motions smoothed as much as their noise asks for, and no more than the motion bears, unless a filter is given. ``steps``
    (M,): those in which the torques were read.

    Raises MeasurementError where noise is all that would be left.
    """
    found = _tried(trials, models, processing, steps)
    if processing.low_pass is not None:
        return found
    while _share(found, models) > BEARABLE:
        more = _smoother(trials, models, found)
        if more is None:
            break
        found = _tried(trials, models, more, steps)
    share = _share(found, models)
    if share > HOPELESS:
        worst = models[0].motor_names[found.judged[int(np.argmax(_shares(found, models)))]]
        raise MeasurementError(
            f"the noise of the measured positions, differentiated twice, makes forces of {100 * share:.0f} % of those "
            f"measured at {worst}: too much for a balance of forces; {_instead(trials, models[0], worst)}"
        )
    return found


def _instead(trials: Sequence[MeasuredTrial], model: Robot, worst: str) -> str:
    """What to do where the noise at a joint hides its force."""
    rotor = model.drives[model.motor_names.index(worst)].rotor_inertia
    cures = []
    if (worst, "rotor_inertia") in model.assumed and rotor > 0:
        cures.append(
            f"say a lighter 'rotor_inertia' of {worst} in the description, which only assumed {rotor:.3g} kg.m^2"
        )
    if all(np.isfinite(t.log.commands).any() for t in trials):
        cures.append("compare by task.by=free_run or task.by=open_loop")
    return ", or ".join([*cures, "record finer positions, or leave its torque out of the mapping"])


def _tried(trials: Sequence[MeasuredTrial], models: Sequence[Robot], processing: Processing, steps: Array) -> Prepared:
    judged = judged_in(trials, models[0])
    motions = [motion_of(t, model, processing, judged) for t, model in zip(trials, models, strict=True)]
    # At a joint that is held dry friction may be anything up to its limit, so that its torque tells nothing of a model; and it
    # is often so small that its own noise would be the largest share of all.
    slide = ~np.all([m.rest.all(axis=0) for m in motions], axis=0)
    if slide[list(judged)].any():
        judged = tuple(k for k in judged if slide[k])
        motions = [replace(m, judged=judged) for m in motions]
    forces = np.concatenate([decimated(m.of_judged(m.torque), processing.keep_every) for m in motions])
    size = np.sqrt(np.mean(forces**2, axis=0))
    if not size.all():
        silent = models[0].motor_names[judged[int(np.argmin(size))]]
        raise MeasurementError(
            f"{silent}: its measured torque is zero throughout: leave it out of the torques of the mapping, and the balance is "
            "judged at the other joints"
        )
    noise, own = MotionNoise(trials, models, motions, processing), steps[list(judged)]
    return Prepared(processing, motions, noise, np.maximum(size, RESOLVED * own), own)


def _share(found: Prepared, models: Sequence[Robot]) -> float:
    return float(np.max(_shares(found, models)))


def _shares(found: Prepared, models: Sequence[Robot]) -> Array:
    """(J,) of each judged drive's measured force that noise makes."""
    return np.asarray(np.sqrt(found.noise.variance(models[0])) / found.size)


def _smoother(trials: Sequence[MeasuredTrial], models: Sequence[Robot], found: Prepared) -> Processing | None:
    """Half the bandwidth; None where that would leave too little of the rows, or take away motion. Forces lead the way: what
    the positions' filter dampens would otherwise be missing from the motion and not from the force."""
    old = found.processing
    dt = float(np.median(np.diff(trials[0].log.times_s)))
    slower = 1 if old.low_pass is None else 2
    low_pass = LowPass(old.filter_for(dt).cutoff_hz / slower)
    more = replace(old, low_pass=low_pass, drop_rows=slower * old.drop_rows, keep_every=2 * old.keep_every)
    for trial, model in zip(trials, models, strict=True):
        joints = positions_of(trial.log, model)
        assert joints is not None
        if len(joints) < more.fewest(FEWEST_ROWS):
            return None
        away = more.settled(joints) - more.differentiated(joints, dt)[0]
        if (np.sqrt(np.mean(away**2, axis=0)) > BENT * noise_of(joints)).any():
            return None
    return more
