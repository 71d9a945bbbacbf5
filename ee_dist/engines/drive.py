"""The drive path: from command to joint torque, for a whole batch at once and the same for every engine.

    command -> delay -> gain -> profile of the goal -> controller (of position, with deadband and zero offset, of speed, or
            none; the speed that it knows may be a law's)
            -> motor (torque limit, back-EMF, strength, supply)
            -> transmission (backlash, compliance) -> joint (spring, offset, a user's own laws, friction, brake, stops)

Each stage runs only if some row of the batch needs it, and a row at neutral values passes through it unchanged, bit
for bit, so a result never depends on what else is in the batch.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields

import numpy as np
from numpy.typing import NDArray

from ee_dist.effects.laws import LAWS, SPEED_LAWS, LawContext, LawFunction, drive_law, find_law
from ee_dist.engines.compiled import compiled
from ee_dist.engines.contract import EngineError
from ee_dist.engines.delay import Delay
from ee_dist.engines.friction import Friction
from ee_dist.engines.goals import Goals
from ee_dist.engines.per_robot import per_robot
from ee_dist.engines.transmission import Transmission
from ee_dist.robots.inertia import felt_inertia, steady_inertia
from ee_dist.robots.model import COMMANDS, DRIVE_NUMBERS, Drive, Robot
from ee_dist.trials.log import Array

__all__ = ["LAWS", "DrivePath", "LawContext", "LawFunction", "drive_law"]

STIFF_SHARE, LOOK_SHARE = 1.8, 0.2
"""A controller whose damping takes this share of a joint's speed in a step would soon shake it (at 2 it turns the motion round):
from there on an engine takes the damping at the end of the step, if it can. The share is of the inertia with which all joints
can be stopped at once; below the second one, of the joint's own, nothing needs to be looked at."""
HOPELESS_SHARE = 2.0
"""Of the joint's own inertia, what no explicit step holds."""
GOVERNED = 0.9
"""Share of its top speed from which a controller of torques lets less of them push on."""
STOP_SHARE = 0.5
"""How much of the needed change of speed a stop makes in one step: below 1, because felt inertia is an estimate."""


class DrivePath:
    """State and arithmetic of the drives of B robots with M motors each."""

    def __init__(self, robots: Sequence[Robot], time_step_s: float, gives: bool = True) -> None:
        """``gives``: whether the engine takes steep damping at the end of its step. Friction that counts on it where it is
        not so takes what the damping did for a load, rubs with it, and drives the joint."""
        self.dt, self.gives = time_step_s, gives
        shape = (len(robots), len(robots[0].drives))
        names = list(DRIVE_NUMBERS)
        rows = per_robot(robots, lambda r: np.array([[getattr(d, n) for n in names] for d in r.drives], dtype=float))
        table = np.array(rows).reshape(*shape, len(names))
        self.p = {n: np.ascontiguousarray(table[:, :, i]) for i, n in enumerate(names)}
        self.present = np.array(per_robot(robots, _present), dtype=bool).reshape(shape)
        p = self.p
        neutral = {f.name: f.default for f in fields(Drive)}
        self.uses = {n: bool(np.any(p[n] != neutral[n])) for n in names if isinstance(neutral[n], float)}
        kinds = per_robot(robots, lambda r: [COMMANDS.index(d.command) for d in r.drives])
        self.kind = np.array(kinds, dtype=np.intp).reshape(shape)
        # A current controller makes up for back-EMF.
        by_voltage = np.isfinite(p["speed_limit"]) & (self.kind <= SPEED)
        own_emf = np.divide(p["torque_limit"], p["speed_limit"], out=np.zeros(shape), where=by_voltage)
        integral_limit = np.divide(p["torque_limit"], p["ki"], out=np.zeros(shape), where=p["ki"] > 0) * 0.25
        derived = {"own_emf": own_emf, "integral_limit": integral_limit}
        self.motor = np.stack([derived[n] if n in derived else p[n] for n in MOTOR])
        self.shape, self.one = shape, np.ones(shape)
        self.integral = np.zeros(shape)
        self.before: Array | None = None
        """Commands (B, M) in the step before, by which a controller that goes along with their speed knows it."""
        self.still = np.zeros(shape)
        self.goals = Goals(p, self.kind == POSITION, self.kind == SPEED, self.dt)
        self.leads = self.goals.any
        self.governed = np.isfinite(p["command_speed"]) & (self.kind == TORQUE)
        self.uses_governor = bool(self.governed.any())
        self.sag = np.array([[r.world.supply_sag] for r in robots])
        self.uses_sag = bool(np.any(self.sag != 0))
        limited = np.isfinite(p["torque_limit"]) & (self.kind != NONE)
        self.all_torque = np.maximum(np.where(limited, p["torque_limit"], 0.0).sum(axis=1, keepdims=True), 1e-300)
        self.draws = self.present & (p["strength"] > 0)
        """Motors (B, M) that take current: not one that broke off with its part, nor one that is dead."""
        self.last_active = np.zeros(shape)
        self.current = np.zeros(shape)
        """Torque (B, M) that the current of each motor stands for in the last step, by its nominal constant: before a weak motor,
        the gear and any friction take their part of it."""
        self.delay = Delay(p["delay_s"], self.dt)
        self._prepare_joints(robots, shape)
        self._prepare_laws(robots)

    # -- preparation -------------------------------------------------------------------------------------------------

    def _prepare_joints(self, robots: Sequence[Robot], shape: tuple[int, int]) -> None:
        stops = np.array(per_robot(robots, lambda r: [r.joint(d.joint).ends for d in r.drives])).reshape(*shape, 2)
        self.lower, self.upper = np.ascontiguousarray(stops[:, :, 0]), np.ascontiguousarray(stops[:, :, 1])
        self.inertia = np.array(per_robot(robots, felt_inertia)).reshape(shape)
        self.give: Array | None = None
        """N.m.s/rad (B, M) by which the torque of the last step falls with speed, for the engine to take at the step's end."""
        self.stiff = self._stiff(robots, shape)
        self.transmission: Transmission | None = None
        self.friction: Friction | None = None
        self.at_stop = self.inertia
        frees = per_robot(robots, lambda r: [r.joint(d.joint).freedom for d in r.drives])
        jammed = np.array(frees, dtype=float).reshape(shape) != 1.0
        elastic, rubbing = Transmission.rows(self.p), Friction.rows(self.p)
        special = jammed | elastic | rubbing
        if not special.any():
            return
        some: NDArray[np.bool_] = np.any(special, axis=1)
        steady = self.inertia.copy()
        steady[some] = per_robot([r for r, wanted in zip(robots, some.tolist(), strict=True) if wanted], steady_inertia)
        # A jammed joint is at a stop all the time: the stop must not shake the joints that move with it.
        self.at_stop = np.where(jammed, steady, self.inertia)
        if elastic.any():
            self.transmission = Transmission(self.p, steady, self.dt)
        if rubbing.any():
            self.friction = Friction(self.p, self.uses, steady, self.dt)

    def _stiff(self, robots: Sequence[Robot], shape: tuple[int, int]) -> NDArray[np.bool_] | None:
        """Joints (B, M) whose controller is too steep for an explicit step; None where there are none, or it is all the same."""
        if not self.gives:
            return None
        stiff = np.array(per_robot(robots, stiff_joints), dtype=bool).reshape(shape)
        return stiff if stiff.any() else None

    def _prepare_laws(self, robots: Sequence[Robot]) -> None:
        groups: dict[tuple[str, tuple[str, ...]], list[tuple[int, int, tuple[float, ...]]]] = {}
        for i, robot in enumerate(robots):
            for law in robot.laws:
                key = (law.name, tuple(n for n, _ in law.values))
                place = robot.motor_names.index(law.joint)
                groups.setdefault(key, []).append((i, place, tuple(v for _, v in law.values)))
        self.laws: list[_Law] = []
        self.speeds: list[_Law] = []
        """Laws of torques, and of the speeds that controllers go by."""
        for (name, value_names), members in groups.items():
            values = {n: np.array([m[2][k] for m in members]) for k, n in enumerate(value_names)}
            rows, columns = np.array([m[0] for m in members]), np.array([m[1] for m in members])
            context = LawContext(values, self.dt, self.inertia[rows, columns])
            (self.speeds if name in SPEED_LAWS else self.laws).append((find_law(name), rows, columns, context))

    # -- one step ----------------------------------------------------------------------------------------------------

    def step(
        self,
        t_s: float,
        command: Array,
        q: Array,
        qd: Array,
        supply_v: Array | None = None,
        enabled: Array | None = None,
    ) -> Array:
        """Joint torques (B, M) from commands (of position, speed or torque), joint positions and speeds, all (B, M).

        ``supply_v`` (B, 1) is the measured supply. ``enabled``, (B, 1) or (B, M), is 0 where the motor's circuit is
        open: no torque and no back-EMF; what sits on the joint (friction, spring, stops) stays.
        """
        wanted = self._command(command)
        if self.leads:
            wanted = self.goals(wanted, q, enabled)
        position, speed = (q, qd) if self.transmission is None else self.transmission.motor_side(q, qd)
        for function, rows, columns, context in self.speeds:
            context.t_s = t_s
            context.position, context.speed = position[rows, columns], speed[rows, columns]
            speed = speed.copy()
            speed[rows, columns] = _given(function, context)
        ahead = self._ahead(wanted)
        active, stiffness, damping = self._motor(wanted, position, speed, ahead, supply_v, enabled)
        if self.transmission is not None:
            active = self.transmission(active, stiffness, damping, q, qd)
        self.give = None
        if self.stiff is not None:
            rigid = self.stiff if self.transmission is None else self.stiff & ~self.transmission.elastic
            self.give = np.where(rigid, damping, 0.0)
        torque = active
        if self.uses["spring"]:
            pulled = torque - self.p["spring"] * (q - self.p["spring_rest"])
            torque = np.where(self.p["spring"] != 0, pulled, torque)
        if self.uses["offset_torque"]:
            torque = np.where(self.p["offset_torque"] != 0, torque + self.p["offset_torque"], torque)
        for function, rows, columns, context in self.laws:
            context.t_s = t_s
            context.position, context.speed = q[rows, columns], qd[rows, columns]
            context.torque = torque[rows, columns]
            added = _given(function, context)
            torque = torque.copy()
            np.add.at(torque, (rows, columns), added)
        if self.friction is not None:
            torque = self.friction(torque, active, qd, enabled, self.give)
        # Every stage made a new array, so that this one may be written to.
        _stop(torque, q, qd, self.lower, self.upper, self.at_stop, self.present, self.dt)
        if self.friction is not None:
            self.friction.record(torque, qd, self.give)
        return torque

    def _command(self, command: Array) -> Array:
        if self.uses["delay_s"]:
            command = self.delay(command)
        if self.uses["command_gain"]:
            command = command * self.p["command_gain"]
        return command

    def _ahead(self, wanted: Array) -> Array:
        """(B, M) speeds at which controllers of positions take their joints to be wanted."""
        if not self.uses["feed_forward"]:
            return self.still
        before = wanted if self.before is None else self.before
        self.before = wanted.copy()
        return self.p["feed_forward"] * (wanted - before) / self.dt

    def _motor(
        self,
        wanted: Array,
        position: Array,
        speed: Array,
        ahead: Array,
        supply_v: Array | None,
        enabled: Array | None,
    ) -> tuple[Array, Array, Array]:
        """Torque of the motor, and how it falls with its position and speed: (B, M) each, the last two for an elastic
        transmission or a stiff controller only."""
        shape = self.shape
        scale, closed = self.one, self.one
        if supply_v is not None:
            nominal = self.p["supply_nominal_v"]
            scale = np.where(nominal > 0, supply_v / np.where(nominal > 0, nominal, 1.0), 1.0)
        if enabled is not None:
            closed = np.ascontiguousarray(np.broadcast_to(enabled, shape))
        left = self.one
        if self.uses_sag:
            drawn = np.where(self.draws, np.abs(self.last_active), 0.0)
            load = drawn.sum(axis=1, keepdims=True) / self.all_torque
            left = np.ascontiguousarray(np.broadcast_to(1.0 - np.clip(self.sag * load, 0.0, 0.95), shape))
        active = np.empty(shape)
        sloped = self.transmission is not None or self.stiff is not None
        stiffness, damping = (np.empty(shape), np.empty(shape)) if sloped else (active, active)
        _drive(
            self.kind, self.motor, wanted, position, speed, ahead, scale, closed, left, self.dt, sloped,
            self.integral, self.last_active, self.current, active, stiffness, damping,
        )  # fmt: skip
        if self.uses_governor:
            self._governed(speed, active, damping if sloped else None)
        if self.uses["back_emf"]:
            # Taken with the friction, at the end of the step; the current is less by it all the same.
            lost = self.p["back_emf"] * speed * closed
            self.current = np.where(self.p["back_emf"] != 0, self.current - lost, self.current)
        if self.uses["current_gain"]:
            self.current = self.current / self.p["current_gain"]
        return active, stiffness, damping

    def _governed(self, speed: Array, active: Array, damping: Array | None) -> None:
        """Near its top speed the controller of a torque lets less of it push on, and none beyond; what slows the joint down
        it lets through. Changes ``active``, and how that falls with speed, ``damping`` (all (B, M))."""
        top = np.where(self.governed, self.p["command_speed"], 1.0)
        width = (1.0 - GOVERNED) * top
        room = np.where(self.governed, np.clip((top - np.sign(active) * speed) / width, 0.0, 1.0), 1.0)
        if damping is not None:
            damping += np.where((room > 0) & (room < 1), np.abs(active) / width, 0.0)
        active *= room
        for taken in (self.last_active, self.current):
            taken *= room


MOTOR = ("kp", "ki", "kd", "zero_offset", "deadband", "torque_limit", "strength", "own_emf", "integral_limit")
"""Rows of the table that ``_drive`` reads, in this order."""
POSITION, SPEED, TORQUE, NONE = range(len(COMMANDS))
_Law = tuple[LawFunction, Array, Array, LawContext]
"""With the rows and columns of the joints (R,) that carry it."""


@compiled
def _drive(
    kind: NDArray[np.intp],
    motor: Array,
    wanted: Array,
    position: Array,
    speed: Array,
    ahead: Array,
    scale: Array,
    closed: Array,
    left: Array,
    dt: float,
    elastic: bool,
    integral: Array,
    last_active: Array,
    current: Array,
    active: Array,
    stiffness: Array,
    damping: Array,
) -> None:
    """Controller and motor of every joint. ``kind`` (B, M) is the place in COMMANDS, ``motor`` (len(MOTOR), B, M); the
    others (B, M), of which those from ``integral`` on are written.

    ``ahead`` is the speed that a controller of positions goes along with, ``scale`` the supply over the nominal one, ``closed``
    whether the circuit is, ``left`` what the sag leaves.
    """
    kp, ki, kd, zero_offset, deadband = motor[0], motor[1], motor[2], motor[3], motor[4]
    torque_limit, strength, own_emf, integral_limit = motor[5], motor[6], motor[7], motor[8]
    for i in range(active.shape[0]):
        for j in range(active.shape[1]):
            how = kind[i, j]
            stiff, damped, error = kp[i, j], kd[i, j], 0.0
            if how == POSITION:
                error = wanted[i, j] - position[i, j] - zero_offset[i, j]
                if deadband[i, j] > 0.0:
                    error = error - _within(error, deadband[i, j])
                asked = kp[i, j] * error - kd[i, j] * (speed[i, j] - ahead[i, j])
            elif how == SPEED:
                error = wanted[i, j] - speed[i, j]
                asked = kp[i, j] * error
                stiff, damped = 0.0, kp[i, j]
            else:
                asked = wanted[i, j] if how == TORQUE else 0.0
                stiff, damped = 0.0, 0.0
            if ki[i, j] != 0.0 and how <= SPEED:
                integral[i, j] = _within(integral[i, j] + error * dt, integral_limit[i, j]) * closed[i, j]
                asked = asked + ki[i, j] * integral[i, j]
            torque = _within(asked, torque_limit[i, j]) * scale[i, j] * closed[i, j]
            last_active[i, j] = torque
            back_emf = own_emf[i, j] * closed[i, j]
            current[i, j] = torque * left[i, j] - back_emf * speed[i, j]
            active[i, j] = current[i, j] * strength[i, j]
            if elastic:
                free = 1.0 if abs(asked) < torque_limit[i, j] else 0.0
                free = free * (scale[i, j] * left[i, j]) * closed[i, j]
                stiffness[i, j] = stiff * free * strength[i, j]
                damping[i, j] = (damped * free + back_emf) * strength[i, j]


@compiled
def _stop(
    torque: Array, q: Array, qd: Array, lower: Array, upper: Array, inertia: Array, present: Array, dt: float
) -> None:
    """Add the stops to ``torque`` (B, M): a joint that would pass its stop in this step is slowed to reach it, or sent
    back if it is past it already. A joint that is not ``present`` takes no torque."""
    for i in range(torque.shape[0]):
        for j in range(torque.shape[1]):
            value = torque[i, j]
            ahead = q[i, j] + qd[i, j] * dt
            scale = STOP_SHARE * inertia[i, j] / dt
            if ahead > upper[i, j]:
                over = max(value, 0.0) + scale * (qd[i, j] - STOP_SHARE * (upper[i, j] - q[i, j]) / dt)
                value = value - max(over, 0.0)
            elif ahead < lower[i, j]:
                under = min(value, 0.0) + scale * (qd[i, j] - STOP_SHARE * (lower[i, j] - q[i, j]) / dt)
                value = value - min(under, 0.0)
            torque[i, j] = value * present[i, j]


@compiled
def _within(value: float, limit: float) -> float:
    """Value within +-limit; not a number stays so."""
    if value > limit:
        return limit
    return -limit if value < -limit else value


def stiff_joints(robot: Robot) -> NDArray[np.bool_]:
    """(M,) whether the controller of a joint is too steep for an explicit step."""
    slopes = _slopes(robot)
    if not np.any(slopes > LOOK_SHARE * felt_inertia(robot)):
        return np.zeros(len(slopes), dtype=bool)
    found: NDArray[np.bool_] = slopes > STIFF_SHARE * steady_inertia(robot)
    return found


def hopeless_joints(robot: Robot) -> tuple[str, ...]:
    """Joints whose controller shakes them whatever the others do, in an engine that takes its damping at the start of a step."""
    beyond = _slopes(robot) > HOPELESS_SHARE * felt_inertia(robot)
    return tuple(name for name, b in zip(robot.motor_names, beyond.tolist(), strict=True) if b)


def _slopes(robot: Robot) -> Array:
    """(M,) N.m.s/rad of the controllers times the time step."""
    return np.array([{"position": d.kd, "speed": d.kp}.get(d.command, 0.0) for d in robot.drives]) * robot.time_step_s


def _present(robot: Robot) -> list[bool]:
    have = {j.name for j in robot.present_joints}
    return [d.joint in have for d in robot.drives]


def _given(law: LawFunction, context: LawContext) -> Array:
    """What a law of a user's own returns. Raises EngineError where it fails, or gives something else than a number a joint."""
    said = f"drive law {law.__name__} ({law.__module__.removeprefix('ee_dist_plugin_')})"
    try:
        given = law(context)
        found = np.asarray(given, dtype=np.float64)
    except (Exception, SystemExit) as error:
        raise EngineError(f"{said}: {type(error).__name__}: {' '.join(str(error).split())}") from error
    if given is None or found.shape not in ((), context.position.shape):
        what = "nothing" if given is None else f"an array of shape {found.shape}"
        raise EngineError(f"{said}: it gave {what}; expected a number for each of its {len(context.position)} joints")
    return found
