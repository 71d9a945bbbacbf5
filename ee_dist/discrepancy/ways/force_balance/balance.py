"""What a model leaves of the measured forces, joint by joint: a hypothesis seldom changes more than one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ee_dist.discrepancy.ways.force_balance.motion import Motion
from ee_dist.effects.laws import SPEED_LAWS, LawContext, find_law
from ee_dist.engines.friction import DRY, LOADED, SIDED, Friction
from ee_dist.measurements.sampling import decimated
from ee_dist.robots.inertia import felt_inertia
from ee_dist.robots.instruments import MOTOR_TORQUE
from ee_dist.robots.inverse_dynamics import geometry, gravity, parameters
from ee_dist.robots.model import DRIVE_NUMBERS, Drive, Robot
from ee_dist.trials.log import Array

INSTANT_S = 1e-9
"""Time step at which the drive path's implicit friction is that of the instant."""
RUBBING = (*DRY, *LOADED, *SIDED, "viscous")
"""Fields of a drive that rub. Back-EMF does not: what was measured, a current or the torque that it makes, is less by it."""
SEEN = (
    "strength",
    "current_gain",
    "spring",
    "spring_rest",
    "offset_torque",
    "stribeck_speed",
    "stribeck_load_speed",
    "rotor_inertia",
    "torque_limit",
    "torque_read_late_s",
    *RUBBING,
)
"""Fields of a drive that a balance of forces sees, and when its torque was read: neither the controller nor what lies between
motor and joint."""
BEYOND = "torque_limit"
"""Of these, the one that only says up to which load friction by load is believed: it tells no two models apart."""
NUDGE = 1e-4
"""Share of a measured force by which it is moved to see how the rest follows."""
LEAST_SLOPE = 0.05
"""Least change of what is left over for one of the measured force, where a joint moves: a gear that rubs this much away hardly
lets its motor through."""
MOST_VALUES = 8_000_000
"""Values that are kept of what joints leave, of all motions together: 128 MB, for each stands there twice."""


class Balance:
    """What models leave along one motion of ``motions``, every ``keep_every`` th row of it."""

    def __init__(self, motion: Motion, keep_every: int, motions: int = 1) -> None:
        self.motion, self.keep_every = motion, keep_every
        self.rest = decimated(motion.of_judged(motion.rest).astype(float), keep_every) > 0.5
        """(rows, J): where a joint did not move."""
        self._kept: dict[tuple[object, ...], tuple[Array, Array] | None] = {}
        self._most = max(MOST_VALUES * keep_every // (motions * max(len(motion.torque), 1)), 64)

    def __call__(self, robot: Robot) -> tuple[Array, Array] | None:
        """(rows, J) of ``left_over`` at the judged drives, decimated: with friction that holds what rests, and without it; None
        where a model leaves the finite numbers."""
        asked, needed = self.motion.needed(robot)
        inertia = felt_inertia(robot)
        late = self.motion.readings.late_s(robot).tolist()
        laws = {d.joint: tuple(law for law in robot.laws if law.joint == d.joint) for d in robot.drives}
        keys = [
            (k, asked, late[k], tuple(getattr(d, n) for n in SEEN), laws[d.joint], inertia[k] if _rubs(d) else 0.0)
            for k, d in ((k, robot.drives[k]) for k in self.motion.judged)
        ]
        missing = [i for i, key in enumerate(keys) if key not in self._kept]
        if missing:
            if len(self._kept) + len(missing) > self._most:
                self._kept.clear()
                missing = list(range(len(keys)))
            held, free = left_over(robot, self.motion, needed, [self.motion.judged[i] for i in missing])
            whole = np.asarray(np.isfinite(held).all(axis=0))
            kept = decimated(np.where(whole, held, 0.0), self.keep_every)
            loose = kept if free is held else decimated(np.where(whole, free, 0.0), self.keep_every)
            for column, i in enumerate(missing):
                # Not as a view: that would keep all rows of all joints, of which every tenth of one is wanted.
                own = kept[:, column].copy()
                other = own if loose is kept else loose[:, column].copy()
                self._kept[keys[i]] = (own, other) if whole[column] else None
        columns = [c for key in keys if (c := self._kept[key]) is not None]
        if len(columns) < len(keys):
            return None
        return np.stack([c[0] for c in columns], axis=1), np.stack([c[1] for c in columns], axis=1)


def told_by(robot: Robot, judged: Sequence[int]) -> tuple[object, ...]:
    """What of a robot a balance of forces at the ``judged`` drives depends on: of two with the same it leaves the same."""
    own = [robot.drives[k] for k in judged]
    names = {d.joint for d in own}
    drives = tuple(tuple(getattr(d, n) for n in SEEN if n != BEYOND) for d in own)
    laws = tuple(law for law in robot.laws if law.name not in SPEED_LAWS and law.joint in names)
    # Another joint needs no force of these for what it carries, but where they carry it too.
    late = tuple(s.delay_s for s in robot.sensors if s.kind == MOTOR_TORQUE and s.target in names)
    return geometry(robot), gravity(robot).tobytes(), parameters(robot, names).tobytes(), drives, laws, late


def left_over(robot: Robot, motion: Motion, needed: Array, joints: Sequence[int]) -> tuple[Array, Array]:
    """(T, J) at some joints: what the drives gave, less what the motion needed (T, M), in terms of the measured force; and the
    same without friction at what rests (the very same array where that makes no difference). By rows of the motion:
    torques that were read late are taken from the rows in which they stand."""
    drives = [replace(robot.drives[k], back_emf=0.0) for k in joints]
    q, qd, qdd = (np.ascontiguousarray(a[:, joints]) for a in (motion.position, motion.speed, motion.acceleration))
    late_s = motion.readings.late_s(robot)[joints]
    given = np.ascontiguousarray(
        motion.readings.of_motion(joints, late_s) if late_s.any() else motion.torque[:, joints]
    )
    needed = needed[:, joints] + np.array([d.rotor_inertia for d in drives]) * qdd
    if motion.external is not None:
        needed = needed - motion.external[:, joints]
    p, uses = _fields(drives)
    through = p["strength"] * p["current_gain"]
    active = given * through
    torque = active - p["spring"] * (q - p["spring_rest"]) + p["offset_torque"]
    place = {d.joint: k for k, d in enumerate(drives)}
    for law in robot.laws:
        if law.name in SPEED_LAWS or law.joint not in place:
            continue
        k = place[law.joint]
        context = LawContext({n: np.full(len(q), v) for n, v in law.values}, INSTANT_S)
        context.position, context.speed, context.torque = q[:, k], qd[:, k], torque[:, k]
        torque[:, k] += find_law(law.name)(context)
    free = torque
    if Friction.rows(p).any():
        # What rests goes on resting through the instant: friction takes what it must, up to its limit.
        rubbed = np.where(motion.rest[:, joints], -qdd * INSTANT_S, qd)
        inertia = felt_inertia(robot)[None, joints]
        friction = Friction(p, uses, inertia, INSTANT_S)
        # The load on a joint is all that its motion needed beyond its own inertia.
        load = inertia * qdd - needed
        friction.record(-load, rubbed)
        after = friction(torque, active, rubbed)
        if friction.loaded:
            nudge = NUDGE * np.sqrt(np.mean(active**2, axis=0)) + 1e-12
            slope = (friction(torque + nudge, active + nudge, rubbed) - after) / nudge
            # What rests is held by whatever it takes: there the measured force has no say.
            slope = np.where(motion.rest[:, joints], 1.0, np.maximum(slope, LEAST_SLOPE))
            after = needed + (after - needed) / slope
        free, torque = np.where(motion.rest[:, joints], torque, after), after
    # In terms of what was measured: a weak motor, or friction that is a share of the motor's own force, would otherwise
    # shrink the residual along with the force.
    through = np.maximum(through, 1e-3)
    held = np.asarray((torque - needed) / through)
    return held, held if free is torque or not motion.rest[:, joints].any() else np.asarray((free - needed) / through)


def _rubs(drive: Drive) -> bool:
    return any(getattr(drive, n) != 0 for n in RUBBING)


def _fields(drives: Sequence[Drive]) -> tuple[dict[str, Array], dict[str, bool]]:
    """Numbers of the drives by field, (1, J) each, and whether any is not neutral."""
    names = list(DRIVE_NUMBERS)
    table = np.array([[getattr(d, n) for n in names] for d in drives], dtype=float)
    p = {n: np.ascontiguousarray(table[None, :, i]) for i, n in enumerate(names)}
    neutral = {n: Drive.__dataclass_fields__[n].default for n in names}
    return p, {n: bool(np.any(p[n] != neutral[n])) for n in names if isinstance(neutral[n], float)}
