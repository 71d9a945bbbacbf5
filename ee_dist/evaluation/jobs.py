"""What an evaluator is asked: rollouts, and what to keep of each log."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from ee_dist.engines.contract import Rollout
from ee_dist.trials.log import SensorLog


class Reduction(Protocol):
    """Turns a log into what the search needs of it, where the rollout ran, so that little travels back."""

    @property
    def key(self) -> str: ...

    def __call__(self, log: SensorLog) -> Any: ...


@dataclass(frozen=True)
class Travel:
    """Forward distance, m; -inf for a model whose motion left the finite numbers."""

    key: str = "travel"

    def __call__(self, log: SensorLog) -> float:
        return log.travel_m if math.isfinite(log.travel_m) else -math.inf


@dataclass(frozen=True)
class Whole:
    """The log itself."""

    key: str = "whole"

    def __call__(self, log: SensorLog) -> SensorLog:
        return log


@dataclass(frozen=True, eq=False)
class Job:
    """A rollout and what to keep of it."""

    rollout: Rollout
    reduction: Reduction

    @property
    def key(self) -> str:
        text = f"{self.rollout.key}|{self.reduction.key}"
        return hashlib.sha256(text.encode()).hexdigest()


@dataclass
class Counts:
    """What was asked of an evaluator and what it cost. ``steps`` are robot-steps simulated."""

    asked: int = 0
    simulated: int = 0
    steps: int = 0
    asked_steps: int = 0

    def reset(self) -> None:
        self.asked = self.simulated = self.steps = self.asked_steps = 0

    def add(self, jobs: Sequence[Job]) -> None:
        """Jobs that were asked for, all of which are simulated."""
        steps = sum(j.rollout.steps for j in jobs)
        self.asked += len(jobs)
        self.asked_steps += steps
        self.simulated += len(jobs)
        self.steps += steps

    def asked_since(self, before: Counts, jobs: Sequence[Job]) -> None:
        """That only these were asked for since an earlier copy, whatever had to be simulated for them."""
        self.asked = before.asked + len(jobs)
        self.asked_steps = before.asked_steps + sum(j.rollout.steps for j in jobs)

    def copy(self) -> Counts:
        return Counts(self.asked, self.simulated, self.steps, self.asked_steps)

    def since(self, before: Counts) -> Counts:
        """What was added to an earlier copy."""
        return Counts(
            self.asked - before.asked,
            self.simulated - before.simulated,
            self.steps - before.steps,
            self.asked_steps - before.asked_steps,
        )


class Evaluator(Protocol):
    """Where rollouts run. Results come in the order of the jobs and do not depend on where or with what they ran."""

    counts: Counts

    def evaluate(self, jobs: Sequence[Job]) -> list[Any]: ...

    def close(self) -> None: ...


def array_key(values: np.ndarray) -> str:
    """Content address of an array."""
    return hashlib.sha256(np.ascontiguousarray(values).tobytes()).hexdigest()
