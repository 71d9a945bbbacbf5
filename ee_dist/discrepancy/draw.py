"""Hidden effects drawn at random, for blind trials: over the whole catalogue, all targets, the range worth trying."""

from __future__ import annotations

import numpy as np

from ee_dist.discrepancy.search.candidates import Candidate, candidate, possible
from ee_dist.effects.catalogue import CATALOGUE, Term
from ee_dist.effects.torque_readings import TORQUES_READ_LATE
from ee_dist.robots.model import Robot

LEAST, MOST = 0.1, 0.9
"""Shares of the way from neutral to a bound within which magnitudes are drawn."""


def draw(robot: Robot, rng: np.random.Generator) -> tuple[Candidate, Term]:
    """An effect, then a target, then its values; every effect of the catalogue that the robot has room for, and may catch, is as
    likely as any other. What is only proposed where commands and positions show it depends on a motion that is not drawn yet, and
    when torques are read is of a log and not of the robot."""
    of_robot = (e for e in CATALOGUE.values() if not e.mistake and e.seen_at is None and e.name != TORQUES_READ_LATE)
    entries = [e for e in of_robot if e.proposed(robot)]
    entry = entries[int(rng.integers(len(entries)))]
    targets = entry.proposed(robot)
    chosen = candidate(robot, entry, targets[int(rng.integers(len(targets)))])
    room = possible(robot, (), [chosen])
    if not room:
        return draw(robot, rng)
    chosen = room[0]
    u = []
    for low, high in zip(chosen.lower, chosen.upper, strict=True):
        side = float(rng.choice([s for s in (low, high) if s] or [0.0]))
        u.append(side * float(rng.uniform(LEAST, MOST)))
    return chosen, chosen.term(u)
