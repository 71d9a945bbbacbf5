"""An engine for robots of one moving joint on a fixed base: their dynamics in closed form, for a whole batch at once.

A general engine spends its time on bodies and contacts that a pendulum or a slide does not have. Here a step is a few
array operations whatever the number of rows, and the inertia about the joint and the work of gravity are exact. Steps
are semi-implicit Euler, as in Bullet, or half steps (``halfway``). Everything else (drives, sensors, controllers) is the same
code as for any engine.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np

from ee_dist.engines.contract import EngineError, Rollout, Truth
from ee_dist.engines.loop import in_batches, up_to
from ee_dist.robots.inverse_dynamics import joint_torques
from ee_dist.robots.kinematics import compose, part_poses
from ee_dist.robots.model import NO_TURN, Drive, Robot, Shape
from ee_dist.trials.log import Array, SensorLog, State

_PLAIN = Drive("", kp=0.0, ki=0.0, kd=0.0, torque_limit=0.0, speed_limit=1.0)


def fits(robot: Robot) -> bool:
    """Whether this engine can simulate the robot."""
    moving = [j.name for j in robot.joints if j.kind != "fixed"]
    one = not robot.free_base and not robot.lost and moving == list(robot.motor_names) and len(moving) == 1
    return one and not _may_touch(robot)


class OneJointEngine:
    """Implements ``ee_dist.engines.contract.Engine``."""

    name = "one_joint"

    def __init__(self, largest_batch: int = 512) -> None:
        self.largest_batch = largest_batch

    def rollout(self, rollouts: Sequence[Rollout]) -> list[SensorLog]:
        """Logs in the order asked. Raises EngineError for a robot that has more than one joint or moves about."""
        for r in rollouts:
            if not fits(r.model):
                raise EngineError(
                    f"one_joint cannot simulate {r.model.name!r}: it is for one driven joint on a fixed base"
                )
        return in_batches(rollouts, OneJointBodies, up_to(self.largest_batch))

    def close(self) -> None:
        """Nothing is held."""


class OneJointBodies:
    """Implements ``ee_dist.engines.contract.Bodies``."""

    gives = True

    def __init__(self, batch: Sequence[Rollout]) -> None:
        count = len(batch)
        self.dt = batch[0].model.time_step_s
        terms = {id(r.model): r.model for r in batch}
        known = {key: _dynamics(robot) for key, robot in terms.items()}
        self.inertia, self.constant, self.cosine, self.sine = np.array([known[id(r.model)] for r in batch]).T[
            :, :, None
        ]
        self.q, self.qd = np.zeros((count, 1)), np.zeros((count, 1))
        for i, r in enumerate(batch):
            if r.start is not None:
                self.q[i], self.qd[i] = r.start.joints, r.start.speeds
        self.swings = bool(self.cosine.any() or self.sine.any())
        self.touches = sum(s.kind == "touch" for s in batch[0].model.sensors)
        self.base = np.array([(*r.model.start_position_m, *r.model.start_rotation) for r in batch])

    def read(self, touch: bool, pose: bool, twist: bool) -> Truth:
        truth = Truth(self.q, self.qd)
        if touch:
            truth.touch = np.zeros((len(self.q), self.touches), dtype=bool)
        if pose:
            truth.base_pose = self.base
        if twist:
            truth.base_twist = np.zeros((len(self.q), 6))
        return truth

    def step(self, torques: Array, force: Array | None, give: Array | None = None) -> None:
        load = self.constant
        if self.swings:
            load = load + self.cosine * np.cos(self.q) + self.sine * np.sin(self.q)
        inertia = self.inertia if give is None else self.inertia + self.dt * give
        self.qd = self.qd + self.dt * (torques - load) / inertia
        self.q = self.q + self.dt * self.qd

    def move(self, joints: Array, speeds: Array) -> None:
        self.q, self.qd = joints, speeds

    def put(self, row: int, state: State) -> None:
        self.q, self.qd = self.q.copy(), self.qd.copy()
        self.q[row], self.qd[row] = state.joints, state.speeds

    def close(self) -> None:
        """Nothing is held."""


def _may_touch(robot: Robot) -> bool:
    """Whether a shape that the joint moves could come down to the floor, by where its smallest ball goes."""
    if not robot.world.has_floor:
        return False
    joint = next(j for j in robot.joints if j.kind != "fixed")
    carried = [p for name in robot.subtree(joint.child) if (p := robot.part(name)).shapes]
    # Height is a first harmonic of a hinge's angle, which is taken all the way round; on a slide the ends are the lowest.
    span = joint.ends if joint.kind == "slide" else (0.0, math.pi / 2, math.pi)
    if carried and not all(map(math.isfinite, span)):
        return True
    base = np.array([*robot.start_position_m, *robot.start_rotation])
    base[3:] /= np.linalg.norm(base[3:])
    poses = part_poses(robot, base, np.array([span]).T) if carried else {}
    for part in carried:
        for shape in part.shapes:
            centre = compose(poses[part.name], np.array([*shape.position_m, *NO_TURN]))[:, 2]
            lowest = centre.min()
            if joint.kind == "hinge":
                middle = (centre[0] + centre[2]) / 2
                lowest = middle - math.hypot(centre[0] - middle, centre[1] - middle)
            if lowest <= _radius(shape):
                return True
    return False


def _radius(shape: Shape) -> float:
    """Of a ball about the middle of a shape that holds all of it."""
    if shape.kind == "capsule":
        return shape.size[0] + shape.size[1] / 2
    if shape.kind == "cylinder":
        return math.hypot(shape.size[0], shape.size[1] / 2)
    return math.hypot(*shape.size)


def _dynamics(robot: Robot) -> tuple[float, float, float, float]:
    """(inertia, c, a, b): holding the joint still at q takes c + a cos q + b sin q (a = b = 0 for a slide)."""
    drives = tuple(replace(_PLAIN, joint=d.joint, rotor_inertia=d.rotor_inertia) for d in robot.drives)
    return _of_body(replace(robot, drives=drives, sensors=(), laws=()))


@lru_cache(maxsize=4096)
def _of_body(robot: Robot) -> tuple[float, float, float, float]:
    # Gravity on a turning body is a first harmonic of its angle, so that three angles tell all of it.
    kind = next(j.kind for j in robot.joints if j.kind != "fixed")
    angles = [0.0, math.pi / 2, math.pi] if kind == "hinge" else [0.0, 0.0, 0.0]
    at, moved = np.array([[*angles, 0.0]]).T, np.array([[0.0, 0.0, 0.0, 1.0]]).T
    held = [float(v) for v in joint_torques(robot, at, np.zeros((4, 1)), moved)[:, 0]]
    inertia = held[3] - held[0]
    if kind == "slide":
        return inertia, held[0], 0.0, 0.0
    constant = (held[0] + held[2]) / 2
    return inertia, constant, (held[0] - held[2]) / 2, held[1] - constant
