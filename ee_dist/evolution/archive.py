"""A map of the best genome of each kind (MAP-Elites; Mouret and Clune 2015, Illuminating search spaces by mapping elites).

What kind a genome is of is told by its place, numbers in [0, 1] that say how it does what it does. Each axis is cut into
equal bins, and of each cell the best is kept: kinds that are not the best ones stay there to begin from.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ee_dist.evolution.ga import Genomes

Cell = tuple[int, ...]
"""Whether it is allowed (1 or 0), then the bin on each axis: what is not allowed never takes the place of what is."""


@dataclass(frozen=True, eq=False)
class Judged:
    """What is known of one genome. ``score``: higher is better. ``place``: one number in [0, 1] for each axis."""

    score: float
    allowed: bool
    place: tuple[float, ...]


@dataclass(frozen=True, eq=False)
class Elite:
    cell: Cell
    genome: Genomes
    """(length,) hundredths."""
    score: float

    @property
    def allowed(self) -> bool:
        return bool(self.cell[0])


class Archive:
    """The best genome of each cell. Among equals the older stays, so that a result does not depend on anything but the order."""

    def __init__(self, bins: int) -> None:
        self.bins = bins
        self._cells: dict[Cell, Elite] = {}

    def __len__(self) -> int:
        return len(self._cells)

    def cell(self, judged: Judged) -> Cell:
        """Where it belongs; what has no place on an axis (not a number) is in its first bin."""
        place = np.nan_to_num(np.asarray(judged.place, dtype=float), nan=0.0)
        bins = np.clip((place * self.bins).astype(int), 0, self.bins - 1)
        return (int(judged.allowed), *(int(b) for b in bins))

    def add(self, genomes: Genomes, judged: Sequence[Judged]) -> NDArray[np.bool_]:
        """Keep those of ``genomes`` (n, length) that are the best of their cell; (n,) which were, in their turn."""
        kept = np.zeros(len(genomes), dtype=bool)
        for k, (genome, found) in enumerate(zip(genomes, judged, strict=True)):
            cell = self.cell(found)
            there = self._cells.get(cell)
            if there is None or found.score > there.score:
                self._cells[cell] = Elite(cell, genome.copy(), float(found.score))
                kept[k] = True
        return kept

    @property
    def elites(self) -> list[Elite]:
        """The allowed ones first, of these the best first."""
        return sorted(self._cells.values(), key=lambda e: (-e.cell[0], -e.score, e.cell))
