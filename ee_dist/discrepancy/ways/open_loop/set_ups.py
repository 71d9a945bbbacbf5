"""Models as they are held in a trial. Those held alike share them, for a robot's digest is not free."""

from __future__ import annotations

from collections.abc import Sequence

from ee_dist.effects.catalogue import Hypothesis, apply
from ee_dist.robots.model import Robot

MOST = 2000
"""Models that are remembered of one set-up."""


class SetUps:
    def __init__(self) -> None:
        self._known: dict[Hypothesis, dict[int, tuple[Robot, Robot]]] = {}
        """The model, by whose identity it is known and which so stays that one, and as it is held."""

    def held(self, models: Sequence[Robot], setup: Hypothesis) -> list[Robot]:
        """The models with ``setup`` applied. Raises EffectError for one that does not fit them."""
        if not setup:
            return list(models)
        known = self._known.setdefault(setup, {})
        for m in models:
            if id(m) not in known:
                known[id(m)] = (m, apply(m, setup))
        held = [known[id(m)][1] for m in models]
        if len(known) > MOST:
            known.clear()
        return held
