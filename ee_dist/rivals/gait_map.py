"""A map of gaits on the intact model: the best controller for each way of using the feet, by MAP-Elites.

After Cully, Clune, Tarapore and Mouret, "Robots that can adapt like animals", Nature 521 (2015): a behaviour is the share of
time that each foot is on the floor, in five steps each; theirs had six legs and 40 million evaluations, ours has four
and by default as many as the loop's repair passes ask for together. Variation is iso+line of Vassiliades and Mouret
(2018), as the package ``ribs`` has it, with its sigmas. The intact robot's controller is among the first.
"""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ee_dist.engines.contract import Rollout
from ee_dist.engines.drivers import Network
from ee_dist.evaluation.jobs import Evaluator, Job
from ee_dist.evolution.ga import SCALE, Genomes
from ee_dist.recovery.repair import genome_of, network
from ee_dist.rivals.setting import RivalError
from ee_dist.robots.model import Robot
from ee_dist.trials.log import SensorLog

Array = NDArray[np.float64]

STEPS_OF_A_FOOT = 5
ISO_SIGMA, LINE_SIGMA = 0.01, 0.2
BATCH = 200


@dataclass(frozen=True)
class Footfall:
    """(1 + feet,) the forward distance, m, and the share of time that each of the named touch sensors says floor."""

    feet: tuple[str, ...]

    @property
    def key(self) -> str:
        return f"footfall:{self.feet!r}"

    def __call__(self, log: SensorLog) -> Array:
        shares = [float((log.channel(f) > 0.5).mean()) for f in self.feet]
        return np.array([log.travel_m if np.isfinite(log.travel_m) else -np.inf, *shares])


@dataclass(frozen=True, eq=False)
class GaitMap:
    """What is on the map: controllers, their distance on the model, m, and the share of time of each foot on the floor."""

    genomes: Genomes
    expected: Array
    feet: Array

    def __len__(self) -> int:
        return len(self.genomes)


def feet_of(robot: Robot) -> tuple[str, ...]:
    """Names of the touch sensors. Raises RivalError for a robot without any."""
    found = tuple(s.name for s in robot.sensors if s.kind == "touch")
    if not found:
        raise RivalError(f"trial_and_error tells gaits by feet on the floor, and {robot.name} has no touch sensor")
    return found


def gait_map(
    robot: Robot,
    first: Network,
    evaluator: Evaluator,
    steps: int,
    evaluations: int,
    seed: np.random.SeedSequence,
) -> GaitMap:
    """The map after so many evaluations. Raises RivalError where ``ribs`` is absent."""
    archives, emitters = needed("ribs.archives"), needed("ribs.emitters")
    feet, controller = feet_of(robot), genome_of(first)
    rng = np.random.default_rng(seed.spawn(1)[0])
    seeds = [int(n) for n in seed.generate_state(2)]
    batch = min(BATCH, evaluations)
    start = rng.integers(-SCALE, SCALE, size=(batch, len(controller)), endpoint=True)
    start[0] = controller
    archive = archives.GridArchive(
        solution_dim=len(controller), dims=[STEPS_OF_A_FOOT] * len(feet), ranges=[(0.0, 1.0)] * len(feet), seed=seeds[0]
    )
    emitter = emitters.IsoLineEmitter(
        archive,
        iso_sigma=ISO_SIGMA,
        line_sigma=LINE_SIGMA,
        initial_solutions=start / SCALE,
        bounds=[(-1.0, 1.0)] * len(controller),
        batch_size=batch,
        seed=seeds[1],
    )
    done = 0
    while done < evaluations:
        # Two decimals, as every controller here has.
        genomes = np.rint(emitter.ask() * SCALE).astype(np.int16)[: evaluations - done]
        done += len(genomes)
        jobs = [Job(Rollout(robot, network(g), steps), Footfall(feet)) for g in genomes]
        found = np.array(evaluator.evaluate(jobs))
        whole = np.isfinite(found[:, 0])
        archive.add(genomes[whole] / SCALE, found[whole, 0], found[whole, 1:])
    data = archive.data()
    order = np.argsort(data["index"])
    return GaitMap(
        np.rint(data["solution"][order] * SCALE).astype(np.int16),
        np.asarray(data["objective"][order], dtype=np.float64),
        np.asarray(data["measures"][order], dtype=np.float64),
    )


def needed(module: str) -> Any:
    try:
        return importlib.import_module(module)
    except ImportError:
        raise RivalError(
            "trial_and_error needs the package ribs: pip install 'ee_dist[rivals]', or pip install ribs"
        ) from None
