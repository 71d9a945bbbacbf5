"""The paper's hypothesis genome: four genes of four values that decode to a hypothesis (section 3.2)."""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import NDArray

from ee_dist.effects.catalogue import Hypothesis, Term, term
from ee_dist.effects.targets import carried_parts, motors, parts, sensors
from ee_dist.evolution.ga import SCALE
from ee_dist.robots.model import Robot

GENES, GENE_LENGTH = 4, 4
LENGTH = GENES * GENE_LENGTH

SITUATIONS = ("part_lost", "part_mass", "motor_weak", "sensor_failing", "joint_jam", "floor_tilt")
HEAVIER = (1.0, 2.0)
"""A part grows heavier by 100 to 200 %."""
STEEPEST_DEG = 30.0


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


def share(value: int) -> float:
    """A genome value in hundredths as a share in [0, 1]."""
    return (value + SCALE) / (2 * SCALE)


def decode(genome: NDArray[np.int16], robot: Robot) -> Hypothesis:
    """The hypothesis of a genome (16,) in hundredths: active genes only, sorted and without what changes nothing.

    Genomes that mean the same decode to the same hypothesis, so they share one simulation: a lost part twice, a part
    that was lost already, dormant genes.
    """
    found: list[Term] = []
    for k in range(GENES):
        active, situation, where, much = (int(v) for v in genome[k * GENE_LENGTH : (k + 1) * GENE_LENGTH])
        if choice(active, 2) == 1:
            found.append(_gene(SITUATIONS[choice(situation, len(SITUATIONS))], where, much, robot))
    return normal(found, robot)


STEPS = (40, 20, 10, 5, 2, 1)
"""How far, in hundredths, the fourth value of a gene is moved to both sides."""
AMOUNTS = (-60, 0, 60)
"""Fourth values with which another term is tried."""


def neighbours(genome: NDArray[np.int16], robot: Robot) -> list[NDArray[np.int16]]:
    """Genomes whose hypotheses differ in one term: dropped, a little stronger or weaker, added, or another in its place."""
    found: dict[Hypothesis, NDArray[np.int16]] = {}
    for k in range(0, LENGTH, GENE_LENGTH):
        active, situation, where, much = (int(v) for v in genome[k : k + GENE_LENGTH])
        genes = [(-1, situation, where, much)]
        if choice(active, 2) == 1:
            genes += [(active, situation, where, much + d) for s in STEPS for d in (s, -s) if abs(much + d) <= SCALE]
        genes += product((1,), _middles(len(SITUATIONS)), _middles(len(parts(robot))), AMOUNTS)
        for gene in genes:
            other = genome.copy()
            other[k : k + GENE_LENGTH] = gene
            found.setdefault(decode(other, robot), other)
    return list(found.values())


def _middles(options: int) -> list[int]:
    """Values in hundredths in the middle of each of equal shares of [-1, 1]."""
    return [round((2 * i + 1) * SCALE / options) - SCALE for i in range(options)]


def _gene(situation: str, where: int, much: int, robot: Robot) -> Term:
    if situation == "floor_tilt":
        return term("floor_tilt", "floor", sideways_deg=STEEPEST_DEG * much / SCALE)
    places = {"part_lost": carried_parts, "part_mass": parts, "sensor_failing": sensors}.get(situation, motors)(robot)
    target = places[choice(where, len(places))]
    if situation == "part_lost":
        return term("part_lost", target)
    if situation == "part_mass":
        low, high = HEAVIER
        return term("part_mass", target, change=low + (high - low) * share(much))
    return term(situation, target, loss=share(much))


def normal(terms: list[Term], robot: Robot) -> Hypothesis:
    """Without terms that others make meaningless, in a fixed order.

    What sits on a lost part is gone with it. Of two changes of one kind at one place the first counts.
    """
    lost = {name for t in terms if t.effect == "part_lost" for name in robot.subtree(t.target)}
    gone = lost | {j.name for j in robot.joints if j.child in lost}
    kept: dict[tuple[str, str], Term] = {}
    for t in terms:
        if t.effect == "part_lost":
            if robot.joint_of(t.target).parent not in lost:
                kept[t.effect, t.target] = t
        elif t.target not in gone and any(value != 0.0 for _, value in t.values):
            kept.setdefault((t.effect, t.target), t)
    return tuple(kept[key] for key in sorted(kept))
