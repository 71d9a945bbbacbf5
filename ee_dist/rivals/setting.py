"""What every rival is given: the same robot, model, budget and seeds. Hardware it sees through ``trial`` alone.

A rival is a function of a ``Setting``. It tries the intact robot once, the changed robot first with the same controller (the
trial that shows the change), and then as it likes. It returns what it believed to be wrong, where it believes anything: how
far it came is read off the hardware by whoever set it up, not told by the rival.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ee_dist.effects.catalogue import Hypothesis
from ee_dist.engines.drivers import Network
from ee_dist.evaluation.jobs import Evaluator
from ee_dist.recovery.kinds import subject_of
from ee_dist.recovery.loop import Plan
from ee_dist.recovery.metrics import RollingMean
from ee_dist.recovery.observer import Observer
from ee_dist.recovery.repair import repair
from ee_dist.robots.model import Robot
from ee_dist.trials.hardware import Hardware


class RivalError(RuntimeError):
    """A rival that cannot run, said in one line."""


@dataclass(frozen=True)
class Allowance:
    """What rivals other than the loop may use up; what they share with it is in the plan."""

    body_trials: int = 4000
    """Hardware trials after the change of evolution on the body alone; the paper's Fig. 1 has 3,550."""
    map_trials: int = 25
    """Hardware trials of the map of gaits after the one that shows the change."""
    map_evaluations: int = 0
    """Simulations behind the map of gaits; 0: as many as all repair passes of the loop ask for together."""
    pairs: bool = True
    """Whether the list of faults for Bayesian inference holds pairs of faults too."""

    def __post_init__(self) -> None:
        for name, least in (("body_trials", 1), ("map_trials", 1), ("map_evaluations", 0)):
            if getattr(self, name) < least:
                raise ValueError(f"{name} must be {least} or more, not {getattr(self, name)}")


@dataclass(frozen=True)
class Setting:
    """One robot, before and after a change that only the hardware knows."""

    robot: Robot
    intact: Hardware
    changed: Hardware
    metric: RollingMean
    plan: Plan
    evaluator: Evaluator
    seed: np.random.SeedSequence
    allowance: Allowance = Allowance()

    def fresh_seed(self) -> np.random.SeedSequence:
        """The seed as if nothing had been spawned from it yet."""
        return np.random.SeedSequence(self.seed.entropy, spawn_key=self.seed.spawn_key)

    def streams(self) -> list[np.random.SeedSequence]:
        """Seeds of the loop's passes (repair, then diagnosis), and one more for what the loop does not have."""
        return self.fresh_seed().spawn(2 * self.plan.compensating_trials + 2)

    def value(self, hardware: Hardware, driver: Network) -> float:
        """How well a trial on hardware went; the least there is where its log does not tell."""
        found = subject_of(self.robot).value(hardware.trial(driver, self.plan.steps))
        return found if math.isfinite(found) else -math.inf


Rival = Callable[[Setting], Sequence[Hypothesis]]
"""Returns what was believed at each pass, nothing where nothing is."""


def intact_controller(setting: Setting) -> Network:
    """The controller of the intact robot: that of the loop's first repair pass, bit for bit."""
    plan = setting.plan
    best, _ = repair(setting.robot, [], setting.evaluator, plan.repair, plan.steps, setting.streams()[0], Observer(), 0)
    return best


def announce(hardware: Hardware, drivers: Sequence[Any], steps: int) -> None:
    """Tell hardware what will be tried next. A simulated body may run these together; a real one need not know."""
    told = getattr(hardware, "announce", None)
    if told is not None:
        told(drivers, steps)
