"""Every effect at every place where it could act, as one list to search; and points of its range to look from."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from ee_dist.effects.catalogue import CATALOGUE, Effect, Term
from ee_dist.robots.model import Robot
from ee_dist.trials.log import Array


@dataclass(frozen=True)
class Candidate:
    """An effect at a target. Its values are searched as shares ``u`` (P,) of the way from neutral to a bound."""

    effect: Effect
    target: str

    @property
    def name(self) -> str:
        return f"{self.effect.name}@{self.target}" if self.target else self.effect.name

    @property
    def size(self) -> int:
        """How many parameters are free."""
        return len(self.effect.parameters)

    @property
    def lower(self) -> Array:
        """Smallest u: -1 where the parameter has room below neutral, else 0."""
        return np.array([-1.0 if p.lower < p.neutral else 0.0 for p in self.effect.parameters])

    @property
    def upper(self) -> Array:
        return np.array([1.0 if p.upper > p.neutral else 0.0 for p in self.effect.parameters])

    def values(self, u: Sequence[float] | Array) -> dict[str, float]:
        """Parameters by name, in their own units, within bounds."""
        found = {}
        for p, share in zip(self.effect.parameters, u, strict=True):
            room = p.upper - p.neutral if share >= 0 else p.neutral - p.lower
            found[p.name] = float(min(max(p.neutral + float(share) * room, p.lower), p.upper))
        return found

    def shares(self, values: dict[str, float]) -> Array:
        """The inverse of ``values``."""
        out = []
        for p in self.effect.parameters:
            gap = values[p.name] - p.neutral
            room = p.upper - p.neutral if gap >= 0 else p.neutral - p.lower
            out.append(gap / room if room else 0.0)
        return np.array(out)

    def term(self, u: Sequence[float] | Array) -> Term:
        return Term(self.effect.name, self.target, tuple(self.values(u).items()))

    def probes(self, shares: Sequence[float]) -> list[Array]:
        """Points to look at first: each parameter alone, to both sides where it has two; the only one if it has none."""
        if not self.size:
            return [np.zeros(0)]
        points = []
        for k in range(self.size):
            for side in (self.upper[k], self.lower[k]):
                if side:
                    points += [side * share * np.eye(self.size)[k] for share in shares]
        if self.size > 1 and self.effect.parameters[0].neutral == 0.0:
            # A second parameter often shapes the first (a speed, a place) and does nothing alone: neutral stays.
            pass
        return points


def candidates(robot: Robot, without: Iterable[str] = (), only: Iterable[str] | None = None) -> list[Candidate]:
    """All searchable effects at all their targets, in the order of the catalogue.

    ``without`` leaves out effects or places (``effect`` or ``effect@target``); ``only`` leaves out all others.
    """
    banned = set(without)
    wanted = None if only is None else set(only)
    found = []
    for entry in CATALOGUE.values():
        if not entry.searchable or entry.name in banned:
            continue
        for target in entry.targets(robot):
            candidate = Candidate(entry, target)
            if candidate.name in banned or (wanted is not None and not {entry.name, candidate.name} & wanted):
                continue
            found.append(candidate)
    return found
