"""The drive path: from commanded position to joint torque, for a whole batch at once and the same for every engine.

    command -> delay -> gain -> controller (deadband, zero offset) -> motor (torque limit, back-EMF, strength, supply)
            -> transmission (backlash, compliance) -> joint (spring, offset, friction, brake, a user's own laws, stops)

Each stage runs only if some row of the batch needs it, and a row at neutral values passes through it unchanged, bit
for bit, so a result never depends on what else is in the batch.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import fields

import numpy as np

from ee_dist.robots.inertia import felt_inertia
from ee_dist.robots.model import Drive, Robot
from ee_dist.trials.log import Array

LawFunction = Callable[["LawContext"], Array]


class LawContext:
    """What a user's own law sees: arrays over the rows (R,) that carry it, and ``memory`` that lasts for the rollout."""

    def __init__(self, values: dict[str, Array], time_step_s: float) -> None:
        self.values = values
        self.time_step_s = time_step_s
        self.memory: dict[str, Array] = {}
        self.t_s = 0.0
        self.position: Array = np.zeros(0)
        self.speed: Array = np.zeros(0)
        self.torque: Array = np.zeros(0)


LAWS: dict[str, LawFunction] = {}
"""A user's own terms of the drive path by name: each returns the torque (R,) to add at the joint."""

STOP_SHARE = 0.5
"""How much of the needed change of speed a stop makes in one step: below 1, because felt inertia is an estimate."""
FRICTION = ("coulomb", "stribeck", "load_friction", "backdrive_friction", "brake")


class DrivePath:
    """State and arithmetic of the drives of B robots with M motors each."""

    def __init__(self, robots: Sequence[Robot], time_step_s: float) -> None:
        self.dt = time_step_s
        shape = (len(robots), len(robots[0].drives))
        names = [f.name for f in fields(Drive) if f.name != "joint"]
        table = np.array([[[getattr(d, n) for n in names] for d in r.drives] for r in robots], dtype=float)
        table = table.reshape(*shape, len(names))
        self.p = {n: np.ascontiguousarray(table[:, :, i]) for i, n in enumerate(names)}
        present = [{j.name for j in r.present_joints} for r in robots]
        self.present = np.array([[d.joint in have for d in r.drives] for r, have in zip(robots, present, strict=True)])
        p = self.p
        neutral = {f.name: f.default for f in fields(Drive)}
        self.uses = {n: bool(np.any(p[n] != neutral[n])) for n in names if isinstance(neutral[n], float)}
        self.back_emf = np.where(np.isfinite(p["speed_limit"]), p["torque_limit"] / p["speed_limit"], 0.0)
        self.integral = np.zeros(shape)
        self.uses_integral = bool(np.any(p["ki"] != 0))
        self.integral_limit = np.divide(p["torque_limit"], p["ki"], out=np.zeros(shape), where=p["ki"] > 0) * 0.25
        self.sag = np.array([[r.world.supply_sag] for r in robots])
        self.uses_sag = bool(np.any(self.sag != 0))
        self.last_active = np.zeros(shape)
        self._prepare_delay(shape)
        self._prepare_transmission()
        self._prepare_joints(robots, shape)
        self._prepare_laws(robots)

    # -- preparation -------------------------------------------------------------------------------------------------

    def _prepare_delay(self, shape: tuple[int, int]) -> None:
        if not self.uses["delay_s"]:
            return
        steps = self.p["delay_s"] / self.dt
        self.delay_whole = np.floor(steps + 1e-9).astype(int)
        self.delay_part = np.clip(steps - self.delay_whole, 0.0, 1.0)
        self.past: Array = np.zeros((int(self.delay_whole.max()) + 2, *shape))
        self.past_filled = False
        self.rows, self.columns = np.indices(shape)

    def _prepare_transmission(self) -> None:
        self.elastic = (self.p["compliance"] > 0) | (self.p["backlash"] > 0)
        self.uses_elastic = bool(self.elastic.any())
        self.motor_position: Array | None = None

    def _prepare_joints(self, robots: Sequence[Robot], shape: tuple[int, int]) -> None:
        self.uses_friction = any(self.uses[n] for n in FRICTION)
        self.uses_load = self.uses["load_friction"] or self.uses["backdrive_friction"]
        stops = np.array([[r.joint(d.joint).stops for d in r.drives] for r in robots]).reshape(*shape, 2)
        self.lower, self.upper = np.ascontiguousarray(stops[:, :, 0]), np.ascontiguousarray(stops[:, :, 1])
        felt = {id(robot): felt_inertia(robot) for robot in {id(r): r for r in robots}.values()}
        self.inertia = np.array([felt[id(robot)] for robot in robots]).reshape(shape)
        self.last_speed: Array | None = None
        self.last_total = np.zeros(shape)

    def _prepare_laws(self, robots: Sequence[Robot]) -> None:
        groups: dict[tuple[str, tuple[str, ...]], list[tuple[int, int, tuple[float, ...]]]] = {}
        for i, robot in enumerate(robots):
            for law in robot.laws:
                key = (law.name, tuple(n for n, _ in law.values))
                groups.setdefault(key, []).append(
                    (i, robot.motor_names.index(law.joint), tuple(v for _, v in law.values))
                )
        self.laws: list[tuple[LawFunction, Array, Array, LawContext]] = []
        for (name, value_names), members in groups.items():
            if name not in LAWS:
                raise KeyError(f"no drive law named {name!r}; there are: {', '.join(sorted(LAWS)) or 'none'}")
            values = {n: np.array([m[2][k] for m in members]) for k, n in enumerate(value_names)}
            rows, columns = np.array([m[0] for m in members]), np.array([m[1] for m in members])
            self.laws.append((LAWS[name], rows, columns, LawContext(values, self.dt)))

    # -- one step ----------------------------------------------------------------------------------------------------

    def step(self, t_s: float, command: Array, q: Array, qd: Array, supply_v: Array | None = None) -> Array:
        """Joint torques (B, M) from commanded positions, joint positions and speeds, all (B, M); supply_v is (B, 1)."""
        wanted = self._command(command)
        position, speed = (q, qd) if not self.uses_elastic else self._motor_side(q, qd)
        active = self._motor(wanted, position, speed, supply_v)
        torque = active if not self.uses_elastic else self._transmission(active, q, qd)
        if self.uses["spring"]:
            torque = torque - self.p["spring"] * (q - self.p["spring_rest"])
        if self.uses["offset_torque"]:
            torque = torque + self.p["offset_torque"]
        for function, rows, columns, context in self.laws:
            context.t_s = t_s
            context.position, context.speed = q[rows, columns], qd[rows, columns]
            context.torque = torque[rows, columns]
            added = function(context)
            torque = torque.copy()
            np.add.at(torque, (rows, columns), added)
        if self.uses["viscous"]:
            viscous = self.p["viscous"]
            if self.uses["viscous_asymmetry"]:
                viscous = viscous * (1.0 + self.p["viscous_asymmetry"] * np.sign(qd))
            torque = torque - viscous * qd / (1.0 + viscous * self.dt / self.inertia)
        if self.uses_friction:
            torque = self._friction(torque, active, qd)
        return self._stops(torque, q, qd) * self.present

    def _command(self, command: Array) -> Array:
        if self.uses["delay_s"]:
            if not self.past_filled:
                self.past[:] = command
                self.past_filled = True
            self.past = np.roll(self.past, 1, axis=0)
            self.past[0] = command
            near = self.past[self.delay_whole, self.rows, self.columns]
            far = self.past[self.delay_whole + 1, self.rows, self.columns]
            command = np.where(self.delay_part > 0, near * (1 - self.delay_part) + far * self.delay_part, near)
        if self.uses["command_gain"]:
            command = command * self.p["command_gain"]
        return command

    def _motor(self, wanted: Array, position: Array, speed: Array, supply_v: Array | None) -> Array:
        p = self.p
        error = wanted - position
        if self.uses["zero_offset"]:
            error = error - p["zero_offset"]
        if self.uses["deadband"]:
            error = error - np.clip(error, -p["deadband"], p["deadband"])
        asked = p["kp"] * error - p["kd"] * speed
        if self.uses_integral:
            self.integral = np.clip(self.integral + error * self.dt, -self.integral_limit, self.integral_limit)
            asked = asked + p["ki"] * self.integral
        active = np.clip(asked, -p["torque_limit"], p["torque_limit"])
        if supply_v is not None:
            nominal = p["supply_nominal_v"]
            active = active * np.where(nominal > 0, supply_v / np.where(nominal > 0, nominal, 1.0), 1.0)
        if self.uses_sag:
            load = np.abs(self.last_active).sum(axis=1, keepdims=True) / p["torque_limit"].sum(axis=1, keepdims=True)
            self.last_active = active
            active = active * (1.0 - np.clip(self.sag * load, 0.0, 0.95))
        active = active - self.back_emf * speed
        if self.uses["strength"]:
            active = active * p["strength"]
        return active

    def _motor_side(self, q: Array, qd: Array) -> tuple[Array, Array]:
        if self.motor_position is None:
            self.motor_position, self.motor_speed = q.copy(), qd.copy()
        return np.where(self.elastic, self.motor_position, q), np.where(self.elastic, self.motor_speed, qd)

    def _transmission(self, active: Array, q: Array, qd: Array) -> Array:
        """Motor behind a spring with play. The rotor's own step is implicit in the spring, so that a stiff one is stable.

        The spring is at most as stiff as the joint's inertia can answer within a time step.
        """
        assert self.motor_position is not None
        p, dt = self.p, self.dt
        rotor = np.maximum(p["rotor_inertia"], 0.1 * self.inertia)
        stiffest = 0.25 * self.inertia / dt**2
        compliance = p["compliance"]
        stiffness = np.minimum(
            np.divide(1.0, compliance, out=np.full_like(compliance, np.inf), where=compliance > 0), stiffest
        )
        damping = 0.2 * np.sqrt(stiffness * np.minimum(self.inertia, rotor))
        play = p["backlash"] / 2
        ahead = q + dt * qd
        free = self.motor_position + dt * (self.motor_speed + dt * active / rotor)
        twist = free - ahead
        beyond = twist - np.clip(twist, -play, play)
        touching = beyond != 0
        k = np.where(touching, stiffness, 0.0)
        c = np.where(touching, damping, 0.0)
        edge = np.clip(twist, -play, play)
        # rotor * (v' - v) / dt = active - k (x + dt v' - ahead - edge) - c (v' - qd)
        v = (rotor * self.motor_speed / dt + active - k * (self.motor_position - ahead - edge) + c * qd) / (
            rotor / dt + k * dt + c
        )
        x = self.motor_position + dt * v
        carried = k * (x - ahead - edge) + c * (v - qd)
        self.motor_position = np.where(self.elastic, x, q)
        self.motor_speed = np.where(self.elastic, v, qd)
        return np.where(self.elastic, carried, active)

    def _friction(self, torque: Array, active: Array, qd: Array) -> Array:
        """Dry friction cancels at most what would keep the joint moving in this step, so it never reverses a motion.

        The load from the rest of the robot is what the last step's motion needed beyond the last torque (a disturbance
        observer): it lets a joint at rest stay at rest under load.
        """
        p = self.p
        load = 0.0 if self.last_speed is None else self.inertia * (qd - self.last_speed) / self.dt - self.last_total
        capacity = p["coulomb"] + p["brake"]
        if self.uses["stribeck"]:
            capacity = capacity + p["stribeck"] * np.exp(-((qd / p["stribeck_speed"]) ** 2))
        if self.uses_load:
            # Driving: the motor's torque presses on the gear; back-driving: the load does.
            capacity = capacity + p["load_friction"] * np.abs(active) + p["backdrive_friction"] * np.abs(load)
        if self.uses["friction_asymmetry"]:
            capacity = capacity * (1.0 + p["friction_asymmetry"] * np.sign(qd))
        stopping = self.inertia * qd / self.dt + torque + load
        torque = torque - np.clip(stopping, -capacity, capacity)
        self.last_speed, self.last_total = qd, torque
        return torque

    def _stops(self, torque: Array, q: Array, qd: Array) -> Array:
        """A joint that would pass its stop in this step is slowed to reach it, or sent back if it is past it already."""
        dt = self.dt
        ahead = q + qd * dt
        past_upper, past_lower = ahead > self.upper, ahead < self.lower
        if not (past_upper | past_lower).any():
            return torque
        scale = STOP_SHARE * self.inertia / dt
        highest, lowest = STOP_SHARE * (self.upper - q) / dt, STOP_SHARE * (self.lower - q) / dt
        over = np.where(past_upper, np.maximum(np.maximum(torque, 0.0) + scale * (qd - highest), 0.0), 0.0)
        under = np.where(past_lower, np.minimum(np.minimum(torque, 0.0) + scale * (qd - lowest), 0.0), 0.0)
        return torque - over - under
