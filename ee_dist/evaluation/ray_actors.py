"""Ray actors, one engine each, on this machine or on a cluster. A killed actor is restarted and its work done again."""

from __future__ import annotations

import logging
import os
import socket
from collections.abc import Callable, Sequence
from typing import Any

import ray

from ee_dist.engines.contract import Engine
from ee_dist.evaluation.jobs import Counts, Job
from ee_dist.evaluation.serial import run_jobs


class EvaluatorError(RuntimeError):
    """Ray could not be started or reached, said in one line."""


EngineMaker = Callable[[], Engine]


class _Worker:
    """Lives in an actor process; its engine is made there."""

    def __init__(self, make_engine: EngineMaker) -> None:
        self.engine = make_engine()

    def run(self, jobs: list[Job], chunk: int) -> list[Any]:
        return run_jobs(self.engine, jobs, chunk)

    def pid(self) -> int:
        return os.getpid()


def start_ray(address: str | None, workers: int) -> None:
    """Connect to the cluster at ``address``, or start Ray on this machine. Raises EvaluatorError."""
    if ray.is_initialized():
        return
    # Workers are one process a core: numerical libraries must not start threads of their own in them.
    one_thread = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    options: dict[str, Any] = {
        "include_dashboard": False,
        "log_to_driver": False,
        "logging_level": logging.ERROR,
        "runtime_env": {"env_vars": one_thread},
    }
    if not address:
        ray.init(num_cpus=max(workers, os.cpu_count() or 1), **options)
        return
    del options["include_dashboard"]
    _knock(address)
    try:
        ray.init(address=address, **options)
    except Exception as error:
        first = str(error).strip().splitlines()[0] if str(error).strip() else type(error).__name__
        raise _unreachable(address, first) from None


def _knock(address: str) -> None:
    """Ray waits for minutes where nobody answers: see first whether somebody does."""
    host, _, port = address.removeprefix("ray://").rpartition(":")
    if not host:
        if address in ("auto", "local"):
            return
        raise EvaluatorError(f"ray.address={address}: neither 'auto' nor host:port, such as 127.0.0.1:6379")
    try:
        socket.create_connection((host, int(port)), timeout=5).close()
    except (OSError, ValueError, OverflowError) as error:
        raise _unreachable(address, str(error)) from None


def _unreachable(address: str, why: str) -> EvaluatorError:
    return EvaluatorError(
        f"ray.address={address}: no Ray cluster answers there ({why}); "
        "start one with 'ray start --head', or leave ray.address empty to use this machine"
    )


class RayEvaluator:
    """Implements ``ee_dist.evaluation.jobs.Evaluator`` with ``workers`` actors (0: one a core).

    ``chunk`` is how many jobs a call carries (0: an even share of what is asked, in two helpings, so that an early
    finisher takes over from a late one). Results do not depend on either.
    """

    def __init__(self, make_engine: EngineMaker, workers: int = 0, chunk: int = 0, address: str | None = None) -> None:
        if workers < 0 or chunk < 0:
            raise ValueError("evaluator: workers and chunk must be 0 (automatic) or more")
        self.workers = workers or (os.cpu_count() or 1)
        self.chunk = chunk
        self.counts = Counts()
        start_ray(address, self.workers)
        actor = ray.remote(num_cpus=1 if not workers else 0.01, max_restarts=-1, max_task_retries=-1)(_Worker)
        self.actors = [actor.remote(make_engine) for _ in range(self.workers)]

    def evaluate(self, jobs: Sequence[Job]) -> list[Any]:
        steps = sum(j.rollout.steps for j in jobs)
        self.counts.asked += len(jobs)
        self.counts.asked_steps += steps
        self.counts.simulated += len(jobs)
        self.counts.steps += steps
        size = self.chunk or max(1, -(-len(jobs) // (2 * self.workers)))
        pending = [(k, list(jobs[k : k + size])) for k in range(0, len(jobs), size)]
        results: list[Any] = [None] * len(jobs)
        running: dict[Any, tuple[int, int]] = {}
        idle = list(range(self.workers))
        while pending or running:
            while pending and idle:
                first, some = pending.pop(0)
                who = idle.pop(0)
                running[self.actors[who].run.remote(some, size)] = (first, who)
            done, _ = ray.wait(list(running), num_returns=1)
            for reference in done:
                first, who = running.pop(reference)
                idle.append(who)
                found = ray.get(reference)
                results[first : first + len(found)] = found
        return results

    def process_ids(self) -> list[int]:
        """Processes of the actors, for tests that kill one."""
        return [int(pid) for pid in ray.get([a.pid.remote() for a in self.actors])]

    def close(self) -> None:
        for actor in self.actors:
            ray.kill(actor)
        self.actors = []
