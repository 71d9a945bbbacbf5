"""The better repair: a map of gaits made before anything breaks, of which each pass goes on with those that still walk.

The paper's pass starts around one gait and keeps its kind, good or bad on the changed body. Here the best gait of each kind is
kept (a map, as in Cully, Clune, Tarapore and Mouret 2015, Robots that can adapt like animals), all of them are judged on the
diagnosed model, and evolution goes on from those that do well there; kinds that do badly fall behind while the pass goes on.
What a pass found, the next begins with.
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
    map_passes: int = 2
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
            [np.concatenate([near, fresh])], self.map_passes * budget.generations, 0.0, stream
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

        One start is what is known: the ``database``, what the last pass ended with, and relatives of the database. The others
        are gaits of the map, dealt out among them, and random controllers. Together they are a population.
        """
        start, stream = (np.random.default_rng(s) for s in seed.spawn(2))
        length, starts = weight_count(len(model.sensors), len(model.drives)), self.mapping.starts
        room = [budget.population // starts + (k < budget.population % starts) for k in range(starts)]
        controllers = np.array([genome_of(c) for c in database], dtype=np.int16).reshape(-1, length)
        # Half of the room at most for the last pass: another diagnosis may ask for another gait.
        last = [e.genome for e in self.found[: room[0] // 2]]
        known = _different([*controllers[::-1], *last])[: room[0]]
        begun = [np.concatenate([known, relatives(controllers, room[0] - len(known), start)])]
        mapped = [e.genome for e in self.intact if e.allowed]
        for k in range(1, starts):
            dealt = mapped[k - 1 :: starts - 1][: room[k]]
            fresh = start.integers(-SCALE, SCALE, size=(room[k] - len(dealt), length), endpoint=True).astype(np.int16)
            begun.append(np.concatenate([*(g[None] for g in dealt), fresh]))
        search = MapSearch(model, evaluator, budget, steps, self.mapping, observer, REPAIR, pass_index)
        self.found = search.run(begun, budget.generations, self.mapping.narrow, stream).elites
        chosen = search.choose()
        return network(chosen.genome), chosen.score


def _different(genomes: Iterable[Genomes]) -> Genomes:
    """(n, length) without repetitions, in order."""
    return np.array(list({g.tobytes(): g for g in genomes}.values()), dtype=np.int16)
