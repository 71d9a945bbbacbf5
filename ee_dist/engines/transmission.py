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

from ee_dist.engines.compiled import compiled
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
        """Of the motor (B, M), in units of the joint; with it before the first step."""
        self.speed = np.zeros(inertia.shape)
        self.carried = np.zeros(inertia.shape)

    @staticmethod
    def rows(p: Mapping[str, Array]) -> NDArray[np.bool_]:
        """Joints (B, M) with play or twist."""
        return (p["backlash"] > 0) | (p["compliance"] > 0)

    def motor_side(self, q: Array, qd: Array) -> tuple[Array, Array]:
        """Position and speed of the motor (B, M), in units of the joint."""
        if self.position is None:
            self.position = q.copy()
        _follow(
            self.elastic,
            self.loose,
            self.side,
            self.play,
            self.compliance,
            self.carried,
            q,
            qd,
            self.position,
            self.speed,
        )
        return self.position, self.speed

    def __call__(self, active: Array, stiffness: Array, damping: Array, q: Array, qd: Array) -> Array:
        """Torque at the joint from the motor's torque and how that falls with the motor's position and speed."""
        assert self.position is not None
        found = np.empty(active.shape)
        _carry(
            self.elastic, self.loose, self.play, self.compliance, self.rotor, self.landing, self.dt,
            active, stiffness, damping, q, qd, self.side, self.position, self.speed, self.carried, found,
        )  # fmt: skip
        return found


@compiled
def _follow(
    elastic: NDArray[np.bool_],
    loose: NDArray[np.bool_],
    side: Array,
    play: Array,
    compliance: Array,
    carried: Array,
    q: Array,
    qd: Array,
    position: Array,
    speed: Array,
) -> None:
    """Bring ``position`` and ``speed`` of the motors to this step: with their joints, but for those that fly through the play."""
    for i in range(q.shape[0]):
        for j in range(q.shape[1]):
            flying = loose[i, j] and side[i, j] == 0.0
            if not flying:
                speed[i, j] = qd[i, j]
                at = q[i, j] + side[i, j] * play[i, j] + compliance[i, j] * carried[i, j]
                position[i, j] = at if elastic[i, j] else q[i, j]


@compiled
def _carry(
    elastic: NDArray[np.bool_],
    loose: NDArray[np.bool_],
    play: Array,
    compliance: Array,
    rotor: Array,
    landing: Array,
    dt: float,
    active: Array,
    stiffness: Array,
    damping: Array,
    q: Array,
    qd: Array,
    side: Array,
    position: Array,
    speed: Array,
    carried: Array,
    found: Array,
) -> None:
    """Write to ``found`` the torques at the joints; those from ``side`` to ``carried`` go on. All (B, M)."""
    for i in range(found.shape[0]):
        for j in range(found.shape[1]):
            if not elastic[i, j]:
                found[i, j] = active[i, j]
                continue
            give = (stiffness[i, j] + damping[i, j] / dt) * compliance[i, j]
            torque = (active[i, j] + give * carried[i, j]) / (1.0 + give)
            if loose[i, j]:
                brought = landing[i, j] * (speed[i, j] - qd[i, j]) / dt
                led = rotor[i, j] + dt * damping[i, j] + dt * dt * stiffness[i, j]
                gone = speed[i, j] + dt * active[i, j] / led
                there = position[i, j] + dt * gone
                beyond = there - (q[i, j] + dt * qd[i, j])
                pressing = np.sign(beyond) if abs(beyond) > play[i, j] else 0.0
                pressed = pressing * (torque + brought)
                torque = (0.0 if pressed < 0.0 else pressed) * pressing
                side[i, j] = pressing
                if pressing == 0.0:
                    position[i, j], speed[i, j] = there, gone
            found[i, j] = torque
            carried[i, j] = torque if compliance[i, j] > 0.0 else 0.0
