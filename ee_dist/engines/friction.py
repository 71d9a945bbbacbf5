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
                + stribeck * exp(-|speed| / stribeck_speed)
                + ks*|tm - te| * exp(-|speed| / stribeck_load_speed) +- asymmetry

with tm the motor's torque and te the external torque on the joint, so that |tm - te| goes through the gear; km is
load_friction and ke = km + backdrive_friction (Duclusaud et al. 2025, "Extended Friction Models for the Physics
Simulation of Servo Actuators").
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ee_dist.engines.compiled import compiled
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
        self.rubbing = self.rows(p)
        self.none, self.one = np.zeros(inertia.shape), np.ones(inertia.shape)
        derived = {
            "most_gear": GEAR_LIMIT * p["torque_limit"],
            "electric": p["back_emf"] * p["strength"],
            "backdriving": np.maximum(p["load_friction"] + p["backdrive_friction"], 0.0),
            "dry": p["coulomb"] + p["brake"],
        }
        self.table = np.stack([derived[n] if n in derived else p[n] for n in RUBBING])
        self.last: tuple[Array, Array, Array | None] | None = None
        """Speed, torque and give of the last step."""

    @staticmethod
    def rows(p: Mapping[str, Array]) -> NDArray[np.bool_]:
        """Joints (B, M) that have any friction."""
        return np.logical_or.reduce([p[name] != 0 for name in (*DRY, *LOADED, *SIDED, *SLOPED)])

    def __call__(
        self, torque: Array, motor: Array, speed: Array, enabled: Array | None = None, give: Array | None = None
    ) -> Array:
        """Torque at the joint less friction, from torque at the joint, torque of the motor, speed: all (B, M).
        Friction of a single robot takes those of many instants.

        ``give`` (B, M) is by how much the torque falls with the speed at the end of the step, where the engine takes it so.

        A back-EMF beyond the model's own is viscous friction that is gone when the drive is not ``enabled``: as part of
        the motor's explicit torque it could be too steep for the time step.
        """
        p, uses, shape = self.p, self.uses, torque.shape
        none, one = (np.full(shape, v) for v in (0.0, 1.0)) if shape != self.none.shape else (self.none, self.one)
        # NumPy's own exponential: a compiled one may differ in its last bit.
        fading = np.exp(-np.abs(speed) / p["stribeck_speed"]) if uses["stribeck"] else none
        of_load = np.exp(-np.abs(speed) / p["stribeck_load_speed"]) if uses["stribeck_load"] else none
        last_speed, last_torque, last_give = self.last or (none, none, None)
        found = np.empty(shape)
        _rub(
            self.table, self.per_step, self.rubbing, self.loaded, torque, motor, speed, fading, of_load,
            one if enabled is None else np.ascontiguousarray(np.broadcast_to(enabled, shape)),
            none if give is None else give, last_speed, last_torque, none if last_give is None else last_give,
            self.last is not None, found,
        )  # fmt: skip
        return found

    def record(self, torque: Array, speed: Array, give: Array | None = None) -> None:
        """Remember the torque that the step is made with."""
        self.last = speed, torque, give


RUBBING = (
    "dry", "stribeck", "load_friction", "backdriving", "quadratic_friction", "stribeck_load", "friction_asymmetry",
    "viscous", "electric", "viscous_asymmetry", "most_gear",
)  # fmt: skip
"""Rows of the table that ``_rub`` reads, in this order."""


@compiled
def _rub(
    table: Array,
    per_step: Array,
    rubbing: NDArray[np.bool_],
    loaded: bool,
    torque: Array,
    motor: Array,
    speed: Array,
    fading: Array,
    of_load: Array,
    enabled: Array,
    give: Array,
    last_speed: Array,
    last_torque: Array,
    last_give: Array,
    begun: bool,
    found: Array,
) -> None:
    """Write to ``found`` (B, M) the torque less friction. ``table`` is (len(RUBBING), B, M), ``fading`` and ``of_load`` the
    shares of Stribeck friction, plain and by load, that the speed leaves; others (B, M) as in ``Friction.__call__``. What
    belongs to the robots (``table``, ``per_step``, ``rubbing``) may have a single row for all."""
    one = table.shape[1] == 1
    for i in range(found.shape[0]):
        r = 0 if one else i
        for j in range(found.shape[1]):
            asked = torque[i, j] + give[i, j] * speed[i, j]
            if not rubbing[r, j]:
                found[i, j] = asked - give[i, j] * speed[i, j]
                continue
            dry, stribeck, driving, backdriving, quadratic = table[:5, r, j]
            stribeck_load, sided, viscous, electric, viscous_sided = table[5:10, r, j]
            load = 0.0
            if begun:
                load = (per_step[r, j] + last_give[i, j]) * (speed[i, j] - last_speed[i, j]) - last_torque[i, j]
            limit = dry + stribeck * fading[i, j]
            if loaded:
                external = _between(torque[i, j] - motor[i, j] + load, -table[10, r, j], table[10, r, j])
                limit = limit + abs(driving * motor[i, j] - backdriving * external)
                through = abs(motor[i, j] - external)
                limit = limit + quadratic * (through * through)
                limit = limit + stribeck_load * of_load[i, j] * through
            up, down = max(limit + sided, 0.0), max(limit - sided, 0.0)
            viscous = viscous + electric * enabled[i, j]
            steepest = viscous + abs(viscous_sided)
            most = abs(asked) + LOAD_LIMIT * (max(up, down) + steepest * abs(speed[i, j]))
            rate = per_step[r, j] * speed[i, j] + asked + _between(load, -most, most)
            taken = _between(rate, -down, up)
            left = rate - taken
            if viscous_sided != 0.0:
                viscous = max(viscous + viscous_sided * np.sign(left), 0.0)
            taken = taken + left * viscous / (per_step[r, j] + give[i, j] + viscous)
            found[i, j] = asked - taken - give[i, j] * speed[i, j]


@compiled
def _between(value: float, low: float, high: float) -> float:
    """Value within [low, high]; not a number stays so."""
    if value < low:
        return low
    return high if value > high else value
