"""The bodies of a batch: live arrays over the states that MuJoCo steps, read and written without a loop over robots."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from mujoco import batch as native
from numpy.typing import NDArray

from ee_dist.engines.compiled import compiled
from ee_dist.engines.contract import Rollout, Truth
from ee_dist.engines.mujoco.contact import LEAST_FRICTION, contact
from ee_dist.engines.mujoco.model import OWN, Model, scalar_first
from ee_dist.engines.per_robot import per_robot
from ee_dist.trials.log import Array, State

Index = slice | NDArray[np.intp]
Places = NDArray[np.intp]


class Group:
    """Robots of one structure, at their start. Rows are those of ``members``."""

    def __init__(self, model: Model, members: Sequence[Rollout], threads: int) -> None:
        self.model = model
        self.free_base = members[0].model.free_base
        self.com = np.array([r.model.root.com_m for r in members]) + 0.0
        # A warm start is part of a robot's own state, and zero at first: nothing that ran before can be felt.
        self.batch = self._fill(members, threads)
        bind = self.batch.bind
        self.positions: Array = bind("qpos")
        self.speeds: Array = bind("qvel")
        self.torques: Array = bind("qfrc_applied")
        self.force: Array = bind("xfrc_applied")[:, model.root, :3]
        self.pressed: Array = bind("sensordata")
        self.damping: Array | None = self.batch.expand("dof_damping") if model.damped else None
        self.motors, self.dof = _index(model.motors), _index(model.dof)
        drives = len(members[0].model.drives)
        self.qpos_of, self.dof_of = _places(model.motors, model.qpos, drives), _places(model.motors, model.dof, drives)
        sensors = sum(s.kind == "touch" for s in members[0].model.sensors)
        self.touch_of = _places(model.touches, range(len(model.touches)), sensors)
        self.pose: Array = np.empty((len(members), 7))
        self._stand(members)

    def _fill(self, members: Sequence[Rollout], threads: int) -> native.Batch:
        """A batch with each robot's own numbers; a field that is the same for all is held once."""
        model = self.model
        own = per_robot([r.model for r in members], model.numbers)
        model.fill(own[0])
        batch = native.Batch(model.compiled, len(members), threads)
        derived = False
        for k, name in enumerate(OWN):
            values = np.array([numbers[k] for numbers in own])
            if (values != values[0]).any():
                batch.expand(name)[:] = values
                derived = derived or name != "opt.gravity"
        if derived:
            batch.set_const()
        if len(model.pair_body):
            self._touch_floor(batch, members)
        return batch

    def _touch_floor(self, batch: native.Batch, members: Sequence[Rollout]) -> None:
        shared = self.model.compiled.body_invweight0
        weights = batch.expanded("body_invweight0")
        if weights is None:
            weights = np.broadcast_to(shared, (len(members), *shared.shape))
        worlds = [r.model.world for r in members]
        give = np.array([w.compliance_m_n for w in worlds])
        found = contact(members[0].model.time_step_s, give, weights[:, self.model.pair_body, 0])
        batch.expand("pair_solref")[:] = found.normal
        batch.expand("pair_solreffriction")[:] = found.sliding
        batch.expand("pair_solimp")[:] = found.impedance
        ratio = batch.expand("opt.impratio")
        ratio[:] = found.ratio.reshape(ratio.shape)
        grips = np.array([[p.grip for p in r.model.present_parts] for r in members])[:, self.model.pair_part]
        friction = np.maximum(np.array([[w.friction] for w in worlds]) * grips, LEAST_FRICTION)
        batch.expand("pair_friction")[:, :, :2] = friction[:, :, None]

    def _stand(self, members: Sequence[Rollout]) -> None:
        """Put each robot at its start: the robot's own, or the state that the rollout asks for."""
        model = self.model
        for i, r in enumerate(members):
            start = r.start
            self.pose[i] = (*r.model.start_position_m, *r.model.start_rotation)
            for name, at in model.undriven:
                self.positions[i, at] = r.model.joint(name).start
            if start is not None:
                self.put(i, start)
                if self.free_base and start.base_pose is not None:
                    self.pose[i] = start.base_pose
                    if start.base_twist is not None:
                        self.speeds[i, :6] = start.base_twist
        self.pose[:, 3:] /= np.sqrt((self.pose[:, 3:] ** 2).sum(axis=1, keepdims=True))
        self.pose += 0.0
        if self.free_base:
            self.positions[:, :3] = self.pose[:, :3]
            self.positions[:, 3:7] = scalar_first(self.pose[:, 3:])
            turn, spin = self.positions[:, 3:7], self.speeds[:, 3:6].copy()
            self.speeds[:, :3] -= _cross(spin, _turned(turn, self.com))
            self.speeds[:, 3:6] = _turned(turn * (1.0, -1.0, -1.0, -1.0), spin)

    # -- a step ------------------------------------------------------------------------------------------------------

    def base_pose(self) -> Array:
        """(n, 7), scalar last."""
        if self.free_base:
            self.pose[:, :3] = self.positions[:, :3]
            self.pose[:, 3:6] = self.positions[:, 4:7]
            self.pose[:, 6] = self.positions[:, 3]
        return self.pose

    def base_twist(self) -> Array:
        """(n, 6) of the root's centre of mass in the frame of the floor. MuJoCo's own spin is in the frame of the root."""
        twist = np.zeros((len(self.pose), 6))
        if self.free_base:
            turn = self.positions[:, 3:7]
            twist[:, 3:] = _turned(turn, self.speeds[:, 3:6])
            twist[:, :3] = self.speeds[:, :3] + _cross(twist[:, 3:], _turned(turn, self.com))
        return twist

    def put(self, i: int, state: State) -> None:
        """Joint positions and speeds of one robot, from here on."""
        model = self.model
        self.positions[i, model.qpos] = np.asarray(state.joints, dtype=float)[model.motors]
        self.speeds[i, model.dof] = np.asarray(state.speeds, dtype=float)[model.motors]

    def step(self) -> None:
        """Advance under the torques and forces that were set."""
        try:
            self.batch.step()
        except native.SimulationError as error:
            # The others have moved on; a robot that MuJoCo gave up on must not stand there as if it were at rest.
            self.positions[error.ids] = np.nan


class MuJoCoBodies:
    """The bodies of one batch. Implements ``ee_dist.engines.contract.Bodies``."""

    gives = True

    def __init__(self, placed: Sequence[tuple[list[int], Group]], batch: Sequence[Rollout]) -> None:
        self.count, self.motors = len(batch), len(batch[0].model.drives)
        self.touches = sum(s.kind == "touch" for s in batch[0].model.sensors)
        self.groups = [(np.array(rows, dtype=np.intp), group) for rows, group in placed]

    def read(self, touch: bool, pose: bool, twist: bool) -> Truth:
        joints, speeds = np.empty((self.count, self.motors)), np.empty((self.count, self.motors))
        down = np.empty((self.count, self.touches), dtype=bool)
        for rows, g in self.groups:
            _gather(
                rows, g.positions, g.speeds, g.pressed, g.qpos_of, g.dof_of, g.touch_of, joints, speeds, down
            )  # fmt: skip
        truth = Truth(joints, speeds, down if touch else None)
        if pose:
            truth.base_pose = np.empty((self.count, 7))
            for rows, group in self.groups:
                truth.base_pose[rows] = group.base_pose()
        if twist:
            truth.base_twist = np.empty((self.count, 6))
            for rows, group in self.groups:
                truth.base_twist[rows] = group.base_twist()
        return truth

    def step(self, torques: Array, force: Array | None, give: Array | None = None) -> None:
        for rows, group in self.groups:
            _scatter(rows, torques, group.dof_of, group.torques)
            if group.damping is not None and give is not None:
                # MuJoCo takes damping at the end of the step, and so counts what the torque has of it already once more.
                _scatter(rows, give, group.dof_of, group.damping)
                # A robot that has blown up has speeds beyond the numbers; that is said of its log, not here.
                with np.errstate(invalid="ignore", over="ignore"):
                    group.torques += group.damping * group.speeds
            if force is not None:
                group.force[:] = force[rows]
            group.step()

    def move(self, joints: Array, speeds: Array) -> None:
        for rows, g in self.groups:
            _scatter(rows, joints, g.qpos_of, g.positions)
            _scatter(rows, speeds, g.dof_of, g.speeds)

    def put(self, row: int, state: State) -> None:
        for rows, group in self.groups:
            for i in np.flatnonzero(rows == row):
                group.put(int(i), state)

    def close(self) -> None:
        self.groups = []


@compiled
def _gather(
    rows: Places,
    positions: Array,
    velocities: Array,
    pressed: Array,
    qpos_of: Places,
    dof_of: Places,
    touch_of: Places,
    joints: Array,
    speeds: Array,
    down: NDArray[np.bool_],
) -> None:
    """MuJoCo's state of a group's robots into the ``rows`` of the batch; zero and open for what is lost."""
    for i in range(len(rows)):
        row = rows[i]
        for k in range(len(qpos_of)):
            joints[row, k] = positions[i, qpos_of[k]] if qpos_of[k] >= 0 else 0.0
            speeds[row, k] = velocities[i, dof_of[k]] if dof_of[k] >= 0 else 0.0
        for k in range(len(touch_of)):
            down[row, k] = touch_of[k] >= 0 and pressed[i, touch_of[k]] > 0.0


@compiled
def _scatter(rows: Places, values: Array, place_of: Places, into: Array) -> None:
    """Values of the batch's ``rows``, one a motor, to where MuJoCo takes them for a group."""
    for i in range(len(rows)):
        for k in range(len(place_of)):
            if place_of[k] >= 0:
                into[i, place_of[k]] = values[rows[i], k]


def _places(members: Sequence[int], at: Sequence[int], count: int) -> Places:
    """For each of ``count`` motors or sensors where it is found, -1 for one that is not among the ``members``."""
    found = np.full(count, -1, dtype=np.intp)
    found[list(members)] = list(at)
    return found


def _index(places: Sequence[int]) -> Index:
    """A slice where the places follow one another: NumPy then only looks, and copies nothing."""
    if places and list(places) == list(range(places[0], places[-1] + 1)):
        return slice(places[0], places[-1] + 1)
    return np.array(places, dtype=np.intp)


def _turned(turn: Array, vector: Array) -> Array:
    """Vectors (n, 3) turned by unit quaternions (n, 4), scalar first."""
    axis = turn[:, 1:]
    twice = 2.0 * _cross(axis, vector)
    return vector + turn[:, :1] * twice + _cross(axis, twice)


def _cross(a: Array, b: Array) -> Array:
    return np.stack(
        [
            a[:, 1] * b[:, 2] - a[:, 2] * b[:, 1],
            a[:, 2] * b[:, 0] - a[:, 0] * b[:, 2],
            a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0],
        ],
        axis=1,
    )
