"""How the true states and contacts of a batch are read: by Bullet's C interface, or by PyBullet's functions.

Both give the same bits; the first costs half as much.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np
import pybullet as p
from numpy.typing import NDArray

from ee_dist.engines.pybullet.native import Interface
from ee_dist.engines.pybullet.world import World
from ee_dist.trials.log import Array

Placed = Sequence[tuple[World, list[int]]]
"""Worlds and, for each robot in them, its row of the batch."""
BASE_Q, BASE_U = 7, 6
"""Numbers of the base before those of the joints: position and quaternion; linear and angular velocity."""

CONTACTS = 64
"""Contacts a world for which there is room at first."""


class Reading(Protocol):
    """States of the B robots of a batch with M motors each, in the order of the batch."""

    def joints(self) -> tuple[Array, Array]:
        """Positions and speeds (B, M) at this moment; zero for a joint that is lost."""

    def poses(self) -> Array:
        """Position and quaternion (B, 7) of the base's centre of mass, as they were when ``joints`` was asked."""

    def twists(self) -> Array:
        """Linear and angular velocity (B, 6) of the base's centre of mass, at the same moment."""

    def touching(self) -> NDArray[np.bool_]:
        """Which of the touch sensors (B, T) the floor presses."""


class PublicReading:
    """Implements ``Reading`` by PyBullet's functions."""

    def __init__(self, placed: Placed, motors: int) -> None:
        self.count = sum(len(rows) for _, rows in placed)
        self.touches = len(placed[0][0].touch_links)
        self.robots: list[tuple[int, int, int, list[int], tuple[float, ...]]] = []
        """Row, client, body and links of each robot, and a zero for each joint that it lost."""
        order: list[int] = []
        for world, rows in placed:
            links = [link for link in world.links if link >= 0]
            columns = sorted(range(motors), key=lambda k, w=world: w.links[k] < 0)  # type: ignore[misc]
            for row, body in zip(rows, world.bodies, strict=True):
                self.robots.append((row, world.client, body, links, (0.0,) * (motors - len(links))))
                order += [row * motors + k for k in columns]
        plain = order == list(range(len(order)))
        self.order = None if plain else np.argsort(order).reshape(self.count, motors)
        self.feet = [
            (world.client, world.floor, {key: row * self.touches + k for key, (row, k) in _feet(world, rows).items()})
            for world, rows in placed
        ]

    def joints(self) -> tuple[Array, Array]:
        positions, rates = [], []
        for _, client, body, links, lost in self.robots:
            if links:
                q, qd, _, _ = zip(*p.getJointStates(body, links, client), strict=True)
                if lost:
                    q, qd = q + lost, qd + lost
            else:
                q = qd = lost
            positions.append(q)
            rates.append(qd)
        joints, speeds = np.array(positions), np.array(rates)
        if self.order is None:
            return joints, speeds
        return joints.reshape(-1)[self.order], speeds.reshape(-1)[self.order]

    def poses(self) -> Array:
        out = np.empty((self.count, 7))
        for row, client, body, *_ in self.robots:
            out[row] = np.concatenate(p.getBasePositionAndOrientation(body, physicsClientId=client))
        return out

    def twists(self) -> Array:
        out = np.empty((self.count, 6))
        for row, client, body, *_ in self.robots:
            out[row] = np.concatenate(p.getBaseVelocity(body, physicsClientId=client))
        return out

    def touching(self) -> NDArray[np.bool_]:
        down = np.zeros(self.count * self.touches, dtype=bool)
        pressed = []
        for client, floor, feet in self.feet:
            for contact in p.getContactPoints(floor, physicsClientId=client) if floor >= 0 else ():
                if contact[9] > 0:
                    pressed.append(feet.get((contact[2], contact[4]), -1))
        down[[k for k in pressed if k >= 0]] = True
        return down.reshape(-1, self.touches)


class NativeReading:
    """Implements ``Reading`` by the C interface: Bullet's answers are copied to a row each, then picked all at once."""

    def __init__(self, c: Interface, placed: Placed, motors: int) -> None:
        self.c = c
        count = sum(len(rows) for _, rows in placed)
        self.touches = len(placed[0][0].touch_links)
        # The last column stays zero: what a lost joint reads.
        self.q = np.zeros((count, BASE_Q + max(w.freedoms for w, _ in placed) + 1))
        self.u = np.zeros((count, BASE_U + max(w.freedoms for w, _ in placed) + 1))
        self.robots: list[tuple[Any, int, Any, Any, int, Any, Any, int]] = []
        """Client, body, then address, destination and bytes of positions, and of speeds."""
        into_q, into_u = (c.ffi.from_buffer("double[]", a) for a in (self.q, self.u))
        places = np.empty((count, motors), dtype=np.intp)
        for world, rows in placed:
            client = c.client(world.client)
            from_q, from_u = c.state_of(client, world.bodies[0])
            joints = [k if k >= 0 else self.q.shape[1] - 1 - BASE_Q for k in world.joint_places]
            for row, body in zip(rows, world.bodies, strict=True):
                to_q, to_u = into_q + row * self.q.shape[1], into_u + row * self.u.shape[1]
                size_q, size_u = 8 * (BASE_Q + world.freedoms), 8 * (BASE_U + world.freedoms)
                self.robots.append((client, body, to_q, from_q, size_q, to_u, from_u, size_u))
                places[row] = joints
        self._pick(places)
        self._prepare_contacts(placed, count)

    def _pick(self, places: NDArray[np.intp]) -> None:
        """The usual batch, all joints in Bullet's order, is a slice of what was copied."""
        count, motors = places.shape
        self.flat_q = self.flat_u = None
        if not (places == np.arange(motors)).all():
            rows = np.arange(count)[:, None]
            self.flat_q = rows * self.q.shape[1] + BASE_Q + places
            self.flat_u = rows * self.u.shape[1] + BASE_U + places
        self.in_q, self.in_u = self.q[:, BASE_Q : BASE_Q + motors], self.u[:, BASE_U : BASE_U + motors]

    def _prepare_contacts(self, placed: Placed, count: int) -> None:
        """``foot`` says by world, body and link (from -1) which sensor it is; the last place is none."""
        self.floors = [(self.c.client(world.client), world.floor) for world, _ in placed]
        bodies = 1 + max(max(world.bodies) for world, _ in placed)
        links = 1 + max(len(world.order) for world, _ in placed)
        none = count * self.touches
        foot = np.full((len(placed), bodies, links), none)
        for k, (world, rows) in enumerate(placed):
            for (body, link), (row, sensor) in _feet(world, rows).items():
                foot[k, body, link + 1] = row * self.touches + sensor
        self.foot, self.links = foot.reshape(-1), links
        self.world_start = np.arange(len(placed)) * (bodies * links) + 1
        self.found = self.c.ffi.new("Contacts*")
        self._hold(CONTACTS * len(placed))

    def _hold(self, contacts: int) -> None:
        self.held = np.zeros(contacts, dtype=self.c.contact)
        self.at = self.c.ffi.from_buffer("char[]", self.held)

    def joints(self) -> tuple[Array, Array]:
        library, copy = self.c.library, self.c.ffi.memmove
        ask, submit = library.b3RequestActualStateCommandInit, library.b3SubmitClientCommandAndWaitStatus
        for client, body, to_q, from_q, size_q, to_u, from_u, size_u in self.robots:
            submit(client, ask(client, body))
            copy(to_q, from_q, size_q)
            copy(to_u, from_u, size_u)
        if self.flat_q is None or self.flat_u is None:
            return self.in_q.copy(), self.in_u.copy()
        return self.q.reshape(-1)[self.flat_q], self.u.reshape(-1)[self.flat_u]

    def poses(self) -> Array:
        return self.q[:, :BASE_Q].copy()

    def twists(self) -> Array:
        return self.u[:, :BASE_U].copy()

    def touching(self) -> NDArray[np.bool_]:
        down = np.zeros(len(self.q) * self.touches + 1, dtype=bool)
        counts = []
        total, size = 0, self.held.itemsize
        for client, floor in self.floors:
            count = self.c.contacts_of(client, floor, self.found) if floor >= 0 else 0
            if total + count > len(self.held):
                kept = self.held[:total].copy()
                self._hold(2 * (total + count))
                self.held[:total] = kept
            if count:
                self.c.ffi.memmove(self.at + total * size, self.found.first, count * size)
            counts.append(count)
            total += count
        if total:
            held = self.held[:total]
            place = held["body"] * self.links + held["link"] + np.repeat(self.world_start, counts)
            down[self.foot[place[held["force"] > 0]]] = True
        return down[:-1].reshape(-1, self.touches)


def _feet(world: World, rows: Sequence[int]) -> dict[tuple[int, int], tuple[int, int]]:
    """Body and link of every foot of a world, and the row and sensor that it is."""
    return {
        (body, link): (row, sensor)
        for row, body in zip(rows, world.bodies, strict=True)
        for sensor, link in enumerate(world.touch_links)
        if link > -2
    }
