"""The ways of comparing by name, and the problem that measurements make under one of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ee_dist.basics.names import listed
from ee_dist.discrepancy.as_held import taken_in_steps, times_the_noise
from ee_dist.discrepancy.problem import Problem
from ee_dist.discrepancy.search.search import Progress
from ee_dist.discrepancy.ways.force_balance.cancel import CANCELLED
from ee_dist.discrepancy.ways.force_balance.motion import motor_torques, torques_known
from ee_dist.discrepancy.ways.force_balance.problem import ForceBalance
from ee_dist.discrepancy.ways.free_run.problem import FreeRun
from ee_dist.discrepancy.ways.free_run.windows import RESTART_S, led
from ee_dist.discrepancy.ways.open_loop.problem import OpenLoop
from ee_dist.discrepancy.words import percent
from ee_dist.effects.targets import gains_are_known
from ee_dist.engines.one_joint import fits
from ee_dist.measurements.errors import MeasurementError
from ee_dist.robots.model import Robot
from ee_dist.tasks.config import AUTO, Config, ConfigError, one_of
from ee_dist.tasks.measurements import Measurements
from ee_dist.tasks.wiring import ONE_JOINT, evaluator_of
from ee_dist.trials.log import SensorLog


@dataclass(frozen=True)
class Way:
    """``build`` makes the problem; ``why`` is what speaks for it; ``moves``: whether it can follow a body that moves about;
    ``commanded``: whether it needs to know what the drives were told; ``beside``: another way that these logs allow."""

    name: str
    why: str
    build: Callable[[Measurements, Config], Problem]
    moves: bool = False
    commanded: bool = True
    beside: str = ""

    def instead(self, left: bool) -> tuple[str, ...]:
        """What to say of the other way where this one has more than noise ``left``, in lines for people."""
        return (f"{self.beside}.",) if left and self.beside else ()

    def make(self, measured: Measurements, config: Config) -> Problem:
        """The problem. Where nobody knows whether drives held their commands from row to row, what the robot as it is described
        leaves tells of somebody's simulation; drives of a robot do (``discrepancy/as_held.py``)."""
        if not self.commanded or all(t.commands_held is not None for t in measured.trials):
            return self.build(measured, config)
        steps, held = (self.build(_as_held(measured, held), config) for held in (False, True))
        return steps if taken_in_steps(times_the_noise(steps), times_the_noise(held)) else held

    def searched(self, measured: Measurements, config: Config, progress: Progress) -> Problem:
        """What a search goes by, of the problem; that it takes a while is told in ``progress``."""
        progress("weighing the measurements", 0.0)
        problem = self.make(measured, config).searched
        progress("weighing the measurements", 1.0)
        return problem

    def as_read(self, measured: Measurements, config: Config, like: Problem) -> Problem:
        """The problem of other trials of the same robot, whose commands are taken as those of another problem are: one recording
        is not read in two ways."""
        held = {t.commands_held for t in like.measured} - {None}
        return self.make(_as_held(measured, held.pop()) if len(held) == 1 else measured, config)


def _as_held(measured: Measurements, held: bool | None) -> Measurements:
    trials = [t if t.commands_held is not None else replace(t, commands_held=held) for t in measured.trials]
    return replace(measured, trials=tuple(trials))


def open_loop(measured: Measurements, config: Config) -> OpenLoop:
    return OpenLoop(
        measured.trials,
        measured.robot,
        evaluator_of(config),
        unmodelled=measured.unmodelled,
        gained=measured.gained,
        before=measured.model,
    )


def _free_run(measured: Measurements, config: Config) -> Problem:
    """On torques alone a simulation drifts away within a second, whatever the model: it is started anew so often."""
    robot = measured.robot
    windows_s = None if led(robot) else RESTART_S
    return FreeRun(measured.trials, robot, evaluator_of(config, ONE_JOINT if fits(robot) else ""), windows_s=windows_s)


def _force_balance(measured: Measurements, config: Config) -> Problem:
    return ForceBalance(measured.trials, measured.robot)


WAYS: dict[str, Way] = {
    w.name: w
    for w in (
        Way("open_loop", "commands were recorded: every channel is compared on them", open_loop, moves=True),
        Way("free_run", "joint positions were recorded: the model runs freely from the measured state", _free_run),
        Way(
            "force_balance",
            "torques of the drives were recorded: they are set against what the motion needed, nothing is simulated",
            _force_balance,
            commanded=False,
        ),
    )
}
"""All ways by name. To add one is to write a ``Problem`` and put it here."""


def _seen(measured: Measurements) -> bool:
    """Whether a motion was recorded that a simulation can start from and be set against."""
    positions = any(s.kind == "position" for s in measured.robot.sensors)
    return positions and all(t.log.joints is not None for t in measured.trials)


def _driven(log: SensorLog) -> bool:
    """Whether the log tells at any time what all drives were told."""
    return bool(np.isfinite(log.commands).all(axis=1).any())


def _all_driven(measured: Measurements) -> bool:
    return all(_driven(t.log) for t in measured.trials)


def undriven(measured: Measurements) -> str:
    """The name of a trial that holds no commands; empty where all do."""
    return next((t.name for t in measured.trials if not _driven(t.log)), "")


def _nothing_commanded(measured: Measurements, by: str) -> str:
    return (
        f"task.by={by}: trial {undriven(measured)} holds no commands, so there is nothing to simulate it by; with torques of "
        "the drives in the log task.by=force_balance compares it, otherwise import it with its commands"
    )


def known_way(by: str) -> None:
    """Raises ConfigError where there is no such way: to be said before logs are read."""
    one_of("task.by", by, (AUTO, *WAYS))


def way_of(measured: Measurements, by: str) -> Way:
    """The way asked for; for ``auto`` that of a calibration, else what the channels allow and tell most by. Raises ConfigError
    for one that cannot be."""
    known_way(by)
    driven = _all_driven(measured)
    if by == AUTO and measured.calibrated_by:
        return _possible(WAYS[measured.calibrated_by], measured)
    if by == AUTO:
        torques = all(_forces_known(t.log, measured.robot, all_of_them=driven) for t in measured.trials)
        held = led(measured.robot) or measured.robot.free_base
        by = "open_loop" if (driven and held) or not torques else "force_balance"
        if driven and not held and _seen(measured):
            # A controller may stand behind recorded torques (an arm's currents), so forces are balanced where they were measured
            # and tell anything.
            weak = _weak(measured) if torques else _some_unknown(measured)
            if weak or not torques:
                return _possible(replace(WAYS["free_run"], why=weak or WAYS["free_run"].why), measured)
        if by == "open_loop" and _only_motion(measured):
            return _possible(replace(WAYS["free_run"], why=ONLY_MOTION), measured)
        if by == "open_loop" and torques and not measured.robot.free_base:
            gains = "" if gains_are_known(measured.robot) else GUESSED
            beside = TORQUES_TOO.format(gains=gains)
            return _possible(replace(WAYS[by], why=f"{WAYS[by].why}. {beside}", beside=beside), measured)
    return _possible(WAYS[by], measured)


def _forces_known(log: SensorLog, robot: Robot, all_of_them: bool) -> bool:
    """Whether a balance of forces has what it needs: torques of some drives, or ``all_of_them``, for where commands say how the
    robot was driven, a simulation judges every joint."""
    torques = None if log.joints is None else motor_torques(log, robot)
    return torques is not None and (not all_of_them or len(torques_known(torques)) == len(robot.drives))


def _some_unknown(measured: Measurements) -> str:
    """Why torques that were recorded at some joints are not balanced; empty where none were."""
    robot = measured.robot
    forces = [None if t.log.joints is None else motor_torques(t.log, robot) for t in measured.trials]
    known = set.intersection(*(set() if f is None else set(torques_known(f)) for f in forces))
    names = [d.joint for k, d in enumerate(robot.drives) if k not in known]
    if not known or not names:
        return ""
    return (
        f"torques were recorded, and none of {listed(names)}, where a balance of forces would judge nothing: the model runs "
        "freely from the measured state on the commands"
    )


TORQUES_TOO = "Torques of the drives were recorded too: task.by=force_balance compares these{gains}"
GUESSED = ", and asks nothing of gains, which the description only assumed"
ONLY_MOTION = (
    "of a real robot, positions and commands were recorded: the model runs freely from the measured state (faults of sensors "
    "are told by task.by=open_loop alone)"
)


def _only_motion(measured: Measurements) -> bool:
    """Whether the log is of a real robot, or may be, that is bolted down, and has nothing but the motion of its joints. Open loop
    does as well, but where a joint sticks or the first moments are off: what went wrong once is in all that follows."""
    robot = measured.robot
    real = measured.real and len(robot.drives) <= FEW_JOINTS
    return real and not robot.free_base and _seen(measured) and all(s.kind in MOTION for s in robot.sensors)


FEW_JOINTS = 2
"""Joints up to which one that sticks decides the whole error. With more, open loop foretells as well, by likelier values."""
MOTION = frozenset({"position", "velocity"})


def _weak(measured: Measurements) -> str:
    """Why a balance of forces would tell little of these torques; empty where it tells much."""
    try:
        problem = ForceBalance(measured.trials, measured.robot)
    except MeasurementError:
        return "the noise of the positions hides what forces did: the model runs freely from the measured state"
    if problem.left_to_give >= CANCELLED or problem.doubts:
        return ""
    return (
        f"gravity and inertia cancel in these motions but for {percent(problem.left_to_give)}, so that torques tell little: "
        "the model runs freely from the measured state"
    )


def _possible(way: Way, measured: Measurements) -> Way:
    """The way itself. Raises ConfigError where it cannot be."""
    by = way.name
    if way.commanded and not _all_driven(measured):
        raise ConfigError(_nothing_commanded(measured, by))
    if measured.robot.free_base and not way.moves:
        raise ConfigError(f"task.by={by}: {measured.robot.name} moves about; use task.by=open_loop")
    if measured.calibrated_by and measured.calibrated_by != by:
        raise ConfigError(
            f"task.by={by}: the model was calibrated with task.by={measured.calibrated_by}; compare it that way, or name a model "
            "without a calibration beside it"
        )
    return way
