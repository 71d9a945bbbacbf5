"""The paper's genetic algorithm, as ask and tell (Bongard and Lipson 2004, section 3.2).

A population is sorted by fitness; its worse half is deleted and replaced by offspring of the better half, chosen by
tournaments of three; each value of an offspring mutates with probability 1 %; then random pairs of the offspring
undergo one-point crossover. Survivors keep the fitness they have: evaluation is free of noise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Genomes = NDArray[np.int16]
"""(n, length) hundredths: two decimals are exact as integers, and -0 does not exist."""

SCALE = 100


@dataclass(frozen=True)
class Budget:
    """Sizes of a pass; the defaults are the paper's."""

    population: int = 200
    generations: int = 40
    tournament: int = 3
    mutation: float = 0.01
    crossovers: int = 24

    def __post_init__(self) -> None:
        if self.population < 4 or self.population % 2:
            raise ValueError(f"budget: population must be an even number of 4 or more, not {self.population}")
        if self.generations < 1:
            raise ValueError(f"budget: generations must be 1 or more, not {self.generations}")
        if not 1 <= self.tournament <= self.population // 2:
            raise ValueError(f"budget: tournament must be from 1 to half the population, not {self.tournament}")
        if not 0.0 <= self.mutation <= 1.0:
            raise ValueError(f"budget: mutation must be a probability, not {self.mutation}")
        if not 0 <= self.crossovers <= self.population // 4:
            raise ValueError(f"budget: crossovers must be from 0 to a quarter of the population, not {self.crossovers}")


def values(genomes: Genomes) -> NDArray[np.float64]:
    """Genome values in [-1, 1]."""
    return genomes / SCALE


class GeneticAlgorithm:
    """Maximises a score. ``ask`` gives the genomes to be scored, ``tell`` takes their scores, in turn.

    ``seeds`` (k, length), genomes from the database, replace the first k of the random first population.
    ``dominants`` counts the generations so far in which a new best of the population appeared (the paper's Fig. 8);
    the first population's best counts as one.
    """

    def __init__(self, length: int, budget: Budget, seed: np.random.SeedSequence, seeds: Genomes | None = None) -> None:
        self.budget = budget
        self._streams = seed.spawn(budget.generations + 1)
        rng = np.random.default_rng(self._streams[0])
        self.genomes: Genomes = rng.integers(-SCALE, SCALE, size=(budget.population, length), endpoint=True).astype(
            np.int16
        )
        if seeds is not None and len(seeds):
            kept = seeds[: budget.population]
            self.genomes[: len(kept)] = kept
        self.scores = np.full(budget.population, -np.inf)
        self.generation = 0
        self.dominants = 0
        self._waiting = False

    @property
    def done(self) -> bool:
        return self.generation > self.budget.generations

    def ask(self) -> Genomes:
        """The whole population at first, then the offspring of a generation. Raises RuntimeError out of turn."""
        if self._waiting or self.done:
            raise RuntimeError(
                "ask was called out of turn: " + ("tell comes first" if self._waiting else "the pass is over")
            )
        self._waiting = True
        if self.generation > 0:
            self._breed()
        return self.genomes[self._first_new :].copy()

    def tell(self, scores: NDArray[np.float64]) -> None:
        """Scores of what ``ask`` gave, in its order. Raises RuntimeError out of turn, ValueError for a wrong shape."""
        if not self._waiting:
            raise RuntimeError("tell was called out of turn: ask comes first")
        expected = self.budget.population - self._first_new
        if scores.shape != (expected,):
            raise ValueError(f"scores have shape {scores.shape}, expected ({expected},)")
        if np.isnan(scores).any():
            raise ValueError("scores must not be NaN")
        best_before = self.scores.max() if self.generation > 0 else -np.inf
        self.scores[self._first_new :] = scores
        # Stable, so that among equals the older stays ahead and a tie is no new best.
        order = np.argsort(-self.scores, kind="stable")
        self.genomes, self.scores = self.genomes[order], self.scores[order]
        if self.scores[0] > best_before:
            self.dominants += 1
        self.generation += 1
        self._waiting = False

    @property
    def _first_new(self) -> int:
        return 0 if self.generation == 0 else self.budget.population // 2

    def _breed(self) -> None:
        rng = np.random.default_rng(self._streams[self.generation])
        half, b = self.budget.population // 2, self.budget
        length = self.genomes.shape[1]
        # The population is sorted, so the winner of a tournament is the entrant with the lowest index.
        winners = rng.integers(0, half, size=(half, b.tournament)).min(axis=1)
        offspring = self.genomes[winners].copy()
        fresh = rng.integers(-SCALE, SCALE, size=offspring.shape, endpoint=True)
        mutated = rng.random(offspring.shape) < b.mutation
        offspring[mutated] = fresh[mutated]
        pairs = rng.permutation(half)[: 2 * b.crossovers].reshape(-1, 2)
        cuts = rng.integers(1, length, size=len(pairs))
        for (i, j), cut in zip(pairs, cuts, strict=True):
            tail = offspring[i, cut:].copy()
            offspring[i, cut:] = offspring[j, cut:]
            offspring[j, cut:] = tail
        self.genomes[half:] = offspring
