"""Logs to look at on the workbench: of a simulated robot with a hidden effect, as many trials and rows as asked for."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ee_dist.discrepancy.measured_trial import driver_of
from ee_dist.effects.catalogue import apply
from ee_dist.engines.contract import Rollout
from ee_dist.engines.drivers import Commands
from ee_dist.recording.records import HARDWARE, TrialRecord
from ee_dist.recording.writer import RunWriter
from ee_dist.robots.model import Robot
from ee_dist.robots.quadruped_lab import quadruped_lab
from ee_dist.robots.servo_pendulum import servo_pendulum
from ee_dist.tasks.trial import hypothesis
from ee_dist.tasks.wiring import EngineMaker
from ee_dist.trials.excitation import parse
from ee_dist.trials.noise import with_noise

NOISE = 0.005


@dataclass(frozen=True)
class Log:
    """``effect`` is what is hidden, and what the slider is for; ``plan``: the excitations, one for each trial."""

    name: str
    robot: Robot
    effect: str
    plan: tuple[str, ...]

    @property
    def size(self) -> str:
        robot, first = self.robot, parse(self.plan[0])
        trials = "one trial" if len(self.plan) == 1 else f"{len(self.plan)} trials"
        return f"{self.name}, {trials} of {first.seconds:g} s at {1 / robot.time_step_s:.0f} Hz"


PENDULUM = Log("pendulum", servo_pendulum(), "coulomb_friction@servo", ("multisine:seconds=4,amplitude=0.5,seed=1",))
QUADRUPED = Log(
    "quadruped", quadruped_lab(), "coulomb_friction@knee_front_left", ("sway:seconds=4.2,amplitude=0.1,seed=1",)
)
LONG = Log(
    "pendulum",
    servo_pendulum(time_step_s=0.002),
    "coulomb_friction@servo",
    tuple(f"multisine:seconds=60,amplitude=0.5,seed={k}" for k in range(20)),
)


def written(log: Log, path: Path) -> None:
    """The recording at ``path``, as task=trial writes it; all trials simulated at once."""
    robot = with_noise(log.robot, NOISE)
    hidden = hypothesis(log.effect, robot, np.random.SeedSequence(0))
    changed = apply(robot, hidden)
    plan = [parse(text) for text in log.plan]
    drivers = [d for e in plan if isinstance(d := driver_of(e, robot), Commands)]  # none of them walks by a network
    asked = [
        Rollout(changed, d, e.steps(robot), seed=k, pose=True)
        for k, (e, d) in enumerate(zip(plan, drivers, strict=True))
    ]
    logs = EngineMaker("mujoco", 1)().rollout(asked)
    with RunWriter(path, robot, {"task": "trial", "engine": "mujoco", "noise": str(NOISE)}) as writer:
        for k, (excitation, driver, found) in enumerate(zip(plan, drivers, logs, strict=True)):
            sent = replace(found, commands=np.array(driver.values[: len(found)]), torques=None)
            writer.trial(TrialRecord(k, f"{excitation.kind} {excitation.fixture}", HARDWARE, driver, sent))
