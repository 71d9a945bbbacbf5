"""The one rollout path: sense, command, drive, step, for a batch of robots of the same shape."""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ee_dist.engines.compiled import compiled
from ee_dist.engines.contract import Bodies, Rollout, Truth
from ee_dist.engines.drive import DrivePath
from ee_dist.engines.drivers import Controllers, command_scaling, scaling
from ee_dist.engines.halfway import Halfway, goes_halfway
from ee_dist.engines.per_robot import per_robot
from ee_dist.engines.sensing import LIFTED, TOUCHING, SensingPath
from ee_dist.robots.model import Robot, RobotError
from ee_dist.robots.system import System
from ee_dist.trials.log import Array, SensorLog, State, start_of

POSE_KINDS = frozenset({"height", "roll", "pitch", "x", "y"})
TWIST_KINDS = frozenset({"speed_x", "turn_rate"})


def shape_of(rollout: Rollout) -> tuple[object, ...]:
    """Rollouts of one shape can share a batch."""
    robot = rollout.model
    kinds = tuple((s.kind, s.target) for s in robot.sensors)
    return (
        robot.motor_names,
        kinds,
        robot.time_step_s,
        rollout.steps,
        rollout.pose,
        robot.free_base,
        goes_halfway(robot),
        rollout.supply_v is None,
        rollout.enabled is None,
        rollout.external is None,
    )


def run(rollouts: Sequence[Rollout], bodies: Bodies) -> list[SensorLog]:
    """Logs of a batch of one shape, whose ``bodies`` stand at their start.

    A model whose motion leaves the finite numbers gives a log that says so (``SensorLog.finite``), and harms no other.
    """
    robots = [r.model for r in rollouts]
    first, steps, pose = robots[0], rollouts[0].steps, rollouts[0].pose
    dt = first.time_step_s
    halfway = Halfway(bodies, dt) if goes_halfway(first) else None
    bodies = halfway or bodies
    kinds = {s.kind for s in first.sensors}
    drive = DrivePath(robots, dt, bodies.gives)
    goals = _goals(rollouts)
    if goals is not None:
        drive.goals.go_on(goals)
    sensing = SensingPath(robots, dt, steps, [r.seed for r in rollouts])
    scales = per_robot(robots, scaling)
    control = Controllers(robots, [r.driver for r in rollouts], per_robot(robots, command_scaling), steps)
    truth_to_channels = _Channels(robots, scales)
    force = _Force(robots)
    supply = None if rollouts[0].supply_v is None else np.stack([_held(r.supply_v, steps) for r in rollouts])
    enabled = None if rollouts[0].enabled is None else np.stack([_switched(r.enabled, steps) for r in rollouts])
    external = None if rollouts[0].external is None else np.stack([_held(r.external, steps) for r in rollouts])
    touch, twist = "touch" in kinds, force.needs_twist or bool(kinds & TWIST_KINDS)
    always_pose = pose or bool(kinds & POSE_KINDS)

    count, motors, channels = len(robots), len(first.drives), len(first.sensors)
    sensors = np.empty((steps, count, channels))
    commands = np.empty((steps, count, motors))
    poses = np.empty((steps, count, 7)) if pose else None
    joints = np.empty((steps, count, motors)) if pose else None
    torques = np.empty((steps, count, motors)) if pose else None
    begin: Array | None = None
    torque = np.zeros((count, motors))
    again: dict[int, list[tuple[int, State]]] = {}
    for i, r in enumerate(rollouts):
        for row, state in r.again:
            again.setdefault(row, []).append((i, state))
    for step in range(steps):
        for i, state in again.get(step, ()):
            bodies.put(i, state)
        last = step == steps - 1
        truth = bodies.read(touch, always_pose or step == 0 or last, twist)
        if begin is None:
            begin = truth.base_pose
        reported = sensing.step(step, truth_to_channels(truth, torque, drive.current))
        command = control.step(step, step * dt, reported)
        torque = drive.step(
            step * dt,
            command,
            truth.joints if halfway is None else halfway.middle(),
            truth.speeds,
            None if supply is None else supply[:, step : step + 1],
            None if enabled is None else enabled[:, step : step + 1],
        )
        sensors[step], commands[step] = reported, command
        if poses is not None and joints is not None and torques is not None and truth.base_pose is not None:
            poses[step], joints[step], torques[step] = truth.base_pose, truth.joints, torque
        if not last:
            pulled = torque if external is None else torque + external[:, step]
            bodies.step(pulled, force(step, truth), drive.give)
    assert begin is not None and truth.base_pose is not None
    travel = truth.base_pose[:, 0] - begin[:, 0]
    return [
        log_of(
            first,
            sensors[:, i],
            commands[:, i],
            base_pose=None if poses is None else poses[:, i].copy(),
            joints=None if joints is None else joints[:, i].copy(),
            torques=None if torques is None else torques[:, i].copy(),
            supply_v=None if supply is None else supply[i].copy(),
            travel_m=float(travel[i]),
        )
        for i in range(count)
    ]


def log_of(model: System, sensors: Array, commands: Array, **more: Any) -> SensorLog:
    """The log of one of a batch, from its channels (T, S) and commands (T, M), of which it keeps copies."""
    times: Array = np.arange(len(sensors), dtype=np.float64) * model.time_step_s
    return SensorLog(
        times_s=times,
        sensors=sensors.copy(),
        commands=commands.copy(),
        sensor_names=model.sensor_names,
        sensor_units=tuple(s.unit for s in model.sensors),
        motor_names=model.motor_names,
        **more,
    )


Cut = Callable[[Sequence[Rollout]], Sequence[Sequence[int]]]
"""Which of some rollouts of one shape are run together, batch by batch."""


def up_to(largest: int) -> Cut:
    """Batches of that size, in the order asked."""
    return lambda rollouts: [range(k, min(k + largest, len(rollouts))) for k in range(0, len(rollouts), largest)]


def in_batches(rollouts: Sequence[Rollout], place: Callable[[Sequence[Rollout]], Bodies], cut: Cut) -> list[SensorLog]:
    """Run robots in batches of one shape, the bodies of each placed for it, and return the logs in the order asked."""

    def placed(batch: Sequence[Rollout]) -> list[SensorLog]:
        bodies = place(batch)
        try:
            return run(batch, bodies)
        finally:
            bodies.close()

    return by_shape([_started(r) for r in rollouts], shape_of, cut, placed)


def by_shape(
    rollouts: Sequence[Rollout],
    shape: Callable[[Rollout], Hashable],
    cut: Cut,
    run_batch: Callable[[Sequence[Rollout]], Sequence[SensorLog]],
) -> list[SensorLog]:
    """Sort rollouts into batches of one shape, run each, and return the logs in the order asked."""
    groups: dict[Hashable, list[int]] = {}
    for i, r in enumerate(rollouts):
        groups.setdefault(shape(r), []).append(i)
    logs: dict[int, SensorLog] = {}
    for members in groups.values():
        for chosen in cut([rollouts[i] for i in members]):
            part = [members[k] for k in chosen]
            logs.update(zip(part, run_batch([rollouts[i] for i in part]), strict=True))
    return [logs[i] for i in range(len(rollouts))]


def _goals(rollouts: Sequence[Rollout]) -> Array | None:
    """(B, 4, M) what controllers with limits of their own know of the past (``State.goals``); not a number where they begin at
    their joints."""
    known = [None if r.start is None else r.start.goals for r in rollouts]
    if all(g is None for g in known):
        return None
    return np.stack(
        [np.full((4, len(r.model.drives)), np.nan) if g is None else g for r, g in zip(rollouts, known, strict=True)]
    )


def _started(rollout: Rollout) -> Rollout:
    """The rollout with its robot's own start, where that is not zero and no other was asked for."""
    if rollout.start is not None:
        return rollout
    joints = start_of(rollout.model)
    return replace(rollout, start=State(joints, np.zeros(len(joints)))) if joints.any() else rollout


POSITION, VELOCITY, TORQUE, MOTOR_TORQUE, ANGLE, TOUCH, OF_BASE = range(7)
OF_JOINT = {
    "position": POSITION,
    "velocity": VELOCITY,
    "torque": TORQUE,
    "motor_torque": MOTOR_TORQUE,
    "angle": ANGLE,
}


class _Channels:
    """True values of the channels (B, S) from the true state."""

    def __init__(self, robots: Sequence[Robot], scales: Sequence[tuple[Array, Array]]) -> None:
        first = robots[0]
        motor = {name: k for k, name in enumerate(first.motor_names)}
        touches = iter(range(len(first.sensors)))
        self.shape = (len(robots), len(first.sensors))
        kinds = [TOUCH if s.kind == "touch" else OF_JOINT.get(s.kind, OF_BASE) for s in first.sensors]
        self.kinds = np.array(kinds, dtype=np.intp)
        for sensor, kind in zip(first.sensors, kinds, strict=True):
            if kind in OF_JOINT.values() and sensor.target not in motor:
                raise RobotError(
                    f"sensor {sensor.name!r} shows joint {sensor.target!r}, which no drive moves; there are: {', '.join(motor)}"
                )
        places = [next(touches) if s.kind == "touch" else motor.get(s.target, 0) for s in first.sensors]
        self.places = np.array(places, dtype=np.intp)
        self.of_base = [(k, s.kind) for k, s in enumerate(first.sensors) if kinds[k] == OF_BASE]
        self.middle = np.array([s[0] for s in scales])
        self.half = np.array([s[1] for s in scales])
        self.untouched = np.zeros((len(robots), 0), dtype=bool)

    def __call__(self, truth: Truth, torque: Array, current: Array) -> Array:
        out = np.empty(self.shape)
        touch = self.untouched if truth.touch is None else truth.touch
        at_joint = truth.joints, truth.speeds, torque, current
        _fill(self.kinds, self.places, *at_joint, touch, self.middle, self.half, out)
        for k, kind in self.of_base:
            out[:, k] = _of_base(kind, truth)
        return out


@compiled
def _fill(
    kinds: NDArray[np.intp],
    places: NDArray[np.intp],
    joints: Array,
    speeds: Array,
    torque: Array,
    current: Array,
    touch: NDArray[np.bool_],
    middle: Array,
    half: Array,
    out: Array,
) -> None:
    """The channels (B, S) of joints and touch sensors: channel k is of ``kinds[k]`` and shows motor or sensor ``places[k]``."""
    for k in range(len(kinds)):
        kind, j = kinds[k], places[k]
        for i in range(len(out)):
            if kind == POSITION:
                out[i, k] = joints[i, j]
            elif kind == VELOCITY:
                out[i, k] = speeds[i, j]
            elif kind == TORQUE:
                out[i, k] = torque[i, j]
            elif kind == MOTOR_TORQUE:
                out[i, k] = current[i, j]
            elif kind == ANGLE:
                out[i, k] = (joints[i, j] - middle[i, j]) / half[i, j]
            elif kind == TOUCH:
                out[i, k] = TOUCHING if touch[i, j] else LIFTED


def _of_base(kind: str, truth: Truth) -> Array:
    if kind in TWIST_KINDS:
        assert truth.base_twist is not None
        return truth.base_twist[:, 0 if kind == "speed_x" else 5]
    assert truth.base_pose is not None
    x, y, z, w = truth.base_pose[:, 3:].T
    if kind == "roll":
        return np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    if kind == "pitch":
        return np.arcsin(np.clip(2 * (w * y - z * x), -1.0, 1.0))
    return truth.base_pose[:, {"x": 0, "y": 1, "height": 2}[kind]]


class _Force:
    """Force of the surroundings on the root part: a constant push and drag."""

    def __init__(self, robots: Sequence[Robot]) -> None:
        self.push = np.array([(r.world.push_x_n, r.world.push_y_n, 0.0) for r in robots])
        self.drag = np.array([[r.world.drag_n_s_m] for r in robots])
        self.needs_twist = bool(self.drag.any())
        self.silent = not self.push.any() and not self.needs_twist

    def __call__(self, step: int, truth: Truth) -> Array | None:
        if self.silent:
            return None
        if not self.needs_twist:
            return self.push
        assert truth.base_twist is not None
        return self.push - self.drag * truth.base_twist[:, :3]


def gravity_vector(robot: Robot) -> tuple[float, float, float]:
    """Gravity in the frame of the floor: floor turned by tilt_x about x, then by tilt_y about y."""
    g, a, b = robot.world.gravity_m_s2, robot.world.tilt_x_rad, robot.world.tilt_y_rad
    if a == 0.0 and b == 0.0:
        return (0.0, 0.0, -g)
    return (g * math.sin(b) * math.cos(a), -g * math.sin(a), -g * math.cos(b) * math.cos(a))


def _held(values: Array | None, steps: int) -> Array:
    assert values is not None
    return np.asarray(values)[np.minimum(np.arange(steps), len(values) - 1)]


def _switched(values: Array | None, steps: int) -> Array:
    return (_held(values, steps) > 0).astype(np.float64)
