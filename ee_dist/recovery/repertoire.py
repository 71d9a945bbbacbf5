"""The repair with a map of gaits: the best gait of each kind is kept, within a pass and from one pass to the next.

The paper's evolution ends with one kind of gait, and a pass around one controller keeps its kind, good or bad on the changed
body. Here a pass keeps the best of each kind (MAP-Elites) and has offspring of all of them; those that do badly fall
behind while it goes on. What a pass found, the next begins with. On demand gaits of the intact system are mapped before anything
breaks, as in Cully, Clune, Tarapore and Mouret (2015, Robots that can adapt like animals).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np

from ee_dist.engines.drivers import Network, weight_count
from ee_dist.evaluation.jobs import Counts, Evaluator
from ee_dist.evolution.archive import Elite
from ee_dist.evolution.ga import SCALE, Budget, Genomes
from ee_dist.recording.records import MAP, REPAIR
from ee_dist.recovery.map_search import Mapping, MapSearch
from ee_dist.recovery.observer import Observer
from ee_dist.recovery.repair import genome_of, network, relatives
from ee_dist.robots.system import System


@dataclass
class Repertoire:
    """Of one run: it remembers the map and what passes found. ``map_passes``: what the map of the intact system may cost, in
    passes; 0 leaves it out."""

    mapping: Mapping = field(default_factory=Mapping)
    map_passes: int = 0
    intact: list[Elite] = field(default_factory=list)
    """The map of the intact system, the best first."""
    found: list[Elite] = field(default_factory=list)
    """What the last pass ended with, the best first."""
    cost: Counts = field(default_factory=Counts)
    """Of the map of the intact system."""

    def prepare(
        self,
        robot: System,
        best: Network,
        evaluator: Evaluator,
        budget: Budget,
        steps: int,
        seed: np.random.SeedSequence,
        observer: Observer,
    ) -> None:
        """Map the intact system, from relatives of its controller and from random ones in equal parts."""
        if not self.map_passes:
            return
        before = evaluator.counts.copy()
        start, stream = (np.random.default_rng(s) for s in seed.spawn(2))
        near = relatives(genome_of(best)[None], budget.population // 2, start)
        shape = (budget.population - len(near), near.shape[1])
        fresh = start.integers(-SCALE, SCALE, size=shape, endpoint=True).astype(np.int16)
        search = MapSearch(robot, evaluator, budget, steps, self.mapping, observer, MAP, 0)
        self.intact = search.run(
            np.concatenate([near, fresh]), self.map_passes * budget.generations, 0.0, stream
        ).elites
        self.cost = evaluator.counts.since(before)

    def repair(
        self,
        model: System,
        database: Sequence[Network],
        evaluator: Evaluator,
        budget: Budget,
        steps: int,
        seed: np.random.SeedSequence,
        observer: Observer,
        pass_index: int,
    ) -> tuple[Network, float]:
        """Best controller found on ``model`` and how well it does there.

        The pass begins with what is known: the ``database``, what the last pass ended with (half of a population at most: another
        diagnosis may ask for another gait), the map (up to three quarters), and relatives of the database.
        """
        start, stream = (np.random.default_rng(s) for s in seed.spawn(2))
        length, room = weight_count(len(model.sensors), len(model.drives)), budget.population
        controllers = np.array([genome_of(c) for c in database], dtype=np.int16).reshape(-1, length)
        last = [e.genome for e in self.found[: room // 2]]
        known = _different([*controllers[::-1], *last])[:room]
        mapped = [e.genome for e in self.intact if e.allowed][: max(0, 3 * room // 4 - len(known))]
        known = _different([*known, *mapped])
        first = np.concatenate([known, relatives(controllers, room - len(known), start)])
        search = MapSearch(model, evaluator, budget, steps, self.mapping, observer, REPAIR, pass_index)
        self.found = search.run(first, budget.generations, self.mapping.narrow, stream).elites
        chosen = search.choose()
        return network(chosen.genome), chosen.score


def _different(genomes: Iterable[Genomes]) -> Genomes:
    """(n, length) without repetitions, in order."""
    return np.array(list({g.tobytes(): g for g in genomes}.values()), dtype=np.int16)
