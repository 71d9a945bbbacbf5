"""One rival on one robot with a hidden change. The truth is known here and nowhere below."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

import numpy as np

from ee_dist.effects.catalogue import Hypothesis, apply
from ee_dist.engines.contract import Engine, Rollout
from ee_dist.evaluation.jobs import Counts, Evaluator
from ee_dist.evaluation.physical import PhysicalRobot
from ee_dist.recovery.gait import gait
from ee_dist.recovery.kinds import subject_of
from ee_dist.rivals.attempt import Attempt, Cost
from ee_dist.rivals.ledger import Ledger
from ee_dist.rivals.roster import ROSTER
from ee_dist.rivals.setting import Allowance, Setting
from ee_dist.robots.model import Robot
from ee_dist.tasks.config import Config
from ee_dist.trials.log import SensorLog

TOGETHER = 50
"""Announced trials that are run at once, and so whose logs are in memory."""


class Watched:
    """Hardware that is a simulated body, and a list of what was tried on it and what it cost until then."""

    def __init__(self, physical: PhysicalRobot, engine: Engine, body: Robot, ledger: Ledger) -> None:
        self.physical, self.engine, self.body, self.ledger = physical, engine, body, ledger
        self.trials_m: list[float] = []
        self.costs: list[Counts] = []
        self.no_gait: dict[int, list[str]] = {}
        self._best = -np.inf
        self._coming: list[Any] = []
        self._known: dict[str, SensorLog] = {}

    def announce(self, drivers: Sequence[Any], steps: int) -> None:
        """What will be tried next, in this order: many bodies are simulated together for less, with the same logs."""
        self._coming = list(drivers)

    def trial(self, driver: Any, steps: int) -> SensorLog:
        self._ahead(driver, steps)
        if driver.key in self._known:
            log = self._known.pop(driver.key)
            self.physical.skip()
        else:
            log = self.physical.trial(driver, steps)
        distance = subject_of(self.body).value(log)
        if distance > self._best:
            cheats = gait(self.body, log)
            if cheats is not None and cheats.cheats:
                self.no_gait[len(self.trials_m)] = list(cheats.cheats)
            else:
                self._best = distance
        self.trials_m.append(distance)
        self.costs.append(self.ledger.counts.copy())
        return log

    def _ahead(self, driver: Any, steps: int) -> None:
        if driver.key in self._known or not self._coming or self._coming[0].key != driver.key:
            return
        some, self._coming = self._coming[:TOGETHER], self._coming[TOGETHER:]
        logs = self.engine.rollout([Rollout(self.body, d, steps, pose=True) for d in some])
        self._known = {d.key: log for d, log in zip(some, logs, strict=True) if log.finite}


def _cost(counts: Counts) -> Cost:
    return Cost(counts.asked, counts.simulated, counts.steps)


def attempt(
    name: str,
    config: Config,
    robot: Robot,
    hidden: Hypothesis,
    evaluator: Evaluator,
    engine: Engine,
    allowance: Allowance,
) -> Attempt:
    """Run a rival. Seeds, hardware and budget are those of ``task=recover`` with the same settings."""
    began, ledger = time.monotonic(), Ledger(evaluator)
    search, intact_seed, changed_seed = np.random.SeedSequence(config.seed).spawn(3)
    body = apply(robot, hidden)
    intact = Watched(PhysicalRobot(engine, robot, (), intact_seed), engine, robot, ledger)
    changed = Watched(PhysicalRobot(engine, robot, hidden, changed_seed), engine, body, ledger)
    setting = Setting(robot, intact, changed, config.metric.build(), config.budget.plan(), ledger, search, allowance)  # type: ignore[arg-type]
    believed = ROSTER[name].run(setting)
    if intact.physical.trials != 1 or changed.physical.trials != len(changed.trials_m):
        raise AssertionError("the hardware counted other trials than were noted")
    before = changed.costs[0]
    assert config.scenario is not None
    return Attempt(
        rival=name,
        scenario=config.scenario.number,
        seed=config.seed,
        intact_m=intact.trials_m[0],
        before=_cost(before),
        after=_cost(ledger.counts.since(before)),
        trials_m=changed.trials_m,
        spent=[_cost(c.since(before)) for c in changed.costs],
        no_gait=changed.no_gait,
        believed=[[t.as_dict() for t in h] for h in believed],
        truth=[t.as_dict() for t in hidden],
        seconds=round(time.monotonic() - began, 1),
    )
