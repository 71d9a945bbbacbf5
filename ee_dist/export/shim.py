"""Drives and sensors of a robot for a simulation loop of your own: NumPy alone, one robot, one call a step.

    shim = Shim(PARAMETERS)
    every step:  torque = shim.torque(t_s, command, position, speed)    # (M,) N.m, one for each joint of shim.joints
                 reported = shim.read(true_values)                      # (S,) what the channels of shim.sensors report
                 force = shim.force(velocity)                           # (3,) N on the centre of the root part

``torque`` is that of motor, friction, springs and stops together: switch the simulator's own off for these joints. Positions and
speeds are rad and rad/s (m, m/s for a slide); rotor inertia is the simulator's to add (armature), and so is a joint damping of
``shim.native``, if any: that of controllers too steep for an explicit step, which the torque counts back.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]

STOP_SHARE, GOVERNED, SAME = 0.5, 0.9, 1e-9
LOAD_LIMIT, GEAR_LIMIT, LIGHTEST_ROTOR = 2.0, 3.0, 0.05
TOUCHING, LIFTED = 1.0, -1.0


class Delay:
    """Values as they were ``delay_s`` ago, each entry its own, straight lines between the steps."""

    def __init__(self, delay_s: Array, dt: float) -> None:
        steps = delay_s / dt
        self.whole = np.floor(steps + 1e-9).astype(int)
        self.part = np.clip(steps - self.whole, 0.0, 1.0)
        self.past: Any = None

    def __call__(self, value: Array) -> Array:
        if self.past is None:
            self.past = np.repeat(value[None], int(self.whole.max()) + 2, axis=0)
        self.past = np.roll(self.past, 1, axis=0)
        self.past[0] = value
        column = np.arange(len(value))
        near, far = self.past[self.whole, column], self.past[self.whole + 1, column]
        return np.where(self.part > 0, near * (1 - self.part) + far * self.part, near)


class Shim:
    """``p`` is a dictionary of plain lists, as the export writes it."""

    def __init__(self, p: Any) -> None:
        self.dt, self.joints, self.sensors = p["time_step_s"], p["joints"], p["sensors"]
        self.kinds, self.kind = np.array(p["commands"]), p["sensor_kinds"]
        self.d = {k: np.array(v, dtype=float) for k, v in p["drive"].items()}
        self.s = {k: np.array(v, dtype=float) for k, v in p["sensor"].items()}
        self.felt, self.steady = np.array(p["felt_inertia"]), np.array(p["steady_inertia"])
        self.lower, self.upper = np.array(p["stops"], dtype=float).reshape(-1, 2).T
        self.jammed, self.present = np.array(p["jammed"], dtype=bool), np.array(p["present"], dtype=bool)
        self.native = np.array(p["native_damping"], dtype=float)
        self.source, self.sag = np.array(p["source"], dtype=int), p["supply_sag"]
        self.push, self.drag = np.array(p["push_n"]), p["drag_n_s_m"]
        self.noise = np.random.default_rng(p.get("seed", 0))
        self.reset()

    def reset(self) -> None:
        """Forget what was: for a new run."""
        d, zero = self.d, np.zeros(len(self.joints))
        self.integral, self.last_active = zero.copy(), zero.copy()
        self.last_speed: Any = None
        self.last_torque = zero.copy()
        self.motor_at: Any = None
        self.goal: Any = None
        self.pace: Any = 0.0
        self.left, self.told = zero.copy(), np.full(len(self.joints), np.nan)
        self.before: Any = None
        self.side, self.carried, self.motor_speed = zero.copy(), zero.copy(), zero.copy()
        self.delay = Delay(d["delay_s"], self.dt) if d["delay_s"].any() else None
        self.late = Delay(self.s["delay_s"], self.dt) if self.s["delay_s"].any() else None
        self.pressed_s, self.row = np.zeros(len(self.sensors)), 0
        self.held: Any = None
        self.stuck_at = np.zeros(len(self.sensors))

    # -- drives --------------------------------------------------------------------------------------------------------

    def torque(
        self, t_s: float, command: Any, position: Any, speed: Any, supply_v: float | None = None, enabled: float = 1.0
    ) -> Array:
        """Torque (M,) at the joints from the controller's outputs (M,), positions and speeds (M,)."""
        d = self.d
        q, qd = np.asarray(position, dtype=float), np.asarray(speed, dtype=float)
        wanted = np.asarray(command, dtype=float)[self.source]
        if self.delay is not None:
            wanted = self.delay(wanted)
        wanted = self._limited(wanted * d["command_gain"], q, enabled)
        elastic = (d["backlash"] > 0) | (d["compliance"] > 0)
        at, turning = self._motor_side(q, qd, elastic)
        ahead = d["feed_forward"] * (wanted - (wanted if self.before is None else self.before)) / self.dt
        self.before = wanted
        active, stiffness, damping = self._motor(wanted, at, turning, ahead, supply_v, enabled)
        torque = np.where(elastic, self._through(active, stiffness, damping, q, qd), active)
        self.carried = np.where(d["compliance"] > 0, torque, 0.0)
        torque = torque - d["spring"] * (q - d["spring_rest"]) + d["offset_torque"]
        torque = self._friction(torque + self.native * qd, active, qd, enabled) - self.native * qd
        torque = self._stops(torque, q, qd)
        self.last_speed, self.last_torque = qd.copy(), torque.copy()
        return torque + self.native * qd

    def _limited(self, wanted: Array, q: Array, enabled: float) -> Array:
        """What the limits of the controllers let through: goals set out from where the joints stand."""
        top, by_position = self.d["command_speed"], self.kinds == "position"
        goal = self.goal if self.goal is not None and enabled > 0 else q
        wanted = self._in_time(wanted, goal, by_position, enabled)
        step = top * self.dt
        there = np.where(by_position, np.clip(wanted, goal - step, goal + step), np.clip(wanted, -top, top))
        eased = np.isfinite(self.d["command_acceleration"]) & by_position
        most = np.where(eased, self.d["command_acceleration"], 1.0)
        pace = self.pace if enabled > 0 else 0.0
        gap = np.abs(wanted - goal)
        aim = np.sign(wanted - goal) * np.minimum(np.sqrt(2.0 * most * gap), np.abs(there - goal) / self.dt)
        self.pace = np.clip(aim, pace - most * self.dt, pace + most * self.dt)
        self.goal = np.where(eased, goal + self.pace * self.dt, there)
        limited = eased | (np.isfinite(top) & (by_position | (self.kinds == "speed")))
        return np.where(limited, self.goal, wanted)

    def _in_time(self, wanted: Array, goal: Array, by_position: Array, enabled: float) -> Array:
        """Where goals go that take a set time to each that is new: evenly, and anew whenever it changes."""
        lasts = self.d["command_duration"]
        timed = (lasts > 0) & by_position
        anew = ~(np.abs(wanted - self.told) <= SAME) | (enabled <= 0)
        left, self.told = np.where(anew, lasts, self.left), np.where(anew, wanted, self.told)
        share = np.where(left > self.dt, self.dt / np.maximum(left, self.dt), 1.0)
        self.left = np.maximum(left - self.dt, 0.0)
        return np.where(timed & (left > self.dt), goal + (wanted - goal) * share, wanted)

    def _motor(
        self, wanted: Array, at: Array, turning: Array, ahead: Array, supply_v: float | None, enabled: float
    ) -> Any:
        d = self.d
        by_position, by_speed, by_torque = (self.kinds == k for k in ("position", "speed", "torque"))
        error = np.where(by_position, wanted - at - d["zero_offset"], np.where(by_speed, wanted - turning, 0.0))
        band = np.where(by_position, d["deadband"], 0.0)
        error = np.where(band > 0, error - np.clip(error, -band, band), error)
        asked = d["kp"] * error - np.where(by_position, d["kd"], 0.0) * (turning - ahead)
        asked = np.where(by_position | by_speed, asked, np.where(by_torque, wanted, 0.0))
        has = (d["ki"] != 0) & (by_position | by_speed)
        most = np.where(has, 0.25 * d["torque_limit"] / np.where(has, d["ki"], 1.0), 0.0)
        self.integral = np.where(has, np.clip(self.integral + error * self.dt, -most, most) * enabled, self.integral)
        asked = asked + np.where(has, d["ki"] * self.integral, 0.0)
        scale: Any = 1.0
        if supply_v is not None:
            nominal = d["supply_nominal_v"]
            scale = np.where(nominal > 0, supply_v / np.where(nominal > 0, nominal, 1.0), 1.0)
        given = np.clip(asked, -d["torque_limit"], d["torque_limit"]) * scale * enabled
        limited = np.isfinite(d["torque_limit"]) & (self.kinds != "none")
        draws = self.present & (d["strength"] > 0)
        load = np.where(draws, np.abs(self.last_active), 0.0).sum() / max(
            np.where(limited, d["torque_limit"], 0.0).sum(), 1e-300
        )
        left = 1.0 - min(max(self.sag * load, 0.0), 0.95)
        self.last_active = given
        voltage = np.isfinite(d["speed_limit"]) & (by_position | by_speed)
        emf = np.where(voltage, d["torque_limit"] / np.where(voltage, d["speed_limit"], 1.0), 0.0) * enabled
        free = (np.abs(asked) < d["torque_limit"]) * scale * left * enabled
        stiff, damped = (
            np.where(by_position, d["kp"], 0.0),
            np.where(by_position, d["kd"], np.where(by_speed, d["kp"], 0.0)),
        )
        active = (given * left - emf * turning) * d["strength"]
        governed = np.isfinite(d["command_speed"]) & by_torque
        top = np.where(governed, d["command_speed"], 1.0)
        room = np.where(governed, np.clip((top - np.sign(active) * turning) / ((1 - GOVERNED) * top), 0.0, 1.0), 1.0)
        steep = np.where((room > 0) & (room < 1), np.abs(active) / ((1 - GOVERNED) * top), 0.0)
        self.last_active, active = given * room, active * room
        return active, stiff * free * d["strength"], (damped * free + emf) * d["strength"] + steep

    def _motor_side(self, q: Array, qd: Array, elastic: Array) -> Any:
        flying = (self.d["backlash"] > 0) & (self.side == 0)
        if self.motor_at is None:
            self.motor_at = q.copy()
        at = q + self.side * self.d["backlash"] / 2 + self.d["compliance"] * self.carried
        self.motor_at = np.where(elastic, np.where(flying, self.motor_at, at), q)
        self.motor_speed = np.where(flying, self.motor_speed, qd)
        return self.motor_at, self.motor_speed

    def _through(self, active: Array, stiffness: Array, damping: Array, q: Array, qd: Array) -> Array:
        """Torque that play and twist let through."""
        d, dt, play = self.d, self.dt, self.d["backlash"] / 2
        give = (stiffness + damping / dt) * d["compliance"]
        torque = (active + give * self.carried) / (1.0 + give)
        loose = play > 0
        rotor = np.maximum(d["rotor_inertia"], LIGHTEST_ROTOR * self.steady)
        speed = self.motor_speed + dt * active / (rotor + dt * damping + dt * dt * stiffness)
        position = self.motor_at + dt * speed
        beyond = position - (q + dt * qd)
        side = np.where(np.abs(beyond) > play, np.sign(beyond), 0.0)
        brought = np.minimum(rotor, self.steady) * (self.motor_speed - qd) / dt
        pressed = np.maximum(side * (torque + brought), 0.0) * side
        self.side = np.where(loose, side, 0.0)
        flying = loose & (side == 0)
        self.motor_at = np.where(flying, position, self.motor_at)
        self.motor_speed = np.where(flying, speed, self.motor_speed)
        return np.where(loose, pressed, torque)

    def _friction(self, torque: Array, motor: Array, speed: Array, enabled: float) -> Array:
        """Friction stops a motion and never reverses it: it works against the momentum of the step."""
        d, per_step = self.d, self.steady / self.dt
        names = ("coulomb", "brake", "stribeck", "load_friction", "backdrive_friction", "quadratic_friction", "stribeck_load",
                 "friction_asymmetry", "viscous_asymmetry", "viscous", "back_emf")  # fmt: skip
        rubbing = np.any([d[n] != 0 for n in names], axis=0)
        load = np.zeros_like(torque)
        if self.last_speed is not None:
            load = (per_step + self.native) * (speed - self.last_speed) - self.last_torque
        most_gear = GEAR_LIMIT * d["torque_limit"]
        external = np.clip(torque - self.native * speed - motor + load, -most_gear, most_gear)
        through = np.abs(motor - external)
        fading, of_load = (np.exp(-np.abs(speed) / d[n]) for n in ("stribeck_speed", "stribeck_load_speed"))
        backward = np.maximum(d["load_friction"] + d["backdrive_friction"], 0.0)
        limit = d["coulomb"] + d["brake"] + d["stribeck"] * fading
        limit = limit + np.abs(d["load_friction"] * motor - backward * external)
        limit = limit + d["quadratic_friction"] * through**2 + d["stribeck_load"] * of_load * through
        up, down = (np.maximum(limit + side * d["friction_asymmetry"], 0.0) for side in (1.0, -1.0))
        viscous = d["viscous"] + d["back_emf"] * d["strength"] * enabled
        steepest = viscous + np.abs(d["viscous_asymmetry"])
        most = np.abs(torque) + LOAD_LIMIT * (np.maximum(up, down) + steepest * np.abs(speed))
        rate = per_step * speed + torque + np.clip(load, -most, most)
        dry = np.clip(rate, -down, up)
        left = rate - dry
        viscous = np.maximum(viscous + d["viscous_asymmetry"] * np.sign(left), 0.0)
        taken = dry + left * viscous / (per_step + self.native + viscous)
        return np.where(rubbing, torque - taken, torque)

    def _stops(self, torque: Array, q: Array, qd: Array) -> Array:
        ahead, inertia = q + qd * self.dt, np.where(self.jammed, self.steady, self.felt)
        scale = STOP_SHARE * inertia / self.dt
        over = np.maximum(torque, 0.0) + scale * (qd - STOP_SHARE * (self.upper - q) / self.dt)
        under = np.minimum(torque, 0.0) + scale * (qd - STOP_SHARE * (self.lower - q) / self.dt)
        torque = np.where(ahead > self.upper, torque - np.maximum(over, 0.0), torque)
        torque = np.where((ahead < self.lower) & (ahead <= self.upper), torque - np.minimum(under, 0.0), torque)
        return np.where(self.present, torque, 0.0)

    # -- surroundings and sensors --------------------------------------------------------------------------------------

    def force(self, velocity: Any) -> Array:
        """Force (3,) N of push and drag on the root part from its velocity (3,) m/s, both in the frame of the floor."""
        return self.push - self.drag * np.asarray(velocity, dtype=float)

    def read(self, true: Any) -> Array:
        """What the channels (S,) report of true values (S,); a touch is 1, a lifted foot -1. Once a step."""
        s, value = self.s, np.asarray(true, dtype=float)
        down = (np.array(self.kind) == "touch") & (value > 0)
        self.pressed_s = np.where(down, self.pressed_s + self.dt, 0.0)
        value = np.where(down & (s["missed_touch"] > 0) & (self.pressed_s <= s["missed_touch"] + 1e-9), LIFTED, value)
        value = value * s["gain"] + s["bias"]
        if self.late is not None:
            value = self.late(value)
        value = value + s["noise"] * self.noise.standard_normal(len(value))
        if s["dropout"].any():
            if self.held is not None:
                value = np.where(self.noise.random(len(value)) < s["dropout"], self.held, value)
            self.held = value
        step = np.where(s["quantum"] > 0, s["quantum"], 1.0)
        value = np.where(s["quantum"] > 0, np.round(value / step) * step, value)
        waiting = self.row * self.dt < s["stuck_from_s"] - 1e-9
        self.stuck_at = value if self.row == 0 else np.where(waiting, value, self.stuck_at)
        slow = self.stuck_at + (1.0 - s["stuck"]) * (value - self.stuck_at)
        self.row += 1
        return np.where((s["stuck"] > 0) & ~waiting, slow, value)
