"""Effects that somebody named, beside those that a model has: what is there already is fitted anew in its place."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from ee_dist.basics.names import listed
from ee_dist.discrepancy.search.candidates import Candidate
from ee_dist.robots.model import Robot

ASKED = "the effects asked for were added"
REFITTED = "only the model's own values were to be fitted"
ALREADY = "{names}, which the model has already, {was} fitted anew in {its} place"

Acts = tuple[str, frozenset[str]]
"""An effect and where it acts, whatever its target is called."""


def to_be_added(robot: Robot, parts: Iterable[Candidate], wanted: Sequence[Candidate]) -> tuple[list[Candidate], str]:
    """What is to be added of what is ``wanted``, each once, to a model whose ``parts`` are fitted anew anyway, and why a search
    stops after it. Of two terms at the same places only the sum would tell."""
    there, once = {_acts(robot, c) for c in parts}, dict[Acts, Candidate]()
    for c in wanted:
        once.setdefault(_acts(robot, c), c)
    new = [c for acts, c in once.items() if acts not in there]
    again = [c.name for acts, c in once.items() if acts in there]
    said = [ASKED if new else REFITTED] if new or not wanted else []
    if again:
        was, its = ("was", "its") if len(again) == 1 else ("were", "their")
        said.append(ALREADY.format(names=listed(again), was=was, its=its))
    return new, "; ".join(said)


def _acts(robot: Robot, c: Candidate) -> Acts:
    return c.effect.name, frozenset(c.members(robot) or (c.target,))
