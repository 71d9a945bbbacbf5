"""The repair pass: evolve a controller on a model."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ee_dist.engines.contract import Rollout
from ee_dist.engines.drivers import Network, weight_count
from ee_dist.evaluation.jobs import Evaluator, Job
from ee_dist.evolution.ga import SCALE, Budget, GeneticAlgorithm, Genomes, values
from ee_dist.recording.records import REPAIR, GenerationRecord
from ee_dist.recovery.kinds import subject_of
from ee_dist.recovery.observer import Observer
from ee_dist.robots.system import System

NEAREST, FARTHEST = 0.01, 0.3
"""Shares of new values in the relatives of a controller that start a pass."""


def network(genome: Genomes) -> Network:
    """The controller of a genome (68,) in hundredths."""
    return Network(tuple(float(v) for v in values(genome)))


def genome_of(controller: Network) -> Genomes:
    """The genome of a controller that evolution made."""
    return np.rint(np.array(controller.weights) * SCALE).astype(np.int16)


def relatives(database: Genomes, count: int, rng: np.random.Generator) -> Genomes:
    """(count, length) copies of the database's genomes, in turn and the newest first, ever more of their values new.

    The first of each are unchanged; from there the share of new values grows geometrically from ``NEAREST`` to
    ``FARTHEST``. A change of the body asks for another gait, and how far it is from the last one nobody knows.
    """
    if not len(database) or count < 1:
        return database[:0]
    n = min(len(database), count)
    found = database[::-1][np.arange(count) % len(database)].copy()
    generation = np.maximum(0, np.arange(count) // len(database) - 1)
    share = NEAREST * (FARTHEST / NEAREST) ** (generation / max(1, generation.max()))
    changed = rng.random(found.shape) < share[:, None]
    changed[:n] = False
    found[changed] = rng.integers(-SCALE, SCALE, size=found.shape, endpoint=True)[changed]
    return found


def repair(
    model: System,
    database: Sequence[Network],
    evaluator: Evaluator,
    budget: Budget,
    steps: int,
    seed: np.random.SeedSequence,
    observer: Observer,
    pass_index: int,
    related: float = 1.0,
) -> tuple[Network, float]:
    """Best controller found on ``model`` and how well it does there: the value of the function that the system has.

    Controllers of the database and their relatives make up the share ``related`` of the first population (the database
    is in it in any case); the rest is random.
    """
    length = weight_count(len(model.sensors), len(model.drives))
    known = np.array([genome_of(c) for c in database], dtype=np.int16).reshape(-1, length)
    wanted = max(len(known), round(related * budget.population))
    (start,) = seed.spawn(1)
    ga = GeneticAlgorithm(length, budget, seed, relatives(known, wanted, np.random.default_rng(start)))
    observer.pass_started(REPAIR, pass_index, budget.generations)
    function = subject_of(model).function
    while not ga.done:
        genomes = ga.ask()
        before = evaluator.counts.copy()
        jobs = [Job(Rollout(model, network(g), steps), function) for g in genomes]
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
