"""The problem of measured forces: what the drive gave, less what the measured motion needed and friction took.

For a robot on a fixed base whose joint positions and drive torques were measured. Nothing is simulated: positions are
low-passed and differentiated, the torque that this motion needs comes from inverse dynamics, friction and springs from
the drive path's own laws at each instant, and what is left over is the residual. It is linear in most parameters, never
chaotic, and takes milliseconds a model; what it cannot see are the controller (a delay, a gain) and the sensors.

For one joint, and with the settings below, this is the published definition of the relative force error on EMPS (Janot,
Gautier, Brunot 2019; Gautier, Janot, Vandanjon 2013): regressor and force both decimated, signs taken before.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.ndimage import binary_opening
from scipy.signal import savgol_filter

from ee_dist.discrepancy.measured_trial import MeasuredTrial
from ee_dist.discrepancy.problem import Layout, Mask, Problem, Series
from ee_dist.discrepancy.ways.force_balance.ripple import Remains, describe, remains
from ee_dist.discrepancy.ways.open_loop.prediction import roughness
from ee_dist.effects.catalogue import Hypothesis, apply
from ee_dist.effects.controller_laws import CONTROLLER_LAWS
from ee_dist.effects.laws import LawContext, find_law
from ee_dist.engines.friction import Friction
from ee_dist.measurements.errors import MeasurementError
from ee_dist.measurements.sampling import LowPass, decimated
from ee_dist.robots.inertia import felt_inertia
from ee_dist.robots.instruments import MOTOR_TORQUE
from ee_dist.robots.inverse_dynamics import geometry, gravity, gravity_regressor, parameters, regressor, rotors
from ee_dist.robots.model import DRIVE_NUMBERS, Drive, Robot
from ee_dist.trials.log import Array, SensorLog

INSTANT_S = 1e-9
"""Time step at which the drive path's implicit friction is that of the instant."""
KEPT = 4
"""Geometries whose regressors are kept."""
PASSED = 1 / 20
"""Cut-off of the positions' low-pass as a share of their rate: above it, differences twice over are mostly noise."""
REST_NOISE = 3.0
"""Standard deviations of the readings' slope below which a joint rests."""
REST_WINDOWS = 1
"""Lengths of that line that a rest lasts at least."""
FINEST = 1e-5
"""Share of a joint's travel that no reading resolves."""
LEAST_NOISE = 0.002
"""Share of the force below which no difference counts, noise or not."""


@dataclass(frozen=True)
class Processing:
    """What is done to the measurements: low-pass of the positions (None: at a twentieth of the rate, 50 Hz at 1 kHz), rows
    dropped at the start (where the filter settles), one row kept of ``keep_every``, blocks of time judged apart."""

    low_pass: LowPass | None = None
    drop_rows: int = 49
    keep_every: int = 10
    blocks: int = 12

    def filter_for(self, step_s: float) -> LowPass:
        return self.low_pass or LowPass(cutoff_hz=PASSED / step_s)


@dataclass(eq=False)
class Moved:
    """The regressor (T, M, 10 P) of one geometry along a motion, under gravity ``pull`` (3,); what other gravity adds to it
    for each m/s^2 along x, y, z, once that is asked for."""

    all_of_it: Array
    pull: Array
    by_pull: Array | None = None
    last: tuple[bytes, Array] | None = None
    """Masses and gravity asked for last, and the torque (T, M)."""


@dataclass(frozen=True, eq=False)
class Motion:
    """A measured motion (T, M): positions, speeds, accelerations; ``torque`` that the drives gave; ``rest``: where a joint
    did not move, as far as its readings tell."""

    position: Array
    speed: Array
    acceleration: Array
    torque: Array
    rest: Mask
    known: dict[tuple[object, ...], Moved] = field(default_factory=dict)

    def needed(self, robot: Robot) -> Array:
        """(T, M) torque that the motion needs. What depends on geometry and gravity is computed once for each."""
        shape, pull, masses = geometry(robot), gravity(robot), parameters(robot)
        if shape not in self.known:
            if len(self.known) >= KEPT:
                self.known.pop(next(iter(self.known)))
            self.known[shape] = Moved(regressor(robot, self.position, self.speed, self.acceleration), pull)
        known = self.known[shape]
        # Most hypotheses change the drives alone.
        asked = masses.tobytes() + pull.tobytes()
        if known.last is None or known.last[0] != asked:
            torque = known.all_of_it @ masses
            if (pull != known.pull).any():
                if known.by_pull is None:
                    known.by_pull = gravity_regressor(robot, self.position)
                torque = torque + np.tensordot(pull - known.pull, known.by_pull @ masses, 1)
            known.last = asked, torque
        return np.asarray(known.last[1] + rotors(robot) * self.acceleration)


def motion_of(log: SensorLog, robot: Robot, processing: Processing) -> Motion:
    """Raises MeasurementError where the log lacks positions or torques, or is too short."""
    joints = _positions(log, robot)
    torques = motor_torques(log, robot)
    if joints is None or torques is None:
        what = "joint positions" if joints is None else "torques of the drives"
        hint = ""
        if joints is not None and any(s.kind == "torque" for s in robot.sensors):
            hint = (
                "; a sensor of kind torque shows what friction leaves of them: if it measures the motor, as a current does, "
                f"describe it as kind {MOTOR_TORQUE}"
            )
        raise MeasurementError(f"the log of {robot.name} has no {what}: a balance of forces needs both{hint}")
    if len(log) < processing.drop_rows + 10 * processing.keep_every:
        raise MeasurementError(f"the log of {robot.name} has only {len(log)} rows: too few for the filters")
    dt = float(np.median(np.diff(log.times_s)))
    smooth = processing.filter_for(dt)
    position = np.stack([smooth(q, dt) for q in joints.T], axis=1)
    speed = np.gradient(position, dt, axis=0)
    acceleration = np.gradient(speed, dt, axis=0)
    cut = slice(processing.drop_rows, None)
    return Motion(
        position[cut], speed[cut], acceleration[cut], np.array(torques[cut]), at_rest(joints, dt, processing)[cut]
    )


def at_rest(joints: Array, dt: float, processing: Processing) -> Mask:
    """(T, M): where readings (T, M) tell no motion: a line laid through them over half a period of the filter's cut-off does
    not rise by more than their noise allows. A filter smears the moment in which a joint sticks; the readings do not."""
    rows = max(int(0.5 / processing.filter_for(dt).cutoff_hz / dt) // 2 * 2 + 1, 5)
    slope = savgol_filter(joints, rows, 1, deriv=1, delta=dt, axis=0)
    noise = np.maximum(np.sqrt(np.median(roughness(joints), axis=0) / 0.455), FINEST * np.ptp(joints, axis=0))
    still = np.abs(slope) <= REST_NOISE * noise * math.sqrt(12.0 / rows**3) / dt
    # A reversal is slow for a moment too: rest lasts.
    return np.asarray(binary_opening(still, np.ones((REST_WINDOWS * rows, 1), dtype=bool)))


def motor_torques(log: SensorLog, robot: Robot) -> Array | None:
    """(T, M) what the motors gave, before friction: the log's torques, else what sensors of motor torque read; None without.

    A sensor shows the step before its reading. Differences of positions are of both steps about a row: so is the mean of a
    reading and the next.
    """
    if log.torques is not None:
        return log.torques
    read = _channels(log, robot, MOTOR_TORQUE)
    return None if read is None else np.concatenate([(read[:-1] + read[1:]) / 2, read[-1:]])


def _positions(log: SensorLog, robot: Robot) -> Array | None:
    """(T, M) as the sensors read them, noise and all; else as the log knows them; None without."""
    read = _channels(log, robot, "position")
    return log.joints if read is None else read


def _channels(log: SensorLog, robot: Robot, kind: str) -> Array | None:
    """(T, M) what the sensors of one kind read, if every drive has one."""
    of = {s.target: k for k, s in enumerate(robot.sensors) if s.kind == kind}
    if not set(robot.motor_names) <= set(of):
        return None
    return np.array(log.sensors[:, [of[m] for m in robot.motor_names]])


class ForceBalance(Problem):
    """A balance of forces. Channels are the drives.

    A residual value is a force left over, in units of the noise of the measured force; ``natural`` makes a relative force
    error of it. Segments are blocks of time.
    """

    way = "force_balance"
    families = frozenset({"body", "drive", "world"})
    switches = False
    natural_name = "relative force error"
    natural_unit = "1"

    def __init__(self, trials: Sequence[MeasuredTrial], robot: Robot, processing: Processing | None = None) -> None:
        self.robot, self.measured = robot, tuple(trials)
        self.processing = processing or Processing()
        self.motions = [motion_of(t.log, robot, self.processing) for t in trials]
        self.models = [apply(robot, t.setup) for t in trials]
        names = robot.motor_names
        every = self.processing.keep_every
        forces = [decimated(m.torque, every) for m in self.motions]
        self.size = np.sqrt(np.mean(np.concatenate(forces) ** 2, axis=0))
        if not self.size.all():
            raise MeasurementError(f"{names[int(np.argmin(self.size))]}: its measured torque is zero throughout")
        # One share for all drives, so that the sum of squares is the relative error of all of them.
        self.noise_share = max(self._noise(forces), LEAST_NOISE)
        self.scale = self.size * self.noise_share
        self._lay_out(forces)
        p, smooth = self.processing, self.processing.filter_for(float(np.median(np.diff(trials[0].log.times_s))))
        self.error_definition = (
            "root mean square of the force left over, in standard deviations of the measured force's noise "
            f"({self.noise_share:.2%} of its root mean square); positions through a {smooth}, central differences, "
            f"forces decimated by {p.keep_every}"
        )

    def _noise(self, forces: Sequence[Array]) -> float:
        """Noise of the force, as a share of it: from second differences. What a model accounts for is no noise, so the
        least of what the measured force shows and of what the model as it is leaves over."""
        every = self.processing.keep_every
        left = [decimated(left_over(m, motion), every) for m, motion in zip(self.models, self.motions, strict=True)]
        found = []
        for series in (forces, left):
            if all(np.isfinite(s).all() for s in series):
                parts = [np.median(roughness(s / self.size), axis=0) / 0.455 for s in series]
                found.append(float(np.sqrt(np.mean(parts))))
        return min(found)

    def natural(self, error: float) -> float:
        """Root mean square of the force left over, as a share of that of the measured force."""
        return error * self.noise_share

    def told(self, error: float) -> str:
        return f"{100 * self.natural(error):.3g} %"

    def raw(self, residual: Array) -> Array:
        return np.asarray(residual * self.scale[self.channel_of])

    def _lay_out(self, forces: Sequence[Array]) -> None:
        names: list[str] = []
        seg, time, of_trial = [], [], []
        self.slices: list[slice] = []
        self.times_s: list[Array] = []
        at, motors = 0, len(self.robot.motor_names)
        for k, (trial, force) in enumerate(zip(self.measured, forces, strict=True)):
            rows = len(force)
            blocks = min(self.processing.blocks, max(1, rows // 20))
            block = np.minimum(np.arange(rows) * blocks // rows, blocks - 1)
            dt = float(np.median(np.diff(trial.log.times_s))) * self.processing.keep_every
            start = self.processing.drop_rows * dt / self.processing.keep_every
            self.times_s.append(start + np.arange(rows) * dt)
            first = len(names)
            names += [f"{trial.name}@{start + float(np.argmax(block == b)) * dt:.1f}s" for b in range(blocks)]
            of_trial += [k] * blocks
            seg.append(np.repeat(first + block, motors))
            time.append(np.repeat(self.times_s[-1], motors))
            self.slices.append(slice(at, at + rows * motors))
            at += rows * motors
        kinds = {j.name: j.kind for j in self.robot.joints}
        self.layout = Layout(
            segments=tuple(names),
            trial_of_segment=np.array(of_trial),
            segment_of=np.concatenate(seg).astype(np.int64),
            channel_of=np.tile(np.arange(motors), at // motors),
            time_s=np.concatenate(time),
            reading=np.ones(at, dtype=bool),
            floor=np.ones(at),
            known=np.zeros(at),
            channels=self.robot.motor_names,
            units=tuple("N" if kinds[m] == "slide" else "N.m" for m in self.robot.motor_names),
            joint_of_channel=tuple(range(motors)),
        )

    def residuals(self, hypotheses: Sequence[Hypothesis], trials: Sequence[int] | None = None) -> Array:
        """(H, n), as the contract says. Raises EffectError for a hypothesis that does not fit the robot."""
        chosen = range(len(self.measured)) if trials is None else trials
        out = np.zeros((len(hypotheses), len(self.segment_of)))
        for row, hypothesis in enumerate(hypotheses):
            for k in chosen:
                left = left_over(apply(self.models[k], hypothesis), self.motions[k])
                kept = decimated(left, self.processing.keep_every) if np.isfinite(left).all() else None
                out[row, self.slices[k]] = np.inf if kept is None else (kept / self.scale).ravel()
        return out

    def series(self, hypothesis: Hypothesis) -> list[Series]:
        """The measured force, and the one that the model accounts for."""
        left = self.raw(self.residuals([hypothesis])[0])
        out = []
        for k, motion in enumerate(self.motions):
            force = decimated(motion.torque, self.processing.keep_every)
            rest = left[self.slices[k]].reshape(force.shape)
            for c, unit in enumerate(self.layout.units):
                out.append(Series(k, c, unit, self.times_s[k], force[:, c], (force - rest)[:, c]))
        return out

    def remains(self, hypothesis: Hypothesis, motor: int = 0, trial: int = 0) -> Remains:
        """When, in which direction and over which position the hypothesis leaves something at one drive in one trial."""
        every = self.processing.keep_every
        rows = self.residuals([hypothesis], [trial])[0][self.slices[trial]]
        left = rows.reshape(-1, len(self.channels))[:, motor] * self.scale[motor]
        motion = self.motions[trial]
        x, v, a = (decimated(s[:, motor], every) for s in (motion.position, motion.speed, motion.acceleration))
        return remains(self.channels[motor], left, x, v, a)

    def remarks(self, hypothesis: Hypothesis) -> list[str]:
        lines: list[str] = []
        for k, unit in enumerate(self.layout.units):
            lines += describe(self.remains(hypothesis, k), unit, "m" if unit == "N" else "rad")
        return lines

    def noise_floor(self) -> tuple[float, str]:
        return 1.0, "estimated: second differences of the force"


def left_over(robot: Robot, motion: Motion) -> Array:
    """(T, M): what the drives gave at the joints, less what the motion needed, in terms of the measured force."""
    needed = motion.needed(robot)
    q, qd = motion.position, motion.speed
    p, uses = _fields(robot.drives)
    active = motion.torque * p["strength"]
    torque = active - p["spring"] * (q - p["spring_rest"]) + p["offset_torque"]
    # What rests goes on resting through the instant: friction takes what it must, up to its limit.
    rubbed = np.where(motion.rest, -motion.acceleration * INSTANT_S, qd)
    rows = np.arange(len(q))
    for law in robot.laws:
        if law.name in CONTROLLER_LAWS:
            continue
        k = robot.motor_names.index(law.joint)
        context = LawContext({n: np.full(len(q), v) for n, v in law.values}, INSTANT_S)
        context.position, context.speed, context.torque = q[:, k], qd[:, k], torque[:, k]
        torque[rows, k] += find_law(law.name)(context)
    if Friction.rows(p).any():
        inertia = felt_inertia(robot)[None, :]
        friction = Friction(p, uses, inertia, INSTANT_S)
        # The load on a joint is all that its motion needed beyond its own inertia.
        load = inertia * motion.acceleration - needed
        friction.record(-load, rubbed)
        torque = friction(torque, active, rubbed)
    # In terms of what was measured: a weak motor would otherwise shrink the residual along with the force.
    return (torque - needed) / np.maximum(p["strength"], 1e-3)


def _fields(drives: Sequence[Drive]) -> tuple[dict[str, Array], dict[str, bool]]:
    """Numbers of the drives by field, (1, M) each, and whether any is not neutral."""
    names = list(DRIVE_NUMBERS)
    p = {n: np.array([[getattr(d, n) for d in drives]], dtype=float) for n in names}
    neutral = {n: Drive.__dataclass_fields__[n].default for n in names}
    return p, {n: bool(np.any(p[n] != neutral[n])) for n in names if isinstance(neutral[n], float)}
