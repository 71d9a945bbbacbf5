"""A search that keeps the best of each kind: offspring of a map's elites on one model, tried for a part of a trial first."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from ee_dist.engines.contract import Rollout
from ee_dist.evaluation.jobs import Counts, Evaluator, Job, Whole
from ee_dist.evolution.archive import Archive, Elite, Judged
from ee_dist.evolution.ga import Budget, Genomes
from ee_dist.evolution.variation import Steps, offspring
from ee_dist.recording.records import GenerationRecord
from ee_dist.recovery.kinds import subject_of
from ee_dist.recovery.observer import Observer
from ee_dist.recovery.repair import network
from ee_dist.robots.system import System

LOOKED_AT = 10
"""How many of the best are looked at closely for one that is an honest gait."""


@dataclass(frozen=True)
class Mapping:
    """How a map is searched. A generation simulates as many steps as the paper's asks for (half a population, whole), whatever is
    set here: shorter first trials make more offspring."""

    bins: int = 8
    """Into how many parts each axis of the map is cut: with few, a robot on three legs has a handful of kinds, and a search
    with as many parents comes to a stop."""
    first: float = 0.3
    """Share of a trial for which all offspring are tried first; with 1 all are tried whole."""
    kept: float = 0.2
    """Share of the offspring, the best of those first parts, that are then tried whole."""
    narrow: float = 0.9
    """Share of the map, its worse end, that has no more offspring at the end of a repair pass."""
    steps: Steps = field(default_factory=Steps)

    def __post_init__(self) -> None:
        if self.bins < 1:
            raise ValueError(f"repair: bins must be 1 or more, not {self.bins}")
        for name in ("first", "kept"):
            if not 0.01 <= getattr(self, name) <= 1.0:
                raise ValueError(f"repair: {name} must be from 0.01 to 1, not {getattr(self, name)}")
        if not 0.0 <= self.narrow <= 1.0:
            raise ValueError(f"repair: narrow must be from 0 to 1, not {self.narrow}")

    def tried(self, whole: int) -> tuple[int, int]:
        """(offspring, those of them tried whole) of a generation that may simulate as much as ``whole`` whole trials."""
        if self.first >= 1.0:
            return whole, whole
        kept = max(1, round(whole * self.kept / (self.first + self.kept)))
        return max(kept, int((whole - kept) / self.first)), kept


class MapSearch:
    """One pass on one model. ``phase`` and ``pass_index`` are what the observer is told."""

    def __init__(
        self,
        model: System,
        evaluator: Evaluator,
        budget: Budget,
        steps: int,
        mapping: Mapping,
        observer: Observer,
        phase: str,
        pass_index: int,
    ) -> None:
        self.model, self.evaluator, self.budget, self.steps = model, evaluator, budget, steps
        self.mapping, self.observer, self.phase, self.pass_index = mapping, observer, phase, pass_index
        self.subject = subject_of(model)
        self.behaviour = self.subject.behaviour(model)
        self.archive = Archive(mapping.bins)

    def run(self, first: Genomes, generations: int, narrow: float, rng: np.random.Generator) -> Archive:
        """Fill the map from ``first`` (n, length) and go on. ``narrow``: the share of the map, its worse end, that has no more
        offspring in the last generation; it grows from 0."""
        self.observer.pass_started(self.phase, self.pass_index, generations)
        dominants = 0
        for generation in range(generations + 1):
            before, best = self.evaluator.counts.copy(), self._best
            if generation:
                first = self._promising(narrow * (generation - 1) / max(1, generations - 1), rng)
            self.archive.add(first, self._judged(first))
            dominants += self._best > best
            self._tell(generation, dominants, before)
        return self.archive

    def _tell(self, generation: int, dominants: int, before: Counts) -> None:
        scores = [e.score for e in self.archive.elites if math.isfinite(e.score)]
        spent = self.evaluator.counts.since(before)
        self.observer.generation(
            GenerationRecord(
                phase=self.phase,
                pass_index=self.pass_index,
                generation=generation,
                best=self._best,
                mean=float(np.mean(scores)) if scores else math.nan,
                dominants=dominants,
                asked=spent.asked,
                simulated=spent.simulated,
            )
        )

    def choose(self) -> Elite:
        """The best that is an honest gait by the whole rule, of the first few; the best of all where none is."""
        elites = self.archive.elites
        for elite in elites[:LOOKED_AT]:
            rollout = Rollout(self.model, network(elite.genome), self.steps, pose=True)
            (log,) = self.evaluator.evaluate([Job(rollout, Whole())])
            if not self.subject.cheats(self.model, log):
                return elite
        return elites[0]

    @property
    def _best(self) -> float:
        """Of those that count; before there are any, the worst there is."""
        elites = self.archive.elites
        return elites[0].score if elites else -math.inf

    def _promising(self, narrow: float, rng: np.random.Generator) -> Genomes:
        """Offspring that are worth a whole trial."""
        elites = [e.genome for e in self.archive.elites]
        parents = max(1, round(len(elites) * (1.0 - narrow)))
        count, kept = self.mapping.tried(self.budget.population // 2)
        born = offspring(elites, parents, count, self.budget.tournament, self.mapping.steps, rng)
        if kept == count:
            return born
        steps = max(2, round(self.mapping.first * self.steps))
        jobs = [Job(Rollout(self.model, network(g), steps), self.subject.function) for g in born]
        # Stable, so that among equals the first stays ahead.
        order = np.argsort(-np.array(self.evaluator.evaluate(jobs)), kind="stable")
        return born[order[:kept]]

    def _judged(self, genomes: Genomes) -> list[Judged]:
        """Each of (n, length) tried whole."""
        jobs = [Job(Rollout(self.model, network(g), self.steps, pose=True), self.behaviour) for g in genomes]
        found = self.evaluator.evaluate(jobs)
        return [Judged(float(v[0]), bool(v[1]), tuple(float(x) for x in v[2:])) for v in found]
