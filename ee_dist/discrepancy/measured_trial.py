"""A measured trial: what drove the robot, and the sensor log that came back."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
import scipy  # which loads its parts when they are used: signals take a second

from ee_dist.discrepancy.past import Past, limited
from ee_dist.discrepancy.steps import SPEEDS, between_steps, held
from ee_dist.effects.catalogue import Hypothesis, applied, term
from ee_dist.effects.fixture import STAND
from ee_dist.engines.contract import Rollout
from ee_dist.engines.drivers import Commands, Driver, Network
from ee_dist.engines.halfway import goes_halfway
from ee_dist.robots.model import Robot, Sensor
from ee_dist.trials.excitation import Excitation
from ee_dist.trials.log import Array, SensorLog, State

SMOOTHED, SMOOTH_ORDER = 15, 2
"""Rows that a parabola is laid through to smooth a noisy speed; its order."""


@dataclass(frozen=True, eq=False)
class Begun:
    """How a stretch from within a record begins: with its joints where they were measured, after this ``past``."""

    state: State
    past: Past

    @property
    def after_s(self) -> float:
        """How long the record had lasted."""
        return self.past.begin * self.past.step_s

    def start(self, model: Robot) -> State:
        """With the goals to which limited controllers of a model have come."""
        return replace(self.state, goals=self.past.goals(model)) if any(map(limited, model.drives)) else self.state

    def later(self, model: Robot) -> Robot:
        """The model whose clocks begin with the record, as one whose begin with the stretch: what sticks from some time on."""
        if not any(s.stuck and s.stuck_from_s for s in model.sensors):
            return model
        sensors = tuple(replace(s, stuck_from_s=max(0.0, s.stuck_from_s - self.after_s)) for s in model.sensors)
        return replace(model, sensors=sensors)


@dataclass(frozen=True, eq=False)
class MeasuredTrial:
    """``driver`` is what the experimenter sent; None where only the log's own commands are known.

    Trials of one ``name`` are repeats of one another: the noise floor is measured from them. ``setup`` is what is known
    to be special about the trial (a gain, a payload); it is applied on top of any hypothesis. ``commands_held``:
    whether the drives held each command until the next one, as those of real robots do, rather than obeyed it in one step of a
    simulation; None where that is not known yet.
    """

    name: str
    log: SensorLog
    driver: Driver | None = None
    setup: Hypothesis = ()
    commands_held: bool | None = False
    hardware: bool = False
    """Whether it is known to be no simulation of ours, whatever became of its commands."""
    on_lines: bool = False
    """Whether commands go on by straight lines from row to row."""
    begun: Begun | None = None
    """Of a stretch from within a record, how it begins."""
    not_recorded: frozenset[str] = frozenset()
    """Sensors that nobody recorded in it: its log holds where they are taken to have stood, and nothing of that is compared."""
    number: int = 0
    """Its number in its log, from 1 on; 0: it is counted with those that stand beside it."""

    def recorded(self, robot: Robot) -> Array:
        """(S,) which of a robot's channels were recorded."""
        return np.array([s.name not in self.not_recorded for s in robot.sensors], dtype=bool)

    @property
    def real(self) -> bool:
        """Whether it is of somebody's hardware, or was simulated elsewhere."""
        return self.hardware or self.commands_held is not False

    def obeyed(self, commands: Array, robot: Robot) -> Array:
        """Commands (T, M) as the steps of a simulation take them. Those on lines are about their row what they are in it."""
        return held(commands) if self.commands_held and not self.on_lines and not goes_halfway(robot) else commands

    def early(self, robot: Robot) -> tuple[int, ...]:
        """The channels that a simulation reads half a step before their row."""
        if not self.commands_held or goes_halfway(robot):
            return ()
        return tuple(i for i, s in enumerate(robot.sensors) if s.kind in SPEEDS)

    def models(self, robot: Robot, hypotheses: Iterable[Hypothesis]) -> list[Robot]:
        """The robot in this trial by each hypothesis. What is known of the trial comes last: a load that was weighed is none of a
        part that is lighter than described."""
        return applied(robot, [(*h, *self.setup) for h in hypotheses])

    def simulated(self, model: Robot) -> Robot:
        """The model as the steps of a simulation take it."""
        return between_steps(model) if self.commands_held else model


def shown(rollout: Rollout, beside: Sequence[Sensor] = ()) -> Rollout:
    """The rollout for people to look at: with the poses of all parts, and after its own channels those of sensors ``beside`` the
    robot's, which commands that were recorded do not listen to."""
    model = rollout.model
    return replace(rollout, model=replace(model, sensors=(*model.sensors, *beside)) if beside else model, pose=True)


def driver_of(excitation: Excitation, robot: Robot) -> Commands | Network:
    """What makes the robot do it."""
    weights = excitation.weights(robot)
    return Commands(excitation.commands(robot)) if weights is None else Network(weights)


def setup_of(excitation: Excitation) -> Hypothesis:
    """How the robot is held."""
    return (term(STAND),) if excitation.fixture == "stand" else ()


def released(commands: Array) -> tuple[Array, Array | None]:
    """Commands (T, M) with numbers everywhere, and (T,) 0 where the drives were released, if they were.

    A released drive obeys no command: its command is NaN in the log.
    """
    gone = ~np.isfinite(commands).all(axis=1)
    if not gone.any():
        return commands, None
    rows = np.where(gone, 0, np.arange(len(commands)))
    first = int(np.argmin(gone))
    return np.nan_to_num(commands[np.maximum(np.maximum.accumulate(rows), first)]), (~gone).astype(float)


def evenly_read(log: SensorLog) -> SensorLog:
    """The log at the rate of its readings, where rows between them were filled in; straight lines between uneven ones."""
    if log.filled is None:
        return log
    read = log.readings
    known_s, before = log.times_s[read], log.times_s - 1e-9
    at_s = np.arange(known_s[0], known_s[-1], float(np.median(np.diff(known_s))))
    rows = np.searchsorted(before, at_s, side="right") - 1

    def lines(values: Array | None) -> Array | None:
        if values is None:
            return None
        columns = values[read].reshape(len(read), -1).T
        return np.stack([np.interp(at_s, known_s, c) for c in columns], axis=1).reshape(len(at_s), *values.shape[1:])

    sensors = lines(log.sensors)
    assert sensors is not None
    return replace(
        log,
        times_s=at_s,
        sensors=sensors,
        commands=log.commands[rows],
        base_pose=lines(log.base_pose),
        joints=lines(log.joints),
        torques=lines(log.torques),
        supply_v=lines(log.supply_v),
        external=lines(log.external),
        filled=None,
    )


def reading_s(trials: Iterable[MeasuredTrial]) -> float:
    """Time from one reading of the sensors to the next, s, in the trial where that is longest; 0 where all were read in
    every row."""
    seldom = [t.log for t in trials if t.log.filled is not None]
    return max((float(np.median(np.diff(log.times_s[log.readings]))) for log in seldom), default=0.0)


def read_every(log: SensorLog, every_s: float) -> SensorLog:
    """A simulated log as if its sensors had been read every ``every_s`` (0: in every row), from its first row on."""
    if not every_s or len(log) < 2:
        return log
    rows = np.arange(0.0, len(log) - 0.5, max(1.0, every_s / float(log.times_s[1] - log.times_s[0])))
    filled = np.ones(len(log), dtype=bool)
    filled[np.round(rows).astype(int)] = False
    return replace(log, filled=filled) if filled.any() else log


def speeds_of(log: SensorLog, robot: Robot) -> Array:
    """Measured speeds (T, M); slopes of the positions where a joint has no sensor for it. Of a sensor that is known to
    be noisy, a smooth course: a start that is off by the noise of one row goes on for seconds."""
    return read_speeds(log, speed_sensors(robot), goes_halfway(robot))


SpeedSensors = tuple[tuple[int, int, float], ...]
"""Joint, channel, and declared noise (as the channel counts), of each sensor of a speed."""


def speed_sensors(robot: Robot) -> SpeedSensors:
    """Those of a robot's joints."""
    place = {motor: k for k, motor in enumerate(robot.motor_names)}
    return tuple(
        (place[s.target], c, s.noise) for c, s in enumerate(robot.sensors) if s.kind == "velocity" and s.target in place
    )


SUDDEN = 4.0
"""Standard deviations of its noise by which a reading of a speed parts from the smooth course of its neighbours by sudden
motion alone."""
AT_REST = 1.5
"""Steps' changes of speed up to which a joint that began to move had been at rest."""
SMOOTH = 0.5
"""Share of half a step's change of a speed by which it differs from row to row: acceleration does by less, noise by more."""


def _slopes(joints: Array, step_s: float, halfway: bool) -> Array:
    """(T, M) speeds from positions (T, M). A simulation moves a joint in each step by the speed that it has at its end, unless
    it goes by half steps (``halfway``): where positions are exact enough to tell, that is the speed of a row, and not that about
    it."""
    about = np.gradient(joints, step_s, axis=0)
    if len(joints) < 4:
        return np.asarray(about)
    if halfway:
        about[0] = (4.0 * joints[1] - 3.0 * joints[0] - joints[2]) / (2.0 * step_s)
        return np.asarray(about)
    moved = np.diff(joints, axis=0) / step_s
    # What has the speed of a single step was at rest before it.
    change = moved[1:2] - moved[:1]
    first = np.where(np.abs(moved[:1]) <= AT_REST * np.abs(change), 0.0, moved[:1] - change)
    behind = np.concatenate([first, moved])
    half = behind - about
    exact = np.abs(np.diff(half, axis=0)).mean(axis=0) < SMOOTH * np.abs(half).mean(axis=0)
    return np.where(exact, behind, about)


@lru_cache(maxsize=32)
def read_speeds(log: SensorLog, read: SpeedSensors, halfway: bool = False) -> Array:
    """The same of known sensors, of a robot that goes by half steps or not. Kept: a search asks for it with every model."""
    assert log.joints is not None
    out = _slopes(log.joints, float(np.median(np.diff(log.times_s))), halfway)
    for k, c, noise in read:
        out[:, k] = _course(log.sensors[:, c], noise)
    out.setflags(write=False)
    return out


def first_speeds_off(log: SensorLog, read: SpeedSensors, joints: int) -> Array:
    """(M,) of ``joints``: standard deviations of the first of the speeds that ``read_speeds`` knows, by the noise that sensors
    declare; 0 where they declare none."""
    out = np.zeros(joints)
    for k, c, noise in read:
        seen = log.sensors[:, c]
        parts = float(_course(seen, noise)[0] - seen[0])
        if parts == 0.0:
            out[k] = noise
            continue
        # The noise of a curve's end, and what the curve parts from the reading by beyond it.
        end = float(np.linalg.norm(scipy.signal.savgol_coeffs(SMOOTHED, SMOOTH_ORDER, pos=0, use="dot")))
        out[k] = np.sqrt((end * noise) ** 2 + max(parts**2 - noise**2, 0.0))
    return out


def _course(seen: Array, noise: float) -> Array:
    """(T,) speeds by the readings of a sensor: a smooth course through them, if it is known to be noisy. Where a joint starts or
    stops within a few rows it is the curve that is wrong, and by more than any noise."""
    if not noise or len(seen) <= SMOOTHED:
        return seen
    smooth = scipy.signal.savgol_filter(seen, SMOOTHED, SMOOTH_ORDER)
    return np.where(np.abs(smooth - seen) > SUDDEN * noise, seen, smooth)


ONE_PACE = 0.9
"""Share of the slowest trial's step above which another is read as fast."""


def at_one_pace(logs: Sequence[SensorLog]) -> tuple[list[SensorLog], float]:
    """The logs with those that are read faster thinned to the pace of the slowest, so that whatever is done to all of them at a
    share of their rate is the same to each, and that pace, s. Paces that differ by less than a tenth are one."""
    steps = [float(np.median(np.diff(log.times_s))) for log in logs]
    slowest = max(steps)
    thinned = [
        evenly_read(read_every(log, slowest)) if step < ONE_PACE * slowest else log
        for log, step in zip(logs, steps, strict=True)
    ]
    return thinned, slowest
