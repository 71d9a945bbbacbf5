"""Ray actors, one engine each, on this machine or on a cluster. A killed actor is restarted and its work done again."""

from __future__ import annotations

import logging
import math
import os
import socket
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
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

    def run(self, jobs: list[Job], chunk: int) -> tuple[list[Any], float]:
        """Results, and the seconds that they took."""
        began = time.perf_counter()
        return run_jobs(self.engine, jobs, chunk), time.perf_counter() - began

    def pid(self) -> int:
        return os.getpid()


ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
"""Workers are one process a core: numerical libraries must not start threads of their own in them."""


def start_ray(address: str | None, workers: int) -> None:
    """Connect to the cluster at ``address``, or start Ray on this machine. Raises EvaluatorError."""
    if ray.is_initialized():
        return
    options: dict[str, Any] = {"include_dashboard": False, "log_to_driver": False, "logging_level": logging.ERROR}
    if not address:
        # Inherited by the workers that Ray has ready: with a runtime_env it would start others, and a second later.
        with _environment(ONE_THREAD):
            ray.init(num_cpus=max(workers, os.cpu_count() or 1), **options)
        return
    options["runtime_env"] = {"env_vars": ONE_THREAD}
    del options["include_dashboard"]
    _knock(address)
    try:
        ray.init(address=address, **options)
    except Exception as error:
        first = str(error).strip().splitlines()[0] if str(error).strip() else type(error).__name__
        raise _unreachable(address, first) from None


def stop_ray() -> None:
    """Stop what ``start_ray`` started, or leave the cluster. Ray's own way at the end of a process begins with a nap."""
    if ray.is_initialized():
        ray.shutdown()


@contextmanager
def _environment(variables: Mapping[str, str]) -> Iterator[None]:
    """Set environment variables for a while."""
    before = {name: os.environ.get(name) for name in variables}
    os.environ.update(variables)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


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


WORTH_A_CALL = 24
"""Jobs below which a step costs nearly as much for the batch as for its robots: no call carries fewer unless there are
too few for all workers."""
NEWEST = 0.3
"""Weight of the newest measurement of a worker's speed."""


def helping(left: int, total: int, share: float, of_idle: float) -> int:
    """How many of the ``left`` of ``total`` jobs a worker gets that does ``share`` of the work, ``of_idle`` of what those do
    that have none now.

    A large lot goes out in ever smaller helpings, so that all finish together; a small one in one helping each, since
    a batch of half the size is nearly as slow as a whole one.
    """
    if total * share <= 2 * WORTH_A_CALL:
        return min(left, max(1, round(left * of_idle)))
    return min(left, max(WORTH_A_CALL, math.ceil(left * share / 2)))


class Shares:
    """Each worker's share of the work, by its measured speed. Changes when results come, never what."""

    def __init__(self, workers: int) -> None:
        self.speed: list[float | None] = [None] * workers

    def measured(self, who: int, steps: int, seconds: float) -> None:
        """``steps`` robot-steps took ``seconds``."""
        now, before = steps / max(seconds, 1e-9), self.speed[who]
        self.speed[who] = now if before is None else before + NEWEST * (now - before)

    def now(self) -> list[float]:
        """Share of each worker; they sum to 1. One of unknown speed counts as an average one."""
        known = [s for s in self.speed if s is not None]
        usual = sum(known) / len(known) if known else 1.0
        speeds = [usual if s is None else s for s in self.speed]
        whole = sum(speeds)
        return [s / whole for s in speeds]


class RayEvaluator:
    """Implements ``ee_dist.evaluation.jobs.Evaluator`` with ``workers`` actors (0: one a core).

    ``chunk`` is how many jobs a call carries (0: by the measured speed of the workers). Results do not depend on either.
    """

    def __init__(self, make_engine: EngineMaker, workers: int = 0, chunk: int = 0, address: str | None = None) -> None:
        if workers < 0 or chunk < 0:
            raise ValueError("evaluator: workers and chunk must be 0 (automatic) or more")
        self.workers = workers or (os.cpu_count() or 1)
        self.chunk = chunk
        self.counts = Counts()
        self.shares = Shares(self.workers)
        start_ray(address, self.workers)
        actor = ray.remote(num_cpus=1 if not workers else 0.01, max_restarts=-1, max_task_retries=-1)(_Worker)
        self.actors = [actor.remote(make_engine) for _ in range(self.workers)]

    def evaluate(self, jobs: Sequence[Job]) -> list[Any]:
        steps = sum(j.rollout.steps for j in jobs)
        self.counts.asked += len(jobs)
        self.counts.asked_steps += steps
        self.counts.simulated += len(jobs)
        self.counts.steps += steps
        results: list[Any] = [None] * len(jobs)
        running: dict[Any, tuple[int, int, int]] = {}
        idle, share, free = list(range(self.workers)), self.shares.now(), 1.0
        given = 0
        while given < len(jobs) or running:
            while given < len(jobs) and idle:
                who = idle.pop(0)
                size = self.chunk or helping(len(jobs) - given, len(jobs), share[who], share[who] / free)
                free -= share[who]
                some = list(jobs[given : given + size])
                running[self.actors[who].run.remote(some, size)] = (given, len(some), who)
                given += len(some)
            done, _ = ray.wait(list(running), num_returns=1)
            for reference in done:
                first, count, who = running.pop(reference)
                idle.append(who)
                free += share[who]
                found, seconds = ray.get(reference)
                self.shares.measured(who, sum(j.rollout.steps for j in jobs[first : first + count]), seconds)
                results[first : first + count] = found
        return results

    def process_ids(self) -> list[int]:
        """Processes of the actors, for tests that kill one."""
        return [int(pid) for pid in ray.get([a.pid.remote() for a in self.actors])]

    def close(self) -> None:
        for actor in self.actors:
            ray.kill(actor)
        self.actors = []
