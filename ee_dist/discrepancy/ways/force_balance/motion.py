"""A measured motion as a balance of forces sees it: filtered, differentiated, and with the torque that it needs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import scipy

from ee_dist.discrepancy.measured_trial import MeasuredTrial
from ee_dist.discrepancy.problem import Mask
from ee_dist.discrepancy.ways.force_balance.readings import Readings
from ee_dist.discrepancy.ways.open_loop.prediction import roughness
from ee_dist.measurements.errors import MeasurementError
from ee_dist.measurements.sampling import LowPass
from ee_dist.robots.instruments import MOTOR_TORQUE
from ee_dist.robots.inverse_dynamics import (
    geometry,
    gravity,
    gravity_regressor,
    parameters,
    regressor,
    torques_of_parts,
    weights,
)
from ee_dist.robots.model import Robot
from ee_dist.robots.ranges import travel
from ee_dist.trials.log import Array, SensorLog

ROOM = 150_000_000
"""Bytes of regressors that are kept for a motion, if there are more than two geometries."""
ONCE = 16
"""Geometries of which the torques of one set of masses are kept for a motion."""
PASSED = 1 / 20
"""Cut-off of the positions' low-pass as a share of their rate: above it, differences twice over are mostly noise."""
SLOWEST_HZ, STEEPEST = 5.0, 1 / 5
"""Cut-off below which the motion of an arm would go too, and its largest share of the rate."""
REST_NOISE = 3.0
"""Standard deviations of the readings' slope below which a joint rests."""
REST_WINDOWS = 1
"""Lengths of that line that a rest lasts at least."""
GIVE_RAD, GIVE_M, GIVE_SHARE = 0.01, 1e-4, 0.01
"""What teeth, gears and bearings give before anything slides; of half a joint's range no more than this share."""
FEWEST = 10
"""Rows of forces that a log must leave."""
FINEST = 1e-5
"""Share of a joint's travel that no reading resolves."""


@dataclass(frozen=True)
class Processing:
    """What is done to the measurements: low-pass of positions and forces (None: at a share ``passed`` of the rate, 50 Hz at
    1 kHz), rows dropped at either end (a filter that runs forward and backward settles at both), one row kept of
    ``keep_every``, blocks of time judged apart."""

    low_pass: LowPass | None = None
    drop_rows: int = 49
    keep_every: int = 10
    blocks: int = 12
    passed: float = PASSED

    @classmethod
    def for_rate(cls, step_s: float) -> Processing:
        """The usual one; below 100 Hz a larger share passes, the filter settles in fewer rows, and more of them are kept."""
        wider = max(1.0, min(SLOWEST_HZ * step_s, STEEPEST) / PASSED)
        usual = cls()
        return cls(
            drop_rows=round(usual.drop_rows / wider), keep_every=round(usual.keep_every / wider), passed=PASSED * wider
        )

    def filter_for(self, step_s: float) -> LowPass:
        return self.low_pass or LowPass(cutoff_hz=self.passed / step_s)

    def settled(self, series: Array) -> Array:
        """(T - 2 drop_rows, ...) of a series (T, ...): where filters have settled."""
        return series[self.drop_rows : len(series) - self.drop_rows]

    def fewest(self, kept: int) -> int:
        """Rows that a log needs so that ``kept`` are kept of it."""
        return 2 * self.drop_rows + kept * self.keep_every

    def filtered(self, series: Array, step_s: float) -> Array:
        """(T, M) of readings (T, M): ends that have not settled too."""
        low_pass = self.filter_for(step_s)
        return np.stack([low_pass(column, step_s) for column in series.T], axis=1)

    def smooth(self, series: Array, step_s: float) -> Array:
        """(T - 2 drop_rows, M) of readings (T, M)."""
        return self.settled(self.filtered(series, step_s))

    def differentiated(self, joints: Array, step_s: float) -> tuple[Array, Array, Array]:
        """Positions, speeds and accelerations, (T - 2 drop_rows, M) each, of readings (T, M)."""
        low_pass, cut = self.filter_for(step_s), self.settled
        position = np.stack([low_pass(q, step_s) for q in joints.T], axis=1)
        speed = np.gradient(position, step_s, axis=0)
        return cut(position), cut(speed), cut(np.gradient(speed, step_s, axis=0))


@dataclass(eq=False)
class Moved:
    """The regressor of one geometry along a motion, column by column (10 B, T, M), under gravity ``pull`` (3,); what other
    gravity adds to what has weight of it (3, T, M, 4 B) for each m/s^2 along x, y, z, once that is asked for."""

    columns: Array
    pull: Array
    by_pull: Array | None = None
    last: tuple[bytes, Array] | None = None
    """Masses and gravity asked for last, and the torque (T, M)."""
    base: tuple[Array, Array] | None = None
    """Masses that others differ from in a few numbers, and their torque under ``pull``."""

    def torque(self, masses: Array) -> Array:
        """(T, M) under ``pull``. Most that a search asks for differ from one another in a body or two."""
        if self.base is not None:
            change = masses - self.base[0]
            at = np.flatnonzero(change)
            if 2 * len(at) <= len(masses):
                return np.asarray(self.base[1] + np.tensordot(change[at], self.columns[at], 1))
        self.base = masses, np.tensordot(masses, self.columns, 1)
        return self.base[1]


@dataclass(frozen=True, eq=False)
class Motion:
    """A measured motion (T, M): positions, speeds, accelerations; ``torque`` that the drives gave, NaN but at the ``judged``
    (J,) drives; ``rest``: where a joint did not move, as far as its readings tell; ``external``: known torques that are not the
    drives', if there are any; ``readings``: the torques before the ends of the record were dropped."""

    position: Array
    speed: Array
    acceleration: Array
    torque: Array
    rest: Mask
    judged: tuple[int, ...]
    readings: Readings
    external: Array | None = None
    known: dict[tuple[object, ...], Moved] = field(default_factory=dict)
    once: dict[tuple[object, ...], tuple[bytes, Array]] = field(default_factory=dict)
    """Torques (T, M) of geometries that were asked for with one set of masses and gravity."""

    def of_judged(self, series: Array) -> Array:
        """(T, J, ...) what a series (T, M, ...) holds of the judged drives."""
        return np.take(series, self.judged, axis=1)

    def needed(self, robot: Robot) -> tuple[object, Array]:
        """(T, M) torque that the motion of the parts needs, without that of the rotors; equal keys have equal torques. What
        depends on geometry and gravity is computed once for each that is asked for with two sets of masses: most that a search
        asks for come once."""
        shape, pull, masses = geometry(robot), gravity(robot), parameters(robot)
        # Most hypotheses change the drives alone.
        asked = masses.tobytes() + pull.tobytes()
        if shape not in self.known:
            once = self.once.get(shape)
            if once is None:
                if len(self.once) >= ONCE:
                    self.once.pop(next(iter(self.once)))
                once = asked, torques_of_parts(robot, self.position, self.speed, self.acceleration)
                self.once[shape] = once
            if once[0] == asked:
                return (shape, asked), once[1]
            found = regressor(robot, self.position, self.speed, self.acceleration)
            found = np.ascontiguousarray(np.moveaxis(found, 2, 0))
            while len(self.known) >= max(2, ROOM // max(found.nbytes, 1)):
                self.known.pop(next(iter(self.known)))
            self.known[shape] = Moved(found, pull)
        # The one asked for last goes last: what most hypotheses share stays.
        known = self.known[shape] = self.known.pop(shape)
        if known.last is None or known.last[0] != asked:
            torque = known.torque(masses)
            if (pull != known.pull).any():
                if known.by_pull is None:
                    known.by_pull = gravity_regressor(robot, self.position)
                torque = torque + np.tensordot(pull - known.pull, known.by_pull @ weights(masses), 1)
            known.last = asked, torque
        return (shape, asked), known.last[1]


def motion_of(
    trial: MeasuredTrial, robot: Robot, processing: Processing, judged: Sequence[int] | None = None
) -> Motion:
    """``judged``: drives whose torques count; without, all that the log knows. Raises MeasurementError where it lacks positions
    or torques, or is too short."""
    log = trial.log
    joints = positions_of(log, robot)
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
    if len(log) < (fewest := processing.fewest(FEWEST)):
        raise MeasurementError(
            f"trial {trial.name!r} of {robot.name} has only {len(log)} rows: a balance of forces takes {fewest} for its filters; "
            "leave it out (trials=[...] names the others)"
        )
    if log.torques is None and trial.commands_held is False:
        torques = of_the_step_after(torques)
    dt = float(np.median(np.diff(log.times_s)))
    judged = torques_known(torques) if judged is None else judged
    rest = processing.settled(at_rest(joints, dt, processing, give(robot)))
    whole = np.full(torques.shape, math.nan)
    # Forces go the way of the positions: what a filter takes from the motion, and not from them, would look like a missing force.
    whole[:, judged] = processing.filtered(np.take(torques, judged, axis=1), dt)
    return Motion(
        *processing.differentiated(joints, dt),
        processing.settled(whole),
        rest,
        tuple(judged),
        Readings(whole, processing.drop_rows, dt, by_sensors=log.torques is None),
        None if log.external is None else processing.smooth(log.external, dt),
    )


def of_the_step_after(readings: Array) -> Array:
    """(T, M) of readings (T, M) in our own simulations, where a sensor shows the step before its row: the force of the step that
    begins at the row. It is this one that bends the motion there: engines take force, then speed, then position
    (``discrepancy/steps.py``), so that second differences of positions about a row are its work alone."""
    return np.concatenate([readings[1:], readings[-1:]])


def give(robot: Robot) -> Array:
    """(M,) rad (m) that a joint moves although it sticks: dry friction is then what it has to be, up to its limit."""
    joints = [robot.joint(name) for name in robot.motor_names]
    most = [GIVE_RAD if j.kind == "hinge" else GIVE_M for j in joints]
    return np.array([min(m, GIVE_SHARE * travel(j)) for m, j in zip(most, joints, strict=True)])


def at_rest(joints: Array, dt: float, processing: Processing, give: Array) -> Mask:
    """(T, M): where readings (T, M) tell no motion: a line laid through them over half a period of the filter's cut-off does
    not rise by more than their noise allows. A filter smears the moment in which a joint sticks; the readings do not. Nor does a
    joint slide that moves from rest to rest by no more than it gives (M,)."""
    low_pass = processing.filter_for(dt)
    rows = max(int(0.5 / low_pass.cutoff_hz / dt) // 2 * 2 + 1, 5)
    slope = scipy.signal.savgol_filter(joints, rows, 1, deriv=1, delta=dt, axis=0)
    noise = np.maximum(noise_of(joints), FINEST * np.ptp(joints, axis=0))
    still = np.abs(slope) <= REST_NOISE * noise * math.sqrt(12.0 / rows**3) / dt
    # A reversal is slow for a moment too: rest lasts.
    still = np.asarray(scipy.ndimage.binary_opening(still, np.ones((REST_WINDOWS * rows, 1), dtype=bool)))
    for k, column in enumerate(joints.T):
        smooth = low_pass(column, dt)
        for run in np.split(np.arange(len(smooth)), np.flatnonzero(np.diff(still[:, k])) + 1):
            still[run, k] |= np.ptp(smooth[run]) <= give[k]
    return still


def noise_of(readings: Array) -> Array:
    """(M,) standard deviation of the noise of readings (T, M) of something smooth."""
    return np.asarray(np.sqrt(np.median(roughness(readings), axis=0) / 0.455))


def motor_torques(log: SensorLog, robot: Robot) -> Array | None:
    """(T, M) what the motors gave, before friction, row by row: the log's torques, else what sensors of motor torque read; NaN at
    drives of which neither tells, and None where they tell of none."""
    found = _channels(log, robot, MOTOR_TORQUE) if log.torques is None else log.torques
    return found if torques_known(found) else None


def torques_known(torques: Array) -> tuple[int, ...]:
    """The drives whose torques, of (T, M), are known in all rows."""
    return tuple(int(k) for k in np.flatnonzero(np.isfinite(torques).all(axis=0)))


def judged_in(trials: Sequence[MeasuredTrial], robot: Robot) -> tuple[int, ...]:
    """The drives whose torques are known in every trial. Raises MeasurementError where each trial knows those of others."""
    read = [t for trial in trials if (t := motor_torques(trial.log, robot)) is not None]
    found = tuple(k for k in range(len(robot.drives)) if all(k in torques_known(t) for t in read))
    if not found:
        raise MeasurementError(
            f"no joint of {robot.name} has its torque known in every trial: compare trials that know the same torques"
        )
    return found


def positions_of(log: SensorLog, robot: Robot) -> Array | None:
    """(T, M) as the sensors read them, noise and all; else as the log knows them; None without."""
    read = _channels(log, robot, "position")
    return read if np.isfinite(read).all() else log.joints


def _channels(log: SensorLog, robot: Robot, kind: str) -> Array:
    """(T, M) what the sensors of one kind read; NaN at a drive that has none."""
    of = {s.target: k for k, s in enumerate(robot.sensors) if s.kind == kind}
    none = np.full(len(log), math.nan)
    return np.stack([log.sensors[:, of[m]] if m in of else none for m in robot.motor_names], axis=1)
