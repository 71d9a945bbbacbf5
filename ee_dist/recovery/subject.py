"""What the loop must be told of a kind of system beside the system itself: what it is for, and what may be wrong with it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from ee_dist.effects.catalogue import Hypothesis, Term, term
from ee_dist.evaluation.jobs import Reduction
from ee_dist.evolution.ga import SCALE
from ee_dist.recovery.behaviour import Behaviour
from ee_dist.trials.log import SensorLog


def share(value: int) -> float:
    """A genome value in hundredths as a share in [0, 1]."""
    return (value + SCALE) / (2 * SCALE)


def _nothing(value: int) -> Mapping[str, float]:
    return {}


def _none(system: Any, log: SensorLog) -> tuple[str, ...]:
    return ()


@dataclass(frozen=True)
class Situation:
    """A kind of fault that a gene of a hypothesis can say: an effect, where it may be, and how much a value in hundredths is."""

    effect: str
    places: Callable[[Any], tuple[str, ...]]
    amount: Callable[[int], Mapping[str, float]] = _nothing

    def term(self, target: str, much: int) -> Term:
        return term(self.effect, target, **self.amount(much))


@dataclass(frozen=True)
class Subject:
    """``noun`` is what people call such a system. ``function`` is what a controller is chosen by (higher is better); its value of
    a trial is called ``quantity``, in ``unit``, and means what ``meaning`` says. ``situations`` are all that a hypothesis
    can say, ``normal`` leaves out of one what its other terms make meaningless, ``tried_places`` is how many places a
    neighbour of a hypothesis is tried at. ``behaviour`` tells one kind of doing it from another, and ``cheats`` names what of a
    trial (with the body's pose) is no honest way of doing it."""

    noun: str
    function: Reduction
    quantity: str
    unit: str
    meaning: str
    situations: tuple[Situation, ...]
    normal: Callable[[list[Term], Any], Hypothesis]
    tried_places: Callable[[Any], int]
    behaviour: Callable[[Any], Behaviour]
    cheats: Callable[[Any, SensorLog], tuple[str, ...]] = _none

    def value(self, log: SensorLog) -> float:
        """How well a trial went; not a number where the log does not tell."""
        found = float(self.function(log))
        return found if math.isfinite(found) else math.nan

    def measure(self, value: float) -> str:
        """A value of the function for people."""
        return f"{value:.2f} {self.unit}".rstrip()

    @property
    def heading(self) -> str:
        """The quantity with its unit."""
        return f"{self.quantity} ({self.unit})" if self.unit else self.quantity

    @property
    def key(self) -> str:
        """The same as a key of a file: ``distance_m``."""
        return f"{self.quantity}_{self.unit}" if self.unit else self.quantity

    @property
    def expected_key(self) -> str:
        """The key of what models expected."""
        return f"expected_{self.unit}" if self.unit else "expected"
