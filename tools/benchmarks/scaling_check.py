"""The scaling model against what was measured: 1 and 2 workers, and a cluster of two nodes with a worker each."""

from __future__ import annotations

import multiprocessing
import multiprocessing.pool
import statistics
import time
from dataclasses import dataclass
from typing import Any

import numpy as np
import ray
from ray.cluster_utils import Cluster

from benchmarks.scaling_model import Costs, Generation, simulate
from ee_dist.evaluation.cache import CachedEvaluator
from ee_dist.evaluation.ray_actors import RayEvaluator
from ee_dist.evaluation.ray_session import start_ray
from ee_dist.evolution.ga import Budget
from ee_dist.recording.records import GenerationRecord
from ee_dist.recovery.observer import Observer
from ee_dist.recovery.repair import repair
from ee_dist.robots.quadruped import quadruped
from ee_dist.tasks.wiring import EngineMaker


@dataclass(frozen=True)
class CheckSetting:
    """A repair pass that is long enough to be timed."""

    engine: str
    population: int = 100
    generations: int = 4
    steps: int = 500
    repeat: int = 3


def _busy(count: int) -> float:
    """Some work for a core; how long it took by the clock on the wall."""
    began = time.perf_counter()
    total = 0
    for k in range(count):
        total += k * k
    return time.perf_counter() - began


def capacity(pool: multiprocessing.pool.Pool, count: int = 3_000_000) -> float:
    """How much faster two processes are now than one at work that they do not share: 2 on an idle machine with two cores,
    less where others use them, and the most that two workers can reach."""
    alone = pool.map(_busy, [count], chunksize=1)[0]
    return 2.0 * alone / max(pool.map(_busy, [count] * 2, chunksize=1))


class _Trace(Observer):
    """Remembers what each generation simulated."""

    def __init__(self, steps: int) -> None:
        self.steps = steps
        self.generations: list[Generation] = []

    def generation(self, record: GenerationRecord) -> None:
        self.generations.append(Generation(record.asked, record.simulated, self.steps))


def one_pass(setting: CheckSetting, evaluator: RayEvaluator) -> tuple[float, float, list[Generation]]:
    """Wall time and best distance of a pass on warm workers, and what it simulated."""
    budget = Budget(setting.population, setting.generations, crossovers=setting.population // 8)
    trace = _Trace(setting.steps)
    began = time.perf_counter()
    _, best = repair(
        quadruped(), [], CachedEvaluator(evaluator), budget, setting.steps, np.random.SeedSequence(0), trace, 0
    )
    return time.perf_counter() - began, best, trace.generations


def on_this_machine(setting: CheckSetting) -> dict[str, Any]:
    """Passes with 1 and with 2 workers in turn, on one Ray."""
    start_ray(None, 2)
    evaluators = {n: RayEvaluator(EngineMaker(setting.engine, 1), n) for n in (1, 2)}
    walls: dict[int, list[float]] = {1: [], 2: []}
    bests, trace, possible = set(), [], []
    pool = multiprocessing.get_context("spawn").Pool(2)
    try:
        for evaluator in evaluators.values():
            one_pass(setting, evaluator)
        for _ in range(setting.repeat):
            for n, evaluator in evaluators.items():
                wall, best, trace = one_pass(setting, evaluator)
                walls[n].append(wall)
                bests.add(best)
            possible.append(capacity(pool))
    finally:
        pool.terminate()
        for evaluator in evaluators.values():
            evaluator.close()
        ray.shutdown()
    return {
        "wall_1_s": min(walls[1]),
        "wall_2_s": min(walls[2]),
        "speed_up": statistics.median(a / b for a, b in zip(walls[1], walls[2], strict=True)),
        "possible": statistics.median(possible),
        "same": len(bests) == 1,
        "best": bests.pop(),
        "trace": trace,
    }


def on_two_nodes(setting: CheckSetting) -> dict[str, Any]:
    """The same pass on a cluster of two nodes with one core each, as if they were two machines."""
    cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 1, "include_dashboard": False})
    try:
        cluster.add_node(num_cpus=1)
        cluster.wait_for_nodes()
        # workers=0 asks for a whole core for each actor: one goes to each node.
        evaluator = RayEvaluator(EngineMaker(setting.engine, 1), 0, address=cluster.address)
        evaluator_nodes = len(ray.nodes())
        try:
            one_pass(setting, evaluator)
            found = [one_pass(setting, evaluator) for _ in range(setting.repeat)]
        finally:
            evaluator.close()
    finally:
        ray.shutdown()
        cluster.shutdown()
    return {"wall_s": min(f[0] for f in found), "nodes": evaluator_nodes, "best": found[0][1]}


def check(setting: CheckSetting, costs: Costs) -> dict[str, Any]:
    """Measured and predicted wall times and speed-ups of the pass."""
    here, there = on_this_machine(setting), on_two_nodes(setting)
    warm = Costs(**{**costs.__dict__, "start_s": 0.0})
    predicted = {n: simulate(here["trace"], warm, n).wall_s for n in (1, 2)}
    return {
        "measured_1_s": here["wall_1_s"],
        "measured_2_s": here["wall_2_s"],
        "measured_two_nodes_s": there["wall_s"],
        "predicted_1_s": predicted[1],
        "predicted_2_s": predicted[2],
        "speed_up_measured": here["speed_up"],
        "speed_up_two_nodes": here["wall_1_s"] / there["wall_s"],
        "speed_up_possible": here["possible"],
        "speed_up_predicted": predicted[1] / predicted[2],
        "nodes": there["nodes"],
        "same_result": bool(here["same"] and here["best"] == there["best"]),
    }
