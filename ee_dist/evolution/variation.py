"""Offspring of elites: a step of all values, of some, or of two.

The paper's mutation draws 1 % of 68 values anew and leaves half of all offspring what their parent was. Here each offspring
differs from its parent. Two values alone pay most often where the search has come far (measured in docs/decisions/0011), the
others find what is farther away.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ee_dist.evolution.ga import SCALE, Genomes

Values = NDArray[np.float64]
"""(length,) of a genome, in hundredths."""


@dataclass(frozen=True)
class Steps:
    """How far offspring are from their parents; lengths are in units of a weight, whose range is [-1, 1]."""

    near: float = 0.03
    """Standard deviation of a step of all values (the iso of iso+line: Vassiliades and Mouret 2018)."""
    line: float = 0.2
    """Standard deviation of a step along the line to another elite, as a share of the way to it (the line of iso+line)."""
    some: float = 0.05
    """Share of the values that change where only some do; one at least."""
    far: float = 0.3
    """Standard deviation of their steps."""
    pair: float = 0.2
    """Standard deviation of the steps where two values change."""


def near(parent: Values, other: Values, steps: Steps, rng: np.random.Generator) -> Values:
    """A step of all values and one along the line to another elite."""
    return (
        parent
        + SCALE * steps.near * rng.standard_normal(len(parent))
        + steps.line * rng.standard_normal() * (other - parent)
    )


def some(parent: Values, other: Values, steps: Steps, rng: np.random.Generator) -> Values:
    """Longer steps of a few values."""
    changed = rng.random(len(parent)) < steps.some
    changed[rng.integers(len(parent))] = True
    return parent + changed * SCALE * steps.far * rng.standard_normal(len(parent))


def pair(parent: Values, other: Values, steps: Steps, rng: np.random.Generator) -> Values:
    """Steps of two values."""
    child = parent.copy()
    chosen = rng.choice(len(parent), size=min(2, len(parent)), replace=False)
    child[chosen] += SCALE * steps.pair * rng.standard_normal(len(chosen))
    return child


WAYS = (near, some, pair, pair)
"""Drawn in equal parts."""


def offspring(
    elites: Sequence[Genomes], best: int, count: int, tournament: int, steps: Steps, rng: np.random.Generator
) -> Genomes:
    """(count, length) offspring of the first ``best`` of ``elites``, which stand in order, the best first.

    A parent is the best of a tournament; the other elite that some ways go towards is any of all.
    """
    made = []
    for _ in range(count):
        parent = elites[int(rng.integers(best, size=tournament).min())].astype(float)
        other = elites[int(rng.integers(len(elites)))].astype(float)
        made.append(WAYS[int(rng.integers(len(WAYS)))](parent, other, steps, rng))
    return np.clip(np.rint(np.array(made)), -SCALE, SCALE).astype(np.int16)
