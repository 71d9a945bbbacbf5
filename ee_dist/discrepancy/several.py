"""Proposals of several effects at once: those that pay only together, or at each joint with a value of its own."""

from __future__ import annotations

from collections.abc import Sequence
from collections.abc import Set as AbstractSet
from itertools import combinations

import numpy as np

from ee_dist.discrepancy.search.candidates import Proposal
from ee_dist.discrepancy.search.scan import scan
from ee_dist.discrepancy.search.screen import Screened
from ee_dist.discrepancy.search.search import Search
from ee_dist.effects.groups import WHOLE
from ee_dist.trials.log import Array

GAIN = "position_gain"
FAMILIES_TRIED, ADDS = 4, 0.3
"""Effects whose members at all joints, each with a value of its own, are tried together, and the share of what the best member
promises, or of what it leaves above the noise, that the others must add."""


def families(
    screened: Sequence[Screened],
    singles: Sequence[tuple[Proposal, Array]],
    least: float,
    has: AbstractSet[str],
    above: float,
    held: AbstractSet[str],
) -> list[tuple[Proposal, Array]]:
    """Effects at all joints, each joint with a value of its own, where several joints promise something: one number for all of
    them, which the model may have already (``has``), may be too few. Of joints that were only ``held`` nothing tells a gain from
    a torque, and theirs is as that of the others. ``above``: energy above the noise. And friction by load, linear and quadratic,
    which pay together."""
    out: list[tuple[float, Proposal, Array]] = []
    by_effect: dict[str, list[Screened]] = {}
    whole = has | {s.candidate.effect.name for s in screened if s.candidate.target in WHOLE}
    for s in screened:
        if s.candidate.effect.name in whole and s.candidate.target in _joints(screened, s.candidate.effect.name):
            by_effect.setdefault(s.candidate.effect.name, []).append(s)
    for name, members in by_effect.items():
        visible = [s for s in members if s.starts and s.promise > least]
        if name == GAIN:
            visible = [s for s in visible if s.candidate.target not in held]
        if len(visible) < 2:
            continue
        promise, most = sum(s.promise for s in visible), max(s.promise for s in visible)
        # A shoulder's friction is little beside that of an elbow that leaves four fifths, and most of what this one cannot say.
        if promise - most > ADDS * min(most, max(above - most, 0.0)):
            label = f"{name}@each of {len(visible)} joints"
            parts = Proposal(tuple(s.candidate for s in visible), label)
            out.append((promise / np.sqrt(parts.size), parts, np.concatenate([s.starts[0] for s in visible])))
    out = sorted(out, key=lambda f: -f[0])[:FAMILIES_TRIED]
    found = [(p, u) for _, p, u in out]
    by_name = {s.candidate.name: s for s in screened}
    for single, u in singles:
        c = single.parts[0]
        other = by_name.get(f"quadratic_friction@{c.target}")
        if c.effect.name == "load_friction" and other is not None and other.reach > 0:
            start = np.where(other.candidate.upper > 0, 0.05, -0.05)
            found.append((Proposal((c, other.candidate)), np.concatenate([u, start])))
    return found


def _joints(screened: Sequence[Screened], effect: str) -> set[str]:
    """Targets of an effect that are single joints."""
    return {
        s.candidate.target
        for s in screened
        if s.candidate.effect.name == effect and s.candidate.target not in WHOLE and "+" not in s.candidate.target
    }


def pairs(screened: Sequence[Screened], now: Search) -> list[tuple[Proposal, Array]]:
    """Pairs of effects at the place that promises most: some pay only together."""
    hopeful = sorted((s for s in screened if s.promise > 0), key=lambda s: -s.promise)
    if not hopeful:
        return []
    place = hopeful[0].candidate.target
    there = [s for s in hopeful if s.candidate.target == place and s.candidate.size][:4]
    best = {s.candidate.name: s.starts[0] for s in scan(now, there)}
    pairs = [p for p in combinations(there, 2) if all(s.candidate.name in best for s in p)][:4]
    return [
        (
            Proposal((a.candidate, b.candidate)),
            0.5 * np.concatenate([best[a.candidate.name], best[b.candidate.name]]),
        )
        for a, b in pairs
    ]
