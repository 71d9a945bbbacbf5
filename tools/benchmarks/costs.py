"""What the pieces of a run cost, measured one by one: the parameters of the scaling model."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from benchmarks.steps import StepSetting, batch_cost, sample_rollouts
from ee_dist.evaluation.cache import CachedEvaluator
from ee_dist.evaluation.jobs import Counts, Job, Travel
from ee_dist.evaluation.ray_actors import RayEvaluator
from ee_dist.evolution.ga import Budget
from ee_dist.recovery.observer import Observer
from ee_dist.recovery.repair import repair
from ee_dist.robots.quadruped import quadruped
from ee_dist.tasks.wiring import EngineMaker


class NoPhysics:
    """An evaluator that answers at once, with a number that depends on the job alone."""

    def __init__(self) -> None:
        self.counts = Counts()

    def evaluate(self, jobs: Sequence[Job]) -> list[Any]:
        self.counts.simulated += len(jobs)
        return [float(sum(job.rollout.driver.weights[:4])) for job in jobs]  # type: ignore[union-attr]

    def close(self) -> None: ...


def search_cost(population: int = 200, generations: int = 8) -> dict[str, float]:
    """Processor time of the search itself: a generation, and each rollout that it asks for (decode, key, cache)."""

    def spent(size: int) -> float:
        budget = Budget(population=size, generations=generations, crossovers=min(24, size // 8))
        evaluator = CachedEvaluator(NoPhysics())
        began = time.process_time()
        repair(quadruped(), [], evaluator, budget, 1000, np.random.SeedSequence(0), Observer(), 0)
        return time.process_time() - began

    large, small = min(spent(population) for _ in range(2)), min(spent(8) for _ in range(2))
    asked = population + generations * population // 2
    asked_small = 8 + generations * 4
    per_job = max(large - small, 0.0) / (asked - asked_small)
    return {
        "per_asked_s": per_job,
        "per_generation_s": max(small - asked_small * per_job, 0.0) / (generations + 1),
    }


def call_cost(engine: str, repeat: int = 30) -> dict[str, float]:
    """What Ray adds: wall time of a call that does next to nothing (the fastest of many, since others use the machine
    too), what each further call costs the searching process, and each further job in a call."""
    robot = quadruped()
    reduction = Travel()
    jobs = [Job(r, reduction) for r in sample_rollouts(StepSetting(engine, 64, 2), robot)]
    evaluator = RayEvaluator(EngineMaker(engine, 1), workers=1)
    alone = EngineMaker(engine, 1)()
    try:
        evaluator.evaluate(jobs)
        one = _fastest(lambda: evaluator.evaluate(jobs[:1]), repeat)
        many = _fastest(lambda: evaluator.evaluate(jobs), repeat)
        evaluator.chunk = 1
        apart = _fastest(lambda: evaluator.evaluate(jobs), max(2, repeat // 5))
        alone.rollout([j.rollout for j in jobs])
        work_one = _fastest(lambda: alone.rollout([jobs[0].rollout]), repeat)
        work_many = _fastest(lambda: alone.rollout([j.rollout for j in jobs]), repeat)
    finally:
        evaluator.close()
        alone.close()
    set_up = max(work_many - work_one, 0.0) / (len(jobs) - 1)
    call = max(one - work_one, 1e-5)
    return {
        "call_s": call,
        "per_call_s": max((apart - one) / (len(jobs) - 1) - work_one, 1e-5),
        "per_sent_s": max((many - one) / (len(jobs) - 1) - set_up, 1e-6),
        "set_up_s": set_up,
    }


def _fastest(work: Callable[[], object], repeat: int) -> float:
    best = float("inf")
    for _ in range(repeat):
        began = time.perf_counter()
        work()
        best = min(best, time.perf_counter() - began)
    return best


def measure_costs(engine: str, quick: bool) -> dict[str, float]:
    """All parameters of ``scaling_model.Costs`` but the time of the start."""
    sizes, steps, repeat = ((1, 8), 20, 2) if quick else ((1, 4, 12, 25, 64), 200, 3)
    return {
        **batch_cost(engine, sizes, steps, repeat),
        **search_cost(*((16, 2) if quick else (200, 8))),
        **call_cost(engine, 3 if quick else 40),
    }
