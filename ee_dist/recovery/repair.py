"""The repair pass: evolve a controller on a model."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ee_dist.engines.contract import Rollout
from ee_dist.engines.drivers import Network, weight_count
from ee_dist.evaluation.jobs import Evaluator, Job, Travel
from ee_dist.evolution.ga import SCALE, Budget, GeneticAlgorithm, Genomes, values
from ee_dist.recording.records import REPAIR, GenerationRecord
from ee_dist.recovery.observer import Observer
from ee_dist.robots.model import Robot


def network(genome: Genomes) -> Network:
    """The controller of a genome (68,) in hundredths."""
    return Network(tuple(float(v) for v in values(genome)))


def genome_of(controller: Network) -> Genomes:
    """The genome of a controller that evolution made."""
    return np.rint(np.array(controller.weights) * SCALE).astype(np.int16)


def repair(
    model: Robot,
    database: Sequence[Network],
    evaluator: Evaluator,
    budget: Budget,
    steps: int,
    seed: np.random.SeedSequence,
    observer: Observer,
    pass_index: int,
) -> tuple[Network, float]:
    """Best controller found on ``model`` and its forward distance there (m); controllers of the database join the start."""
    length = weight_count(len(model.sensors), len(model.drives))
    seeds = np.array([genome_of(c) for c in database], dtype=np.int16).reshape(-1, length)
    ga = GeneticAlgorithm(length, budget, seed, seeds)
    observer.pass_started(REPAIR, pass_index, budget.generations)
    reduction = Travel()
    while not ga.done:
        genomes = ga.ask()
        before = evaluator.counts.copy()
        jobs = [Job(Rollout(model, network(g), steps), reduction) for g in genomes]
        ga.tell(np.array(evaluator.evaluate(jobs)))
        finite = ga.scores[np.isfinite(ga.scores)]
        observer.generation(
            GenerationRecord(
                phase=REPAIR,
                pass_index=pass_index,
                generation=ga.generation - 1,
                best=float(ga.scores[0]),
                mean=float(finite.mean()) if len(finite) else float("nan"),
                dominants=ga.dominants,
                asked=len(jobs),
                simulated=evaluator.counts.simulated - before.simulated,
            )
        )
    return network(ga.genomes[0]), float(ga.scores[0])
