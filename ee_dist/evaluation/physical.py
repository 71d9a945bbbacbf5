"""The simulated physical robot: hardware whose change is hidden from whoever tries it.

Only tasks build one (the import rules forbid it to the searches). The hidden hypothesis lives in a closure, not in an
attribute, and comes out through ``reveal`` alone, which tasks call after the search is over.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ee_dist.effects.catalogue import Hypothesis, apply
from ee_dist.engines.contract import Engine, EngineError, Rollout
from ee_dist.robots.system import System
from ee_dist.trials.log import SensorLog
from ee_dist.trials.noise import with_noise


class PhysicalRobot:
    """Implements ``ee_dist.trials.hardware.Hardware``. ``noise`` is the standard deviation of each channel's noise,
    as a share of the channel's range (see ``ee_dist.trials.noise``)."""

    __slots__ = ("_run", "reveal", "trials")

    def __init__(
        self, engine: Engine, robot: System, hidden: Hypothesis, seed: np.random.SeedSequence, noise: float = 0.0
    ) -> None:
        changed = apply(with_noise(robot, noise), hidden)
        self.trials = 0
        cause = "the hidden change makes" if hidden else "with nothing hidden, these commands make"
        self._run: Callable[[Any, int, int], SensorLog] = _runner(engine, changed, seed, cause)
        self.reveal: Callable[[], Hypothesis] = lambda: hidden

    def trial(self, driver: Any, steps: int) -> SensorLog:
        log = self._run(driver, steps, self.trials)
        self.trials += 1
        return log

    def skip(self) -> None:
        """A trial that was made before, by a run that is resumed now: the next one is the one after it."""
        self.trials += 1


def _runner(
    engine: Engine, robot: System, seed: np.random.SeedSequence, cause: str
) -> Callable[[Any, int, int], SensorLog]:
    def run(driver: Any, steps: int, index: int) -> SensorLog:
        stream = np.random.SeedSequence(seed.entropy, spawn_key=(*seed.spawn_key, index))
        number = int(stream.generate_state(1, np.uint64)[0])
        (log,) = engine.rollout([Rollout(robot, driver, steps, seed=number, pose=True)])
        if not log.finite:
            raise EngineError(f"{cause} {robot.name} unstable in {engine.name}: no trial came back")
        return log

    return run
