"""Which of the effects that improve added the model stands on, and which hardly anything depends on."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from ee_dist.discrepancy.ladder import Improvement
from ee_dist.discrepancy.words import by_effect
from ee_dist.effects.catalogue import CATALOGUE, Hypothesis, Term
from ee_dist.effects.groups import members_of
from ee_dist.robots.model import Robot


@dataclass(frozen=True)
class Share:
    """``terms`` that one phrase, ``text``, tells of; ``worth``: the share of the squared error above the noise that would be back
    without them, NaN where that is not known; ``doubted``: less than what is left unexplained, which shows that something is
    missing that nobody listed, and any effect of about its shape takes some of it off."""

    text: str
    terms: Hypothesis
    worth: float
    doubted: bool


def added(found: Improvement) -> list[Term]:
    """What was added and is there at the end, with its final values."""
    names = {t.name for r in found.ladder for t in r.added}
    return [t for t in found.terms if t.name in names]


def shares(found: Improvement, robot: Robot) -> list[Share]:
    """What was added, in phrases: first what most depends on."""
    new, out = added(found), []
    for text, mine in by_effect(tuple(new), robot):
        worth = _worth(found, mine, new, robot)
        out.append(Share(text, mine, worth, worth < 1.0 - found.explained))
    return sorted(out, key=lambda s: -s.worth if math.isfinite(s.worth) else math.inf)


def _worth(found: Improvement, mine: Hypothesis, new: Sequence[Term], robot: Robot) -> float:
    """What all joints share of an effect, and what each has besides, can make up for one another: they count together."""
    if found.worth is None:
        return math.nan
    alike = [t for t in new if t.effect == mine[0].effect]
    if any(members_of(robot, t.target, CATALOGUE[t.effect].targets(robot)) for t in alike):
        return found.worth.of([t.name for t in alike])
    return found.worth.of([t.name for t in mine])
