"""Friction at a fixed time step: dry, viscous and load-dependent, for all joints of a batch at once.

A step is implicit. With p = inertia * speed / dt + (all other torque), the momentum rate that friction works against,
dry friction takes min(|p|, limit) of it and viscous friction its share of what is left. So friction stops a motion and
never reverses it, holds a joint at rest under load, and a sliding joint feels exactly the limit.

The other torque includes the load that the rest of the robot puts on the joint. No engine reports it: it is what the
last step's change of speed needed beyond the last torque. Where the joint is heavier than thought (a leg that stands),
this reads part of our own torque back as load, which is what makes it stop at the right moment all the same. Stopping
all joints of a robot at once by this rule is stable as long as no combination of joints is lighter than 3/4 of the
inertia assumed; ``steady_inertia`` assumes one below the lightest. An impact is over when it shows in the load: the load
counts only as far as friction could need it, so that a wrong one cannot push a moving joint along.

    dry limit = coulomb + brake + |km*tm - ke*te| + kq*(tm - te)^2
                + (stribeck + ks*|tm - te|) * exp(-|speed| / stribeck_speed) +- asymmetry

with tm the motor's torque and te the external torque on the joint, so that |tm - te| goes through the gear; km is
load_friction and ke = km + backdrive_friction (Duclusaud et al. 2025, "Extended Friction Models for the Physics
Simulation of Servo Actuators").
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ee_dist.trials.log import Array

LOAD_LIMIT = 2.0
"""How much load counts at most beyond our own torque, over the friction at hand. Holding and sliding evenly need 1."""
GEAR_LIMIT = 3.0
"""Torque through the gear counts up to this multiple of the motor's: more would break the gear, and is an impact."""
DRY = ("coulomb", "brake", "stribeck")
LOADED = ("load_friction", "backdrive_friction", "quadratic_friction", "stribeck_load")
SIDED = ("friction_asymmetry", "viscous_asymmetry")
SLOPED = ("viscous", "back_emf")


class Friction:
    """State and arithmetic of the friction of B robots with M joints. ``p`` are the drives' fields, each (B, M)."""

    def __init__(self, p: Mapping[str, Array], uses: Mapping[str, bool], inertia: Array, dt: float) -> None:
        self.p, self.uses = p, uses
        self.per_step = inertia / dt
        self.loaded = any(uses[n] for n in LOADED)
        self.most_gear = GEAR_LIMIT * p["torque_limit"]
        self.rubbing = self.rows(p)
        self.electric = p["back_emf"] * p["strength"]
        self.uses_viscous = any(uses[n] for n in (*SLOPED, "viscous_asymmetry"))
        self.backdriving = np.maximum(p["load_friction"] + p["backdrive_friction"], 0.0)
        self.last_speed: Array | None = None
        self.last_torque = np.zeros(inertia.shape)
        self.last_give: Array | None = None

    @staticmethod
    def rows(p: Mapping[str, Array]) -> NDArray[np.bool_]:
        """Joints (B, M) that have any friction."""
        return np.logical_or.reduce([p[name] != 0 for name in (*DRY, *LOADED, *SIDED, *SLOPED)])

    def __call__(
        self, torque: Array, motor: Array, speed: Array, enabled: Array | None = None, give: Array | None = None
    ) -> Array:
        """Torque at the joint less friction, from torque at the joint, torque of the motor, speed: all (B, M).

        ``give`` (B, M) is by how much the torque falls with the speed at the end of the step, where the engine takes it so.

        A back-EMF beyond the model's own is viscous friction that is gone when the drive is not ``enabled``: as part of
        the motor's explicit torque it could be too steep for the time step.
        """
        p, uses = self.p, self.uses
        load: Array = np.zeros_like(torque)
        if self.last_speed is not None:
            heavier = self.per_step if self.last_give is None else self.per_step + self.last_give
            load = heavier * (speed - self.last_speed) - self.last_torque
        if give is not None:
            torque = torque + give * speed
        limit = self._limit(motor, torque - motor + load, speed)
        up = down = limit
        if uses["friction_asymmetry"]:
            up = np.maximum(limit + p["friction_asymmetry"], 0.0)
            down = np.maximum(limit - p["friction_asymmetry"], 0.0)
        viscous = p["viscous"] + (self.electric if enabled is None else self.electric * enabled)
        steepest = viscous + np.abs(p["viscous_asymmetry"])
        most = np.abs(torque) + LOAD_LIMIT * (np.maximum(up, down) + steepest * np.abs(speed))
        rate = self.per_step * speed + torque + np.clip(load, -most, most)
        taken = dry = np.clip(rate, -down, up)
        if self.uses_viscous:
            left = rate - dry
            if uses["viscous_asymmetry"]:
                viscous = np.maximum(viscous + p["viscous_asymmetry"] * np.sign(left), 0.0)
            per_step = self.per_step if give is None else self.per_step + give
            taken = dry + left * viscous / (per_step + viscous)
        found = np.where(self.rubbing, torque - taken, torque)
        return found if give is None else found - give * speed

    def _limit(self, motor: Array, external: Array, speed: Array) -> Array:
        p, uses = self.p, self.uses
        limit = p["coulomb"] + p["brake"]
        fading = np.exp(-np.abs(speed) / p["stribeck_speed"]) if uses["stribeck"] or uses["stribeck_load"] else None
        if uses["stribeck"]:
            limit = limit + p["stribeck"] * fading
        if self.loaded:
            external = np.clip(external, -self.most_gear, self.most_gear)
            limit = limit + np.abs(p["load_friction"] * motor - self.backdriving * external)
            through = np.abs(motor - external)
            if uses["quadratic_friction"]:
                limit = limit + p["quadratic_friction"] * through**2
            if uses["stribeck_load"]:
                limit = limit + p["stribeck_load"] * fading * through
        return limit

    def record(self, torque: Array, speed: Array, give: Array | None = None) -> None:
        """Remember the torque that the step is made with."""
        self.last_speed, self.last_torque, self.last_give = speed, torque, give
