"""The diagnosis pass: evolve a hypothesis under which the model's logs match all measured ones."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ee_dist.effects.catalogue import Hypothesis, apply
from ee_dist.engines.contract import Rollout
from ee_dist.evaluation.jobs import Evaluator, Job, Reduction
from ee_dist.evolution.ga import Budget, GeneticAlgorithm, Genomes
from ee_dist.recording.records import DIAGNOSIS, EVOLVED, POLISHED, PRUNED, GenerationRecord, HypothesisRecord
from ee_dist.recovery.genome import LENGTH, alone, at_all_amounts, decode, first_hypotheses, neighbours
from ee_dist.recovery.metrics import Metric
from ee_dist.recovery.observer import Observer
from ee_dist.robots.system import System
from ee_dist.trials.log import SensorLog

LAST_RANKS = 10
"""How many of the last population's different hypotheses are recorded."""
WIDER = 3
"""Of how many effects that stand alone, the best by a few amounts, all are tried."""


class Judge:
    """Errors of hypotheses against the trials so far: the mean over trials of the metric, lower is better."""

    def __init__(
        self, robot: System, trials: Sequence[tuple[object, SensorLog]], metric: Metric, evaluator: Evaluator
    ) -> None:
        self.robot, self.evaluator = robot, evaluator
        self.trials: list[tuple[object, Reduction, int]] = [
            (driver, metric.against(log), metric.steps(len(log))) for driver, log in trials
        ]
        self._models: dict[Hypothesis, System] = {}
        self._meanings: dict[bytes, Hypothesis] = {}

    def hypothesis(self, genome: Genomes) -> Hypothesis:
        """What a genome means. Most offspring are copies."""
        genome_bytes = genome.tobytes()
        if genome_bytes not in self._meanings:
            self._meanings[genome_bytes] = decode(genome, self.robot)
        return self._meanings[genome_bytes]

    def model(self, hypothesis: Hypothesis) -> System:
        if hypothesis not in self._models:
            self._models[hypothesis] = apply(self.robot, hypothesis)
        return self._models[hypothesis]

    def errors(self, hypotheses: Sequence[Hypothesis]) -> NDArray[np.float64]:
        jobs = [
            Job(Rollout(self.model(h), driver, steps), reduction)  # type: ignore[arg-type]
            for h in hypotheses
            for driver, reduction, steps in self.trials
        ]
        found = np.array(self.evaluator.evaluate(jobs), dtype=float).reshape(len(hypotheses), len(self.trials))
        return found.mean(axis=1)


@dataclass(frozen=True, eq=False)
class Belief:
    """What a diagnosis came to: the hypothesis to act on and its error; the genome joins the database of later passes."""

    genome: Genomes
    hypothesis: Hypothesis
    error: float


def believe(
    judge: Judge,
    database: Sequence[Genomes],
    budget: Budget,
    polishing: int,
    parsimony: float,
    seed: np.random.SeedSequence,
    observer: Observer,
    pass_index: int,
) -> Belief:
    """A whole diagnosis: evolve, polish, prune (the last two may be 0: left out), and tell the observer of each stage.

    The last stage is told as the final one: it is what the loop acts on.
    """
    genome, error = diagnose(judge, database, budget, seed, observer, pass_index)
    hypothesis = judge.hypothesis(genome)
    told = [HypothesisRecord(pass_index, budget.generations, 0, hypothesis, error, stage=EVOLVED)]
    if polishing:
        genome, error = reconsider(judge, *polish(judge, genome, error, polishing), polishing)
        hypothesis = judge.hypothesis(genome)
        told.append(replace(told[-1], terms=hypothesis, error=error, stage=POLISHED))
    if parsimony:
        hypothesis, error = prune(judge, hypothesis, error, parsimony)
        told.append(replace(told[-1], terms=hypothesis, error=error, stage=PRUNED))
    # The best that evolved was told with its population.
    observer.hypotheses([*told[1:-1], replace(told[-1], final=True)])
    return Belief(genome, hypothesis, error)


def diagnose(
    judge: Judge,
    database: Sequence[Genomes],
    budget: Budget,
    seed: np.random.SeedSequence,
    observer: Observer,
    pass_index: int,
) -> tuple[Genomes, float]:
    """Genome of the best hypothesis found, and its error. Genomes of the database join the start."""
    (start,) = seed.spawn(1)
    fresh = first_hypotheses(budget.population, np.random.default_rng(start))
    known = np.array(database, dtype=np.int16).reshape(-1, LENGTH)
    ga = GeneticAlgorithm(LENGTH, budget, seed, np.concatenate([known, fresh]))
    observer.pass_started(DIAGNOSIS, pass_index, budget.generations)
    while not ga.done:
        genomes = ga.ask()
        before = judge.evaluator.counts.copy()
        errors = judge.errors([judge.hypothesis(g) for g in genomes])
        ga.tell(-errors)
        finite = ga.scores[np.isfinite(ga.scores)]
        observer.generation(
            GenerationRecord(
                phase=DIAGNOSIS,
                pass_index=pass_index,
                generation=ga.generation - 1,
                best=float(-ga.scores[0]),
                mean=float(-finite.mean()) if len(finite) else math.inf,
                dominants=ga.dominants,
                asked=len(genomes),
                simulated=judge.evaluator.counts.simulated - before.simulated,
            )
        )
        best = judge.hypothesis(ga.genomes[0])
        observer.hypotheses([HypothesisRecord(pass_index, ga.generation - 1, 0, best, float(-ga.scores[0]))])
    observer.hypotheses(_last_population(ga, judge, pass_index))
    return ga.genomes[0].copy(), float(-ga.scores[0])


def polish(judge: Judge, genome: Genomes, error: float, rounds: int) -> tuple[Genomes, float]:
    """Walk to the best neighbour of a genome until none is better, at most ``rounds`` times.

    An offspring of the paper's evolution mutates in one of seven cases, which finds a valley and seldom its bottom.
    """
    for _ in range(rounds):
        around = np.array(neighbours(genome, judge.robot), dtype=np.int16)
        errors = judge.errors([judge.hypothesis(g) for g in around])
        k = int(np.argmin(errors))
        if not errors[k] < error:
            break
        genome, error = around[k], float(errors[k])
    return genome, error


def reconsider(judge: Judge, genome: Genomes, error: float, rounds: int) -> tuple[Genomes, float]:
    """Hold a polished hypothesis against what no walk from it comes to, and polish what is better, until nothing is: each effect
    alone, wherever it may be, and the same terms, all of them or all but one, each by every amount.

    Where a fault is large its valley is narrow: of three times a mass, the error at 2.9 times is half of that at none. Several
    terms that make up for a wrong amount then leave less than every neighbour of theirs.
    """
    robot = judge.robot
    for _ in range(rounds):
        if error == 0.0:
            break
        single = np.array(alone(robot), dtype=np.int16)
        found = judge.errors([judge.hypothesis(g) for g in single])
        near = [g for k in np.argsort(found, kind="stable")[:WIDER] for g in at_all_amounts(single[k], robot)]
        tried = np.array([*near, *at_all_amounts(genome, robot)], dtype=np.int16)
        errors = judge.errors([judge.hypothesis(g) for g in tried])
        k = int(np.argmin(errors))
        if not errors[k] < error:
            break
        genome, error = polish(judge, tried[k], float(errors[k]), rounds)
    return genome, error


def prune(judge: Judge, hypothesis: Hypothesis, error: float, parsimony: float) -> tuple[Hypothesis, float]:
    """Drop terms, the least missed first, that do not lower the error by the share ``parsimony`` of it.

    Evolution has no reason to remove a gene that changes nothing in these trials, such as a jam of a joint that never
    came near it; but a model that believes in it would plan around it.
    """
    while hypothesis:
        shorter = [(*hypothesis[:k], *hypothesis[k + 1 :]) for k in range(len(hypothesis))]
        errors = judge.errors(shorter)
        k = int(np.argmin(errors))
        if errors[k] * (1.0 - parsimony) > error:
            break
        hypothesis, error = shorter[k], float(errors[k])
    return hypothesis, error


def _last_population(ga: GeneticAlgorithm, judge: Judge, pass_index: int) -> list[HypothesisRecord]:
    different: dict[Hypothesis, float] = {}
    for genome, score in zip(ga.genomes, ga.scores, strict=True):
        different.setdefault(judge.hypothesis(genome), float(-score))
        if len(different) == LAST_RANKS:
            break
    last = ga.generation - 1
    return [
        HypothesisRecord(pass_index, last, rank, terms, error, stage=EVOLVED)
        for rank, (terms, error) in enumerate(different.items())
    ]
