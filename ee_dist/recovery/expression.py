"""Gene networks as the loop sees them: a gene is to show wanted levels; genes, rates and links may have changed."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ee_dist.effects.catalogue import Hypothesis, Term
from ee_dist.effects.genes import genes, links
from ee_dist.evolution.ga import SCALE
from ee_dist.networks.model import GeneNetwork, Wanted
from ee_dist.recovery.behaviour import levels_of
from ee_dist.recovery.subject import Situation, Subject
from ee_dist.trials.log import Array, SensorLog

LOWEST, HIGHEST = -0.9, 1.0
"""Change of an altered rate, as a share of it."""


def wanted_levels(wanted: Wanted, times_s: Array) -> Array:
    """(T,) the levels that are wanted at these times, not a number before anything is wanted."""
    at, levels = np.array(wanted.points).T
    return np.interp(times_s, at, levels, left=np.nan)


@dataclass(frozen=True)
class Agreement:
    """1 less the mean distance of a channel from the wanted levels, as a share of their mean: 1 is exact.

    The worst there is for a log that ends before anything is wanted.
    """

    wanted: Wanted

    @property
    def key(self) -> str:
        return f"agreement:{self.wanted!r}"

    def __call__(self, log: SensorLog) -> float:
        wanted = wanted_levels(self.wanted, log.times_s)
        judged = ~np.isnan(wanted)
        if not judged.any():
            return -math.inf
        away = np.abs(log.channel(self.wanted.sensor) - wanted)[judged]
        value = 1.0 - float(away.mean() / wanted[judged].mean())
        return value if math.isfinite(value) else -math.inf


def _change(much: int) -> Mapping[str, float]:
    return {"change": much / SCALE * (HIGHEST if much > 0 else -LOWEST)}


def normal(terms: list[Term], network: GeneNetwork) -> Hypothesis:
    """Without terms that others make meaningless, in a fixed order: what happens to a gene that is knocked out does not matter,
    nor do its links. Of two changes of one kind at one place the first counts."""
    out = {t.target for t in terms if t.effect == "gene_knockout"}
    kept: dict[tuple[str, str], Term] = {}
    for t in terms:
        gone = t.effect != "gene_knockout" and not out.isdisjoint(t.target.split(">"))
        if not gone and (not t.values or any(value != 0.0 for _, value in t.values)):
            kept.setdefault((t.effect, t.target), t)
    return tuple(kept[key] for key in sorted(kept))


SITUATIONS = (
    Situation("gene_knockout", genes),
    Situation("transcription_altered", genes, _change),
    Situation("decay_altered", genes, _change),
    Situation("link_lost", links),
)


def expressing(network: GeneNetwork) -> Subject:
    return Subject(
        noun="network",
        function=Agreement(network.wanted),
        quantity="agreement",
        unit="",
        meaning="How well the output agreed with the wanted levels: 1 is exact",
        situations=SITUATIONS,
        normal=normal,
        tried_places=lambda n: len(n.link_names),
        behaviour=lambda n: levels_of(n, Agreement(network.wanted)),
    )
