"""compare: how large the residual is, and where it sits: by channel, by time, by regime, and against what."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ee_dist.discrepancy.evidence.left import may_be_noise
from ee_dist.discrepancy.measured_trial import released
from ee_dist.discrepancy.meters import AtLimit
from ee_dist.discrepancy.problem import Index, Problem, error
from ee_dist.engines.drivers import Commands
from ee_dist.measurements.signals import change
from ee_dist.robots.model import Robot
from ee_dist.trials.log import Array, SensorLog

PARTED = 9.0
"""Square of a value, by the weight of its trial, at which prediction and measurement have parted."""
MOVING_SHARE = 0.05
"""Speed, as a share of the largest one of the joint in the trial, from which a joint counts as moving."""
SPEED_OVER_S = 0.04
"""Time over which a position is averaged before its change is a speed; three readings at least."""
MOVING, AT_REST = "moving", "at rest"
NEAR_LIMIT = 0.8
"""Share of half the range beyond which a joint is near its limit."""


@dataclass(frozen=True)
class ChannelReport:
    """``rmse`` in ``unit``; ``normalised`` in standard deviations of the noise of a value; ``worst_trial`` with its number."""

    name: str
    unit: str
    rmse: float
    normalised: float
    worst_trial: str
    worst_from_s: float
    worst_to_s: float


@dataclass(frozen=True)
class RegimeReport:
    """``error`` over the values of a regime; ``share``, 0 to 1, of the excess over the noise floor that falls in it; ``values``
    is the share of all values that do."""

    name: str
    error: float
    share: float
    values: float


@dataclass(frozen=True, eq=False)
class Comparison:
    """Everything compare says. ``heat``: (segments, channels) root mean square, of values whose floor is ``heat_floor``;
    ``trial_errors`` by trial; ``parted_s``: by trial, when the first three values in a row of a channel stood out, None
    where none did; ``unsure``: channels in which what is left may be noise or not; ``at_limit``: joints whose simulated
    drives are often at their torque limits, where somebody looked."""

    error: float
    noise_floor: float
    floor_source: str
    definition: str
    channels: list[ChannelReport]
    regimes: list[RegimeReport]
    parted_s: dict[str, float | None]
    heat: Array
    trial_errors: list[float]
    unsure: list[str] = field(default_factory=list)
    at_limit: list[AtLimit] = field(default_factory=list)


def compare(problem: Problem, residual: Array) -> Comparison:
    """Where the residual (n,) of a model sits."""
    floor, source = problem.noise_floor()
    names = [f"{t} ({number})" for number, t in zip(problem.numbers, problem.trials, strict=True)]
    return Comparison(
        error(residual),
        floor,
        source,
        problem.error_definition,
        _channels(problem, residual),
        regimes(problem, residual),
        {name: _parted(problem, residual, k) for k, name in enumerate(names)},
        heat(problem, residual),
        [problem.trial_error(residual, k) for k in range(len(problem.trials))],
        may_be_noise(problem, residual),
    )


def trial_name(problem: Problem, trial: int) -> str:
    """With its number, unless it is the only one of its log: repeats have one name."""
    name, number = problem.trials[trial], problem.numbers[trial]
    return name if len(problem.trials) == number == 1 else f"{number}. {name}"


def of_all_regimes(regimes: Sequence[RegimeReport]) -> float:
    """The error of all that is sorted by what joints were doing: what they moved in, and rested in, is all of it."""
    parts = [r for r in regimes if r.name in (MOVING, AT_REST)]
    values = sum(r.values for r in parts)
    return float(np.sqrt(sum(r.error**2 * r.values for r in parts) / values)) if values else 0.0


def heat(problem: Problem, residual: Array) -> Array:
    """(segments, channels) root mean square of a residual (n,), each by the weight of its trial; zero where there is no value."""
    return _rms(problem, residual, problem.segment_of, problem.trial_of_segment)


def has_values(problem: Problem) -> Array:
    """(segments, channels) whether anything was compared there."""
    cell = problem.segment_of * len(problem.channels) + problem.channel_of
    count = np.bincount(cell, minlength=len(problem.segments) * len(problem.channels))
    return np.asarray(count.reshape(len(problem.segments), -1) > 0)


def by_trial(problem: Problem, residual: Array) -> Array:
    """(trials, channels) root mean square of a residual (n,), each by the weight of its trial; zero where there is no value."""
    return _rms(problem, residual, problem.trial_of, np.arange(len(problem.trials)))


def _rms(problem: Problem, residual: Array, row_of: Index, trial_of_row: Index) -> Array:
    """(rows, channels), as ``trial_error`` tells it of a trial."""
    shape = (len(trial_of_row), len(problem.channels))
    cell = row_of * shape[1] + problem.channel_of
    energy = np.bincount(cell, weights=residual**2, minlength=shape[0] * shape[1])
    count = np.bincount(cell, minlength=shape[0] * shape[1])
    weights = np.array([problem.weight_of(k) for k in range(len(problem.trials))])[trial_of_row]
    rms = np.sqrt(np.divide(energy, count, out=np.zeros_like(energy), where=count > 0)).reshape(shape)
    return np.asarray(rms / np.sqrt(weights)[:, None])


def span_of(problem: Problem, segment: int) -> tuple[float, float]:
    """When a segment began and ended, s."""
    times = problem.layout.time_s[problem.segment_of == segment]
    return float(times.min()), float(times.max())


def _channels(problem: Problem, residual: Array) -> list[ChannelReport]:
    raw, out = problem.raw(residual), []
    table = heat(problem, residual)
    for c, name in enumerate(problem.channels):
        mine = problem.channel_of == c
        if not mine.any():
            continue
        worst = int(np.argmax(table[:, c]))
        start, end = span_of(problem, worst)
        values = raw[mine & np.isfinite(raw)]
        out.append(
            ChannelReport(
                name,
                problem.layout.units[c],
                float(np.sqrt(np.mean(values**2))) if len(values) else 0.0,
                float(np.sqrt(np.mean(residual[mine] ** 2))),
                trial_name(problem, int(problem.trial_of_segment[worst])),
                start,
                end,
            )
        )
    return sorted(out, key=lambda r: -r.normalised)


def _parted(problem: Problem, residual: Array, k: int) -> float | None:
    """The time from which three readings in a row stand out in some channel other than touch."""
    layout, first = problem.layout, None
    touch = {s.name for s in problem.robot.sensors if s.kind == "touch"}
    for c in np.flatnonzero([name not in touch for name in problem.channels]):
        mine = np.flatnonzero((problem.trial_of == k) & (problem.channel_of == c) & layout.reading)
        loud = (residual[mine] ** 2 > PARTED * problem.weight_of(k)).astype(int)
        hits = np.flatnonzero(loud[:-2] + loud[1:-1] + loud[2:] == 3)
        if len(hits):
            at = float(layout.time_s[mine[hits[0]]])
            first = at if first is None else min(first, at)
    return first


@dataclass(frozen=True, eq=False)
class Circumstances:
    """What was going on in a trial, by row and joint: (T, M). ``load`` is NaN where no torque was measured, ``down``
    (T, feet)."""

    position: Array
    speed: Array
    command: Array
    load: Array
    down: Array


def circumstances(problem: Problem, k: int) -> Circumstances:
    """From the measured log alone: commands, and position, torque and touch channels where there are any."""
    trial, robot = problem.measured[k], problem.robot
    log = trial.log
    sent = trial.driver.values[: len(log)] if isinstance(trial.driver, Commands) else log.commands
    command, _ = released(np.asarray(sent))
    by_target = {(s.kind, s.target): i for i, s in enumerate(robot.sensors)}

    def of(kind: str, otherwise: Array) -> Array:
        have = [by_target.get((kind, m)) for m in robot.motor_names]
        return np.stack([otherwise[:, j] if i is None else log.sensors[:, i] for j, i in enumerate(have)], axis=1)

    feet = [i for i, s in enumerate(robot.sensors) if s.kind == "touch"]
    torques = log.torques if log.torques is not None else np.full_like(command, np.nan)
    position = of("position", log.joints if log.joints is not None else command)
    return Circumstances(
        position,
        of("velocity", _change(position, log)),
        command,
        of("torque", torques),
        log.sensors[:, feet] > 0,
    )


def _change(position: Array, log: SensorLog) -> Array:
    """The speed (T, M) of positions. Of what was read: a command may be a torque, and one that is held from row to row stands
    still between them."""
    read = log.readings
    if len(read) < 4:
        return np.zeros_like(position)
    speed = change(position[read], float(np.median(np.diff(log.times_s[read]))), SPEED_OVER_S)
    return np.stack([np.interp(log.times_s, log.times_s[read], s) for s in speed.T], axis=1)


def rows_of(problem: Problem, k: int, times_s: Array) -> Array:
    """Rows of a trial's log at some times of it."""
    log = problem.measured[k].log
    step = float(np.median(np.diff(log.times_s)))
    return np.clip(np.round(times_s / step).astype(int), 0, len(log) - 1)


def foot_of_motor(robot: Robot) -> list[int | None]:
    """For each motor the touch sensor at the end of its limb."""
    feet = [s.target for s in robot.sensors if s.kind == "touch"]
    out: list[int | None] = []
    for motor in robot.motor_names:
        carried = robot.subtree(robot.joint(motor).child)
        hits = [i for i, f in enumerate(feet) if f in carried]
        out.append(hits[0] if len(hits) == 1 else None)
    return out


def regimes(problem: Problem, residual: Array) -> list[RegimeReport]:
    """The residual of joint channels, sorted by what their joint was doing."""
    robot, layout, feet = problem.robot, problem.layout, foot_of_motor(problem.robot)
    gathered: dict[str, list[tuple[float, float, int]]] = {}
    excess, count = 0.0, 0
    for k in range(len(problem.trials)):
        c = circumstances(problem, k)
        for i, j in enumerate(layout.joint_of_channel):
            mine = np.flatnonzero((problem.trial_of == k) & (problem.channel_of == i) & layout.reading)
            if j is None or not len(mine):
                continue
            at = rows_of(problem, k, layout.time_s[mine])
            energy, floor = residual[mine] ** 2, layout.floor[mine]
            for name, mask in _states(robot, c, j, feet[j], at).items():
                if mask.any():
                    part = (float(energy[mask].sum()), float(floor[mask].sum()), int(mask.sum()))
                    gathered.setdefault(name, []).append(part)
            excess += float(energy.sum() - floor.sum())
            count += len(mine)
    out = []
    for name, parts in gathered.items():
        whole, noise, values = (float(sum(p[q] for p in parts)) for q in range(3))
        # Of next to no excess a part may be many times it, and another as much less.
        share = min(max((whole - noise) / excess, 0.0), 1.0) if excess > 0 else 0.0
        out.append(RegimeReport(name, float(np.sqrt(whole / values)), share, values / max(count, 1)))
    return out


def _states(robot: Robot, c: Circumstances, j: int, foot: int | None, at: Array) -> dict[str, Array]:
    """Which of the rows ``at`` a joint spent in which regime."""
    joint = robot.joint(robot.motor_names[j])
    speed, position, load = c.speed[at, j], c.position[at, j], c.load[at, j]
    moving = np.abs(speed) > MOVING_SHARE * max(float(np.abs(c.speed[:, j]).max()), 1e-12)
    found = {
        MOVING: moving, AT_REST: ~moving, "moving up": moving & (speed > 0), "moving down": moving & (speed < 0)
    }  # fmt: skip
    low, high = joint.ends
    half, middle = (high - low) / 2, (high + low) / 2
    if np.isfinite(half):
        near = np.abs(position - middle) > NEAR_LIMIT * half
        found |= {"near a limit": near, "away from limits": ~near}
    if np.isfinite(load).all():
        high = np.abs(load) > np.median(np.abs(c.load[:, j]))
        found |= {"high load": high, "low load": ~high}
    if foot is not None:
        found |= {"foot down": c.down[at, foot], "foot up": ~c.down[at, foot]}
    return found
