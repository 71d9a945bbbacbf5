"""How well a recovery went, scored against the truth after the search is over."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ee_dist.effects.catalogue import Hypothesis, apply
from ee_dist.recording.records import HARDWARE, TrialRecord
from ee_dist.recovery.gait import gait
from ee_dist.recovery.observer import Observer
from ee_dist.robots.model import Robot
from ee_dist.robots.system import System

RESTORED = 0.9
"""Function counts as restored at this share of the intact distance."""


@dataclass(frozen=True)
class Score:
    """``recovered_fraction``: best compensating trial over the intact distance; ``counted_fraction``: the best of those that
    count. ``found``: which true terms the last hypothesis names, by effect and place; ``invented``: which that are not true."""

    recovered_fraction: float
    counted_fraction: float
    restored: bool
    found: int
    true: int
    invented: int

    @property
    def right(self) -> bool:
        """Every true effect named at its place, and nothing else."""
        return self.found == self.true and self.invented == 0


class Gaits(Observer):
    """How the hardware made its distances: what is no gait in each trial, by its number; nothing of what has no body.

    The physical robot after the change is ``robot`` under ``hidden``, where that is known.
    """

    def __init__(self, robot: System, hidden: Hypothesis) -> None:
        self.bodies = (robot, apply(robot, hidden))
        self.cheats: list[tuple[str, ...]] = []

    def trial(self, record: TrialRecord) -> None:
        if record.source == HARDWARE:
            body = self.bodies[min(record.index, 1)]
            found = gait(body, record.log) if isinstance(body, Robot) else None
            self.cheats.append(() if found is None else found.cheats)

    @property
    def compensating(self) -> list[tuple[str, ...]]:
        """Without the intact trial and the one right after the change."""
        return self.cheats[2:]


def score(
    intact: float,
    trials: Sequence[float],
    believed: Hypothesis,
    truth: Hypothesis,
    cheats: Sequence[tuple[str, ...]] = (),
) -> Score:
    """Compare with the truth, and trials with the intact one by the value of their function.

    A trial with ``cheats`` does not count as function restored.
    """
    named, real = _places(believed), _places(truth)
    counted = [m for k, m in enumerate(trials) if not (k < len(cheats) and cheats[k])]
    best, fraction = (max(m) / intact if m and intact > 0 else float("nan") for m in (list(trials), counted))
    return Score(best, fraction, fraction >= RESTORED, len(named & real), len(real), len(named - real))


def _places(hypothesis: Hypothesis) -> set[tuple[str, str]]:
    return {(t.effect, t.target) for t in hypothesis}
