"""PyBullet behind the engine contract: a pool of worlds with a robot each, stepped side by side."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterator, Sequence

import numpy as np
import pybullet as p
from numpy.typing import NDArray

from ee_dist.engines.contract import Rollout, Truth
from ee_dist.engines.loop import gravity_vector, in_batches
from ee_dist.engines.pybullet.world import World, structure_key
from ee_dist.trials.log import Array, SensorLog

WORLD_SIZES = (8, 4, 2, 1)
"""Robots a world. Eight share the cost of a call well; more cost Bullet's collision pairs."""
WORLDS = 16
"""Worlds in a batch at most: robots that each lack another part need one each, and each takes some 30 MB."""
POOL = 16
"""Worlds kept for reuse, beyond which the longest unused are closed."""
Kind = tuple[str, tuple[float, float, float]]
"""What robots must share to stand in one world: structure and gravity."""


class PyBulletEngine:
    """Implements ``ee_dist.engines.contract.Engine``."""

    name = "pybullet"

    def __init__(self, largest_batch: int = 128) -> None:
        self.largest_batch = largest_batch
        self._idle: OrderedDict[tuple[str, int], list[World]] = OrderedDict()
        self._structures: dict[int, str] = {}
        """Of the models of this call, by their identity: finding it is not free."""

    def rollout(self, rollouts: Sequence[Rollout]) -> list[SensorLog]:
        self._structures.clear()
        return in_batches(rollouts, self._place, self._cut)

    def close(self) -> None:
        for worlds in self._idle.values():
            for world in worlds:
                world.close()
        self._idle.clear()

    def _in_worlds(self, rollouts: Sequence[Rollout]) -> Iterator[list[int]]:
        """Places of those that share a world, world by world."""
        kinds: dict[Kind, list[int]] = {}
        for i, r in enumerate(rollouts):
            if id(r.model) not in self._structures:
                self._structures[id(r.model)] = structure_key(r.model)
            kinds.setdefault((self._structures[id(r.model)], gravity_vector(r.model)), []).append(i)
        for members in kinds.values():
            for size in WORLD_SIZES:
                while len(members) >= size and size <= self.largest_batch:
                    yield members[:size]
                    members = members[size:]

    def _cut(self, rollouts: Sequence[Rollout]) -> list[list[int]]:
        """Batches of ``largest_batch`` robots and ``WORLDS`` worlds at most."""
        batches: list[list[int]] = []
        room = 0
        for rows in self._in_worlds(rollouts):
            if room == 0 or len(batches[-1]) + len(rows) > self.largest_batch:
                batches.append([])
                room = WORLDS
            batches[-1] += rows
            room -= 1
        return batches

    def _place(self, batch: Sequence[Rollout]) -> BulletBodies:
        placed: list[tuple[World, list[int]]] = []
        for rows in self._in_worlds(batch):
            models = [batch[i].model for i in rows]
            idle = self._idle.get((self._structures[id(models[0])], len(rows)))
            world = idle.pop() if idle else World(models[0], len(rows))
            world.prepare(models, [batch[i].start for i in rows])
            placed.append((world, rows))
        return BulletBodies(self, placed, batch)

    def give_back(self, worlds: Sequence[World]) -> None:
        """Take worlds back after a batch; close those unused for longest."""
        for world in worlds:
            key = (world.structure, world.size)
            self._idle.setdefault(key, []).append(world)
            self._idle.move_to_end(key)
        excess = sum(map(len, self._idle.values())) - POOL
        while excess > 0:
            key, stack = next(iter(self._idle.items()))
            if stack:
                stack.pop(0).close()
                excess -= 1
            else:
                del self._idle[key]


class BulletBodies:
    """The bodies of one batch. Implements ``ee_dist.engines.contract.Bodies``; worlds go back after the batch."""

    def __init__(self, engine: PyBulletEngine, placed: list[tuple[World, list[int]]], batch: Sequence[Rollout]) -> None:
        self.engine = engine
        self.worlds = [world for world, _ in placed]
        self.touches = len(placed[0][0].touch_links)
        self.robots: list[tuple[int, int, int, list[int], tuple[float, ...]]] = []
        """Row, client, body and links of each robot, and a zero for each joint that it lost."""
        self.feet: list[tuple[int, int, dict[tuple[int, int], int]]] = []
        self.frame_in_com: dict[int, tuple[tuple[float, ...], tuple[float, ...]] | None] = {}
        columns: list[list[int]] = []
        for world, rows in placed:
            links = [link for link in world.links if link >= 0]
            lost = (0.0,) * (len(world.links) - len(links))
            feet: dict[tuple[int, int], int] = {}
            for row, body in zip(rows, world.bodies, strict=True):
                self.robots.append((row, world.client, body, links, lost))
                columns.append(sorted(range(len(world.links)), key=lambda k: world.links[k] < 0))
                feet.update({(body, link): row * self.touches + k for k, link in enumerate(world.touch_links)})
                root = batch[row].model.root
                self.frame_in_com[row] = _inverse(root.com_m, world.frames[root.name][1])
            self.feet.append((world.client, world.floor, feet))
        self._order(columns, len(batch[0].model.drives))

    def _order(self, columns: list[list[int]], motors: int) -> None:
        """Engine order is that of ``robots``, present joints first; None where it is that of the batch."""
        shape = (len(self.robots), motors)
        flat = np.array([row * motors + k for (row, *_), ks in zip(self.robots, columns, strict=True) for k in ks])
        plain = bool((flat == np.arange(flat.size)).all())
        self.to_engine = None if plain else flat.reshape(shape)
        self.from_engine = None if plain else np.argsort(flat).reshape(shape)

    def read(self, touch: bool, pose: bool, twist: bool) -> Truth:
        states = p.getJointStates
        positions, rates = [], []
        for _, client, body, links, lost in self.robots:
            if links:
                q, qd, _, _ = zip(*states(body, links, client), strict=True)
                if lost:
                    q, qd = q + lost, qd + lost
            else:
                q = qd = lost
            positions.append(q)
            rates.append(qd)
        joints, speeds = np.array(positions), np.array(rates)
        if self.from_engine is not None:
            joints, speeds = joints.reshape(-1)[self.from_engine], speeds.reshape(-1)[self.from_engine]
        truth = Truth(joints, speeds)
        if touch:
            truth.touch = self._touch()
        if pose:
            truth.base_pose = self._poses()
        if twist:
            truth.base_twist = np.empty((len(self.robots), 6))
            for row, client, body, _, _ in self.robots:
                truth.base_twist[row] = np.concatenate(p.getBaseVelocity(body, physicsClientId=client))
        return truth

    def _touch(self) -> NDArray[np.bool_]:
        down = np.zeros(len(self.robots) * self.touches, dtype=bool)
        pressed = []
        for client, floor, feet in self.feet:
            for contact in p.getContactPoints(floor, physicsClientId=client):
                if contact[9] > 0:
                    pressed.append(feet.get((contact[2], contact[4]), -1))
        down[[k for k in pressed if k >= 0]] = True
        return down.reshape(-1, self.touches)

    def _poses(self) -> Array:
        out = np.empty((len(self.robots), 7))
        for row, client, body, _, _ in self.robots:
            position, turn = p.getBasePositionAndOrientation(body, physicsClientId=client)
            shift = self.frame_in_com[row]
            if shift is not None:
                position, turn = p.multiplyTransforms(position, turn, *shift)
            out[row, :3] = position
            out[row, 3:] = turn
        return out

    def step(self, torques: Array, force: Array | None) -> None:
        send, simulate, mode = p.setJointMotorControlArray, p.stepSimulation, p.TORQUE_CONTROL
        rows = (torques if self.to_engine is None else torques.reshape(-1)[self.to_engine]).tolist()
        for (row, client, body, links, lost), values in zip(self.robots, rows, strict=True):
            if links:
                send(body, links, mode, forces=values[: len(links)] if lost else values, physicsClientId=client)
            if force is not None and force[row].any():
                position, _ = p.getBasePositionAndOrientation(body, physicsClientId=client)
                p.applyExternalForce(body, -1, force[row].tolist(), position, p.WORLD_FRAME, physicsClientId=client)
        for world in self.worlds:
            simulate(world.client)

    def close(self) -> None:
        self.engine.give_back(self.worlds)
        self.worlds = []


def _inverse(com: tuple[float, ...], turn: tuple[float, ...]) -> tuple[tuple[float, ...], tuple[float, ...]] | None:
    """Pose of the root's own frame in the frame of its centre of mass; None where they are the same."""
    if not any(com) and tuple(turn) == (0.0, 0.0, 0.0, 1.0):
        return None
    return p.invertTransform(com, turn)
