"""Between motor and joint: play (backlash) and twist (compliance), with the position sensor on the motor's side.

Where motor and joint touch, they move as one: the rotor's inertia is part of the joint's in every engine, and the
torque goes through as it is. When the motor would have to pull, it lets go and flies through the play with its own
inertia until it meets a side; the momentum that it brings along is handed over in that step, as far as the joint can
take it without running ahead of the motor. Nothing penetrates, so the result stays finite at any play and any time step,
and goes over to the rigid drive as the play goes to zero.

A twist is compliance times the torque carried. The motor is where the joint is plus that twist, and the torque follows
what the controller asks there through the motor's own damping; as the compliance goes to zero, this is the rigid drive.
The rotor does not swing against the joint: its inertia stays with the joint.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ee_dist.trials.log import Array

LIGHTEST_ROTOR = 0.05
"""Least inertia of a rotor in the play, as a share of the joint's: a robot may state none."""


class Transmission:
    """State and arithmetic of the transmissions of B robots with M joints. ``p`` are the drives' fields, each (B, M)."""

    def __init__(self, p: Mapping[str, Array], inertia: Array, dt: float) -> None:
        self.dt = dt
        self.play = p["backlash"] / 2
        self.compliance = p["compliance"]
        self.loose = self.play > 0
        self.elastic = self.rows(p)
        self.rotor = np.maximum(p["rotor_inertia"], LIGHTEST_ROTOR * inertia)
        self.landing = np.minimum(self.rotor, inertia)
        self.side = np.zeros(inertia.shape)
        """Where the motor presses: on the upper (1) or lower (-1) side of the play, or nowhere (0)."""
        self.position: Array | None = None
        self.speed = np.zeros(inertia.shape)
        self.carried = np.zeros(inertia.shape)

    @staticmethod
    def rows(p: Mapping[str, Array]) -> NDArray[np.bool_]:
        """Joints (B, M) with play or twist."""
        return (p["backlash"] > 0) | (p["compliance"] > 0)

    def motor_side(self, q: Array, qd: Array) -> tuple[Array, Array]:
        """Position and speed of the motor (B, M), in units of the joint."""
        flying = self.loose & (self.side == 0)
        if self.position is None:
            self.position = q
        at = q + self.side * self.play + self.compliance * self.carried
        self.position = np.where(self.elastic, np.where(flying, self.position, at), q)
        self.speed = np.where(flying, self.speed, qd)
        return self.position, self.speed

    def __call__(self, active: Array, stiffness: Array, damping: Array, q: Array, qd: Array) -> Array:
        """Torque at the joint from the motor's torque and how that falls with the motor's position and speed."""
        assert self.position is not None
        dt = self.dt
        give = (stiffness + damping / dt) * self.compliance
        torque = (active + give * self.carried) / (1.0 + give)
        if self.loose.any():
            speed = self.speed + dt * active / (self.rotor + dt * damping + dt * dt * stiffness)
            position = self.position + dt * speed
            beyond = position - (q + dt * qd)
            side = np.where(np.abs(beyond) > self.play, np.sign(beyond), 0.0)
            brought = self.landing * (self.speed - qd) / dt
            pressed = np.maximum(side * (torque + brought), 0.0) * side
            torque = np.where(self.loose, pressed, torque)
            self.side = np.where(self.loose, side, 0.0)
            flying = self.loose & (side == 0)
            self.position = np.where(flying, position, self.position)
            self.speed = np.where(flying, speed, self.speed)
        torque = np.where(self.elastic, torque, active)
        self.carried = np.where(self.compliance > 0, torque, 0.0)
        return torque
