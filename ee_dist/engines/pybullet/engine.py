"""PyBullet behind the engine contract: a pool of worlds with a robot each, stepped side by side."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterator, Sequence

import numpy as np
import pybullet as p

from ee_dist.engines.contract import EngineError, Rollout, Truth
from ee_dist.engines.drive import hopeless_joints
from ee_dist.engines.loop import gravity_vector, in_batches
from ee_dist.engines.per_robot import per_robot
from ee_dist.engines.pybullet.native import interface
from ee_dist.engines.pybullet.reading import NativeReading, PublicReading, Reading
from ee_dist.engines.pybullet.world import World, structure_key
from ee_dist.trials.log import Array, SensorLog, State

WORLD_SIZES = (8, 4, 2, 1)
"""Robots a world. Eight share the cost of a call well; more cost Bullet's collision pairs."""
WORLDS = 8
"""Worlds in a batch at most: robots that each lack another part need one each, and each takes some 30 MB."""
POOL = 8
"""Worlds kept for reuse, beyond which the longest unused are closed."""
Kind = tuple[str, tuple[float, float, float]]
"""What robots must share to stand in one world: structure and gravity."""


class PyBulletEngine:
    """Implements ``ee_dist.engines.contract.Engine``.

    ``native`` reads by Bullet's C interface where there is one: faster, and the same bits.
    """

    name = "pybullet"

    def __init__(self, largest_batch: int = 128, native: bool = True) -> None:
        self.largest_batch = largest_batch
        self.native = native
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
        for joints in per_robot([r.model for r in batch], hopeless_joints):
            if joints:
                raise EngineError(
                    f"pybullet cannot hold {joints[0]!r}: the damping of its controller stops it in less than a time step; "
                    "use engine=mujoco, or a smaller time_step_s"
                )
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

    gives = False

    def __init__(self, engine: PyBulletEngine, placed: list[tuple[World, list[int]]], batch: Sequence[Rollout]) -> None:
        self.engine = engine
        self.worlds = [world for world, _ in placed]
        self.places = {row: (w, body) for w, rows in placed for row, body in zip(rows, w.bodies, strict=True)}
        motors = len(batch[0].model.drives)
        found = interface() if engine.native else None
        self.reading: Reading = PublicReading(placed, motors) if found is None else NativeReading(found, placed, motors)
        self.robots: list[tuple[int, int, int, list[int], list[int] | None]] = []
        """Row, client, body and links of each robot, and the motors of those links where some joint is lost."""
        self.lifted: list[tuple[int, int, int, tuple[float, ...]]] = []
        """Client, body and link of each rotor that a slide moves, and the force that takes its weight."""
        self.shifted: list[tuple[int, tuple[tuple[float, ...], tuple[float, ...]]]] = []
        """Rows whose root's own frame is not that of its centre of mass, and its pose in that."""
        for world, rows in placed:
            links = [link for link in world.links if link >= 0]
            some = None if len(links) == motors else [k for k, link in enumerate(world.links) if link >= 0]
            for row, body in zip(rows, world.bodies, strict=True):
                self.robots.append((row, world.client, body, links, some))
                up = [-g for g in gravity_vector(batch[row].model)]
                for link, mass in world.slid_rotors if any(up) else ():
                    self.lifted.append((world.client, body, link, tuple(mass * u for u in up)))
                root = batch[row].model.root
                shift = _inverse(root.com_m, world.frames[root.name][1])
                if shift is not None:
                    self.shifted.append((row, shift))

    def read(self, touch: bool, pose: bool, twist: bool) -> Truth:
        truth = Truth(*self.reading.joints())
        if touch:
            truth.touch = self.reading.touching()
        if pose:
            truth.base_pose = self.reading.poses()
            for row, shift in self.shifted:
                place = truth.base_pose[row].tolist()
                truth.base_pose[row] = np.concatenate(p.multiplyTransforms(place[:3], place[3:], *shift))
        if twist:
            truth.base_twist = self.reading.twists()
        return truth

    def step(self, torques: Array, force: Array | None, give: Array | None = None) -> None:
        send, simulate, mode = p.setJointMotorControlArray, p.stepSimulation, p.TORQUE_CONTROL
        values = torques.tolist()
        for row, client, body, links, motors in self.robots:
            mine = values[row]
            if links:
                forces = mine if motors is None else [mine[k] for k in motors]
                send(body, links, mode, forces=forces, physicsClientId=client)
            if force is not None and force[row].any():
                position, _ = p.getBasePositionAndOrientation(body, physicsClientId=client)
                p.applyExternalForce(body, -1, force[row].tolist(), position, p.WORLD_FRAME, physicsClientId=client)
        for client, body, link, lift in self.lifted:
            centre = p.getLinkState(body, link, physicsClientId=client)[0]
            p.applyExternalForce(body, link, lift, centre, p.WORLD_FRAME, physicsClientId=client)
        for world in self.worlds:
            simulate(world.client)

    def move(self, joints: Array, speeds: Array) -> None:
        values, rates = joints[:, :, None].tolist(), speeds[:, :, None].tolist()
        for row, client, body, links, motors in self.robots:
            q, qd = values[row], rates[row]
            if motors is not None:
                q, qd = [q[k] for k in motors], [qd[k] for k in motors]
            if links:
                p.resetJointStatesMultiDof(body, links, q, qd, physicsClientId=client)

    def put(self, row: int, state: State) -> None:
        world, body = self.places[row]
        world.put(body, state)

    def close(self) -> None:
        self.engine.give_back(self.worlds)
        self.worlds = []


def _inverse(com: tuple[float, ...], turn: tuple[float, ...]) -> tuple[tuple[float, ...], tuple[float, ...]] | None:
    """Pose of the root's own frame in the frame of its centre of mass; None where they are the same."""
    if not any(com) and tuple(turn) == (0.0, 0.0, 0.0, 1.0):
        return None
    return p.invertTransform(com, turn)
