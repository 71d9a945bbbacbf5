"""Gaits that are none: a distance made on the back, in the air, through the floor, or with energy from nowhere.

Fitness is forward distance, as in the paper, and evolution takes whatever gives it: a robot that tips over slides down a
slope faster than it walks, and a simulator has seams. What a trial's log shows of that is named here, after the search, from
the pose of the body, the joints and the torques of the drives.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ee_dist.basics.runs import runs
from ee_dist.engines.loop import gravity_vector
from ee_dist.robots.kinematics import compose, part_poses, quat_rotate
from ee_dist.robots.model import Robot, Shape
from ee_dist.trials.log import SensorLog

Array = NDArray[np.float64]

BACK, FLIGHT, FLOOR, ENERGY = "on its back", "flying", "through the floor", "energy from nowhere"

BACK_SHARE = 0.25
"""Of the distance: more of it made with the body tipped by over 90 degrees is sliding, not walking."""
CLEAR_M = 0.01
"""All of the robot this far above the floor: in the air."""
JUMP = 2.0
"""A flight may last as long as a jump that lifts the robot by this many times its own reach."""
DEEP_M = 0.02
"""A centre of mass this far below the floor's surface: feet and floor give a few millimetres."""
ENERGY_SHARE = 0.1
"""Energy may exceed what was put in by this share of it, and by what lifts the robot by its own reach: the log has the state
once a time step, and a contact is shorter."""


@dataclass(frozen=True)
class Gait:
    """How a distance was made. All are measures of the whole trial; ``cheats`` names those beyond what is allowed."""

    back_share: float
    """Of the distance, made with the body tipped by over 90 degrees."""
    flight_s: float
    """The longest flight."""
    flight_limit_s: float
    deep_m: float
    """How far below the floor a centre of mass was."""
    energy_j: float
    """By how much the energy of the robot ever exceeded what it had before and what was put in since."""
    energy_limit_j: float

    @property
    def cheats(self) -> tuple[str, ...]:
        found = {
            BACK: self.back_share > BACK_SHARE,
            FLIGHT: self.flight_s > self.flight_limit_s,
            FLOOR: self.deep_m > DEEP_M,
            ENERGY: self.energy_j > self.energy_limit_j,
        }
        return tuple(name for name, seen in found.items() if seen)


def gait(robot: Robot, log: SensorLog) -> Gait | None:
    """How ``robot`` made the distance of ``log``; None where the log has no pose of the body, no joints or no torques."""
    if log.base_pose is None or log.joints is None or log.torques is None or len(log) < 3:
        return None
    poses = part_poses(robot, log.base_pose, log.joints)
    centres = {
        p.name: poses[p.name][:, :3] + quat_rotate(poses[p.name][:, 3:], np.array(p.com_m)) for p in robot.present_parts
    }
    gravity = np.array(gravity_vector(robot))
    reach = _reach(centres[robot.root.name], centres)
    weight = float(np.linalg.norm(gravity)) * sum(p.mass_kg for p in robot.present_parts)
    excess, put_in = _energy(robot, log, poses, centres, gravity)
    floored = robot.world.has_floor
    return Gait(
        back_share=back_share(log.base_pose),
        flight_s=_longest(_lowest(robot, poses) > CLEAR_M) * robot.time_step_s if floored else 0.0,
        flight_limit_s=float(2 * np.sqrt(2 * JUMP * reach / max(-gravity[2], 1e-3))),
        deep_m=max(0.0, -min(float(c[:, 2].min()) for c in centres.values())) if floored else 0.0,
        energy_j=excess,
        energy_limit_j=ENERGY_SHARE * put_in + weight * reach,
    )


def back_share(base_pose: Array) -> float:
    """Of the way forward, the part made while what was up at the start points down."""
    up = np.array([0.0, 0.0, 1.0])
    there = quat_rotate(base_pose[0, 3:] * [-1, -1, -1, 1], up)
    tipped = quat_rotate(base_pose[:, 3:], there)[:, 2] < 0.0
    forward = np.diff(base_pose[:, 0])
    travel = float(forward.sum())
    return float(forward[tipped[1:]].sum()) / travel if travel > 0.0 else 0.0


def _reach(root: Array, centres: dict[str, Array]) -> float:
    """From the body's centre to the farthest other one at the start, m; a body alone has none."""
    far = [float(np.linalg.norm(c[0] - root[0])) for c in centres.values()]
    return max([0.05, *far])


def _lowest(robot: Robot, poses: dict[str, Array]) -> Array:
    """(T,) height of the robot's lowest point above the floor."""
    heights = []
    for part in robot.present_parts:
        for shape in part.shapes:
            placed = compose(poses[part.name], np.array([*shape.position_m, *shape.rotation]))
            heights.append(placed[:, 2] - _below(shape, placed))
    return np.min(heights, axis=0) if heights else np.min([p[:, 2] for p in poses.values()], axis=0)


def _below(shape: Shape, placed: Array) -> Array:
    """(T,) how far a shape extends below its own centre."""
    rows = np.stack([quat_rotate(placed[:, 3:], axis)[:, 2] for axis in np.eye(3)], axis=1)
    if shape.kind == "box":
        return np.abs(rows) @ np.array(shape.size)
    radius = shape.size[0]
    if shape.kind == "sphere":
        return np.full(len(placed), radius)
    along = np.abs(rows[:, 2]) * shape.size[1] / 2
    return along + (radius if shape.kind == "capsule" else radius * np.sqrt(np.maximum(0.0, 1.0 - rows[:, 2] ** 2)))


def _longest(seen: NDArray[np.bool_]) -> int:
    """Rows of the longest stretch of True."""
    return max((last - first for first, last in runs(seen)), default=0)


def _energy(
    robot: Robot, log: SensorLog, poses: dict[str, Array], centres: dict[str, Array], gravity: Array
) -> tuple[float, float]:
    """By how much the energy ever exceeded what was there and what was put in since, and what was put in in all, J.

    Put in: the work of the drives where they push, not where they brake, and that of a push upon the body. Moving parts count
    with the motion of their centres; their turning is left out, which can only hide a gain.
    """
    dt = robot.time_step_s
    assert log.joints is not None and log.torques is not None
    energy = np.zeros(len(log) - 1)
    for part in robot.present_parts:
        centre = centres[part.name]
        speed = np.diff(centre, axis=0) / dt
        middle = (centre[1:] + centre[:-1]) / 2
        energy += part.mass_kg * (0.5 * (speed**2).sum(axis=1) - middle @ gravity)
    turned = np.diff(log.joints, axis=0)
    work = np.maximum(0.0, np.maximum(log.torques[:-1] * turned, log.torques[1:] * turned)).sum(axis=1)
    push = np.array([robot.world.push_x_n, robot.world.push_y_n])
    work += np.maximum(0.0, np.diff(poses[robot.root.name][:, :2], axis=0) @ push)
    given = np.cumsum(work)
    balance = energy - given
    excess = balance - np.minimum.accumulate(balance)
    return float(excess.max()), float(given[-1])
