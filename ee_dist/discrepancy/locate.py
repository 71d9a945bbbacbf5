"""compare: how large the residual is, and where it sits: by channel, by time, by regime, and against what."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ee_dist.discrepancy.open_loop import OpenLoop
from ee_dist.discrepancy.problem import error
from ee_dist.engines.drivers import Commands
from ee_dist.robots.model import Robot
from ee_dist.trials.log import Array

PARTED = 9.0
"""Mean square of a block's residuals, over its noise floor, at which prediction and measurement have parted."""
MOVING_SHARE = 0.02
"""Commanded speed, as a share of the joint's range per second times ten, from which a joint counts as moving."""
NEAR_LIMIT = 0.8
"""Share of half the range beyond which a joint is near its limit."""


@dataclass(frozen=True)
class ChannelReport:
    """``rmse`` in ``unit``; ``normalised`` in standard deviations of the noise of a block mean."""

    name: str
    unit: str
    rmse: float
    normalised: float
    worst_trial: str
    worst_from_s: float
    worst_to_s: float


@dataclass(frozen=True)
class RegimeReport:
    """``error`` over the values of a regime; ``share`` of the excess over the noise floor that falls in it; ``values``
    is the share of all values that do."""

    name: str
    error: float
    share: float
    values: float


@dataclass(frozen=True, eq=False)
class Comparison:
    """Everything compare says. ``heat``: (segments, channels) root mean square; ``parted_s``: by trial, when the first
    block in a row of three stood out, None where none did."""

    error: float
    noise_floor: float
    floor_source: str
    definition: str
    channels: list[ChannelReport]
    regimes: list[RegimeReport]
    parted_s: dict[str, float | None]
    heat: Array
    trial_errors: list[float]


def compare(problem: OpenLoop, residual: Array) -> Comparison:
    """Where the residual (n,) of a model sits."""
    floor, source = problem.noise_floor()
    cells = np.zeros((len(problem.segments), len(problem.channels)))
    counts = np.zeros_like(cells)
    np.add.at(cells, (problem.segment_of, problem.channel_of), residual**2)
    np.add.at(counts, (problem.segment_of, problem.channel_of), 1.0)
    heat = np.sqrt(np.divide(cells, counts, out=np.zeros_like(cells), where=counts > 0))
    return Comparison(
        error(residual),
        floor,
        source,
        problem.error_definition,
        _channels(problem, heat, cells, counts, residual),
        regimes(problem, residual),
        {f"{t} ({k + 1})": _parted(problem, residual, k) for k, t in enumerate(problem.trials)},
        heat,
        [error(residual[s]) for s in problem.slices],
    )


def _channels(problem: OpenLoop, heat: Array, cells: Array, counts: Array, residual: Array) -> list[ChannelReport]:
    out = []
    width = problem.window * problem.robot.time_step_s
    raw = [problem.raw_blocks(k, residual) for k in range(len(problem.trials))]
    for c, name in enumerate(problem.channels):
        if not counts[:, c].any():
            continue
        worst = int(np.argmax(heat[:, c]))
        start = float(problem.segments[worst].rsplit("@", 1)[1][:-1])
        sensor = next((s for s in problem.robot.sensors if s.name == name), None)
        if sensor is not None:
            values = np.concatenate([r[:, c] for r in raw])
            unit = sensor.unit
        else:
            values, unit = residual[problem.channel_of == c] * problem.command_scale(name), "rad"
        out.append(
            ChannelReport(
                name,
                unit,
                float(np.sqrt(np.mean(values**2))),
                float(np.sqrt(cells[:, c].sum() / counts[:, c].sum())),
                problem.trials[int(problem.trial_of_segment[worst])],
                start,
                start + width,
            )
        )
    return sorted(out, key=lambda r: -r.normalised)


def _parted(problem: OpenLoop, residual: Array, k: int) -> float | None:
    """The time from which three blocks in a row stand out in some channel other than touch."""
    blocks = problem.blocks(k, residual)
    quiet = np.array([s.kind != "touch" for s in problem.robot.sensors])
    loud = (blocks[:, quiet] ** 2 > PARTED).astype(int)
    runs = loud[:-2] + loud[1:-1] + loud[2:] == 3
    hits = np.flatnonzero(runs.any(axis=1))
    return None if not len(hits) else float(hits[0] * problem.block * problem.robot.time_step_s)


@dataclass(frozen=True, eq=False)
class Circumstances:
    """What was going on at each block of a trial, by joint: (blocks, M). ``load`` is NaN where no torque was measured,
    ``down`` (blocks, feet)."""

    position: Array
    speed: Array
    command: Array
    load: Array
    down: Array


def circumstances(problem: OpenLoop, k: int) -> Circumstances:
    """From the measured log alone: commands, and torque and touch channels where there are any."""
    trial, robot, size = problem.measured[k], problem.robot, problem.block
    log = trial.log
    command = trial.driver.values[: len(log)] if isinstance(trial.driver, Commands) else log.commands
    dt = robot.time_step_s

    def means(values: Array) -> Array:
        rows = len(values) // size
        return values[: rows * size].reshape(rows, size, -1).mean(axis=1)

    by_target = {(s.kind, s.target): i for i, s in enumerate(robot.sensors)}

    def of(kind: str, otherwise: Array) -> Array:
        have = [by_target.get((kind, m)) for m in robot.motor_names]
        columns = [otherwise[:, j] if i is None else log.sensors[:, i] for j, i in enumerate(have)]
        return means(np.stack(columns, axis=1))

    feet = [i for i, s in enumerate(robot.sensors) if s.kind == "touch"]
    return Circumstances(
        of("position", command),
        means(np.gradient(command, dt, axis=0)),
        means(command),
        of("torque", np.full_like(command, np.nan)),
        means(log.sensors[:, feet]) > 0,
    )


def joint_of_channel(robot: Robot) -> list[int | None]:
    """For each sensor the motor that it belongs to."""
    names = list(robot.motor_names)
    return [names.index(s.target) if s.target in names else None for s in robot.sensors]


def foot_of_motor(robot: Robot) -> list[int | None]:
    """For each motor the touch sensor at the end of its limb."""
    feet = [s.target for s in robot.sensors if s.kind == "touch"]
    out: list[int | None] = []
    for motor in robot.motor_names:
        carried = robot.subtree(robot.joint(motor).child)
        hits = [i for i, f in enumerate(feet) if f in carried]
        out.append(hits[0] if len(hits) == 1 else None)
    return out


def regimes(problem: OpenLoop, residual: Array) -> list[RegimeReport]:
    """The residual of joint channels, sorted by what their joint was doing."""
    robot = problem.robot
    joints, feet = joint_of_channel(robot), foot_of_motor(robot)
    gathered: dict[str, list[Array]] = {}
    floors: dict[str, float] = {}
    excess_all, count_all = 0.0, 0
    for k in range(len(problem.trials)):
        blocks, c, floors_of = problem.blocks(k, residual), circumstances(problem, k), problem.block_floor(k)
        for i, j in enumerate(joints):
            if j is None:
                continue
            joint = robot.joint(robot.motor_names[j])
            half, middle = (joint.upper - joint.lower) / 2, (joint.upper + joint.lower) / 2
            e, floor = blocks[:, i] ** 2, floors_of[:, i]
            moving = np.abs(c.speed[:, j]) > MOVING_SHARE * half * 10
            near = np.abs(c.position[:, j] - middle) > NEAR_LIMIT * half
            sorted_by: dict[str, Array] = {
                "moving": moving, "at rest": ~moving, "moving up": moving & (c.speed[:, j] > 0),
                "moving down": moving & (c.speed[:, j] < 0), "near a limit": near, "away from limits": ~near,
            }  # fmt: skip
            if np.isfinite(c.load[:, j]).all():
                high = np.abs(c.load[:, j]) > np.median(np.abs(c.load[:, j]))
                sorted_by |= {"high load": high, "low load": ~high}
            foot = feet[j]
            if foot is not None:
                sorted_by |= {"foot down": c.down[:, foot], "foot up": ~c.down[:, foot]}
            for name, mask in sorted_by.items():
                gathered.setdefault(name, []).append(e[mask])
                floors[name] = floors.get(name, 0.0) + float(floor[mask].sum())
            excess_all += float(e.sum() - floor.sum())
            count_all += len(e)
    out = []
    for name, parts in gathered.items():
        values = np.concatenate(parts)
        if len(values):
            share = (float(values.sum()) - floors[name]) / excess_all if excess_all > 0 else 0.0
            out.append(RegimeReport(name, float(np.sqrt(values.mean())), share, len(values) / max(count_all, 1)))
    return out
