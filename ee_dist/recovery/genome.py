"""The paper's hypothesis genome: four genes of four values that decode to a hypothesis (section 3.2)."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np
from numpy.typing import NDArray

from ee_dist.effects.catalogue import Hypothesis, Term
from ee_dist.evolution.ga import SCALE
from ee_dist.recovery.kinds import subject_of
from ee_dist.robots.system import System

GENES, GENE_LENGTH = 4, 4
LENGTH = GENES * GENE_LENGTH

ACTIVE = (0.02, 0.5, 0.3, 0.13, 0.05)
"""Shares of hypotheses with 0, 1, ... 4 active genes in a first population: most faults are single, and what two genes say
is found by joining those that say one."""


def first_hypotheses(count: int, rng: np.random.Generator) -> NDArray[np.int16]:
    """(count, 16) random genomes that cover the space evenly: a Latin hypercube over all values, few genes active.

    With each gene active by the toss of a coin, a single fault is said by a quarter of the genomes only, and forty-two
    places to be wrong at are then tried with one magnitude each.
    """
    # Loading scipy.stats takes longer than everything else before a run's first generation.
    from scipy.stats import qmc

    even = qmc.LatinHypercube(LENGTH, rng=rng).random(count)
    genomes = (np.minimum(np.floor(even * (2 * SCALE + 1)), 2 * SCALE) - SCALE).astype(np.int16)
    switch = np.abs(genomes[:, ::GENE_LENGTH])
    active = np.zeros(switch.shape, dtype=bool)
    for row, number in zip(active, rng.choice(GENES + 1, size=count, p=ACTIVE), strict=True):
        row[rng.permutation(GENES)[:number]] = True
    genomes[:, ::GENE_LENGTH] = np.where(active, np.maximum(switch, 1), -np.maximum(switch, 1))
    return genomes


def choice(value: int, options: int) -> int:
    """Which of ``options`` a genome value in hundredths means: equal shares of [-1, 1]."""
    return (value + SCALE) * options // (2 * SCALE + 1)


def decode(genome: NDArray[np.int16], system: System) -> Hypothesis:
    """The hypothesis of a genome (16,) in hundredths: active genes only, sorted and without what changes nothing.

    Genomes that mean the same decode to the same hypothesis, so they share one simulation: a lost part twice, a part
    that was lost already, dormant genes.
    """
    subject = subject_of(system)
    found: list[Term] = []
    for k in range(GENES):
        active, situation, where, much = (int(v) for v in genome[k * GENE_LENGTH : (k + 1) * GENE_LENGTH])
        if choice(active, 2) == 1:
            said = subject.situations[choice(situation, len(subject.situations))]
            places = said.places(system)
            found.append(said.term(places[choice(where, len(places))], much))
    return subject.normal(found, system)


STEPS = (40, 20, 10, 5, 2, 1)
"""How far, in hundredths, the fourth value of a gene is moved to both sides."""
AMOUNTS = (-60, 0, 60)
"""Fourth values with which another term is tried."""
EVENLY = tuple(range(-SCALE, SCALE + 1, 10))
"""Fourth values with which a term is tried alone, wherever it may be."""


def neighbours(genome: NDArray[np.int16], system: System) -> list[NDArray[np.int16]]:
    """Genomes whose hypotheses differ in one term: dropped, a little stronger or weaker, added, or another in its place."""
    subject = subject_of(system)
    situations, places = _middles(len(subject.situations)), _middles(subject.tried_places(system))
    found: dict[Hypothesis, NDArray[np.int16]] = {}
    for k in range(0, LENGTH, GENE_LENGTH):
        active, situation, where, much = (int(v) for v in genome[k : k + GENE_LENGTH])
        genes = [(-1, situation, where, much)]
        if choice(active, 2) == 1:
            genes += [(active, situation, where, much + d) for s in STEPS for d in (s, -s) if abs(much + d) <= SCALE]
        genes += product((1,), situations, places, AMOUNTS)
        for gene in genes:
            other = genome.copy()
            other[k : k + GENE_LENGTH] = gene
            found.setdefault(decode(other, system), other)
    return list(found.values())


def alone(system: System, amounts: Sequence[int] = EVENLY) -> list[NDArray[np.int16]]:
    """Genomes of each effect alone, at each place, by each of the ``amounts``."""
    subject = subject_of(system)
    situations, places = _middles(len(subject.situations)), _middles(subject.tried_places(system))
    found: dict[Hypothesis, NDArray[np.int16]] = {}
    for gene in product((1,), situations, places, amounts):
        genome = np.zeros(LENGTH, dtype=np.int16)
        genome[::GENE_LENGTH] = -1
        genome[:GENE_LENGTH] = gene
        found.setdefault(decode(genome, system), genome)
    return list(found.values())


def at_all_amounts(genome: NDArray[np.int16], system: System) -> list[NDArray[np.int16]]:
    """Genomes of the same terms, all of them or all but one, with each in turn by every amount that it has."""
    active = [k for k in range(0, LENGTH, GENE_LENGTH) if choice(int(genome[k]), 2) == 1]
    bases = [(genome, active)]
    for dropped in active if len(active) > 1 else ():
        base = genome.copy()
        base[dropped] = -1
        bases.append((base, [k for k in active if k != dropped]))
    found: dict[Hypothesis, NDArray[np.int16]] = {}
    for base, left in bases:
        for k in left:
            for much in range(-SCALE, SCALE + 1):
                other = base.copy()
                other[k + GENE_LENGTH - 1] = much
                found.setdefault(decode(other, system), other)
    return list(found.values())


def _middles(options: int) -> list[int]:
    """Values in hundredths in the middle of each of equal shares of [-1, 1]."""
    return [round((2 * i + 1) * SCALE / options) - SCALE for i in range(options)]
