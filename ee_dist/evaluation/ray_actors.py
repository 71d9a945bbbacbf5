"""Ray actors, one engine each, on this machine or on a cluster. A killed actor is restarted and its work done again."""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from platform import node
from signal import SIGKILL
from typing import Any

import ray
from ray.exceptions import ActorDiedError, RayError, RayTaskError

from ee_dist.basics.cores import usable
from ee_dist.engines.contract import Engine
from ee_dist.evaluation.installed import installed
from ee_dist.evaluation.jobs import Counts, Job
from ee_dist.evaluation.ray_session import EvaluatorError, RayLostError, lost, start_ray
from ee_dist.evaluation.serial import run_jobs

EngineMaker = Callable[[], Engine]


class _Worker:
    """Lives in an actor process; its engine is made there."""

    def __init__(self, make_engine: EngineMaker) -> None:
        try:
            self.engine = make_engine()
        except SystemExit as stop:
            raise RuntimeError(f"sys.exit({stop.code!r}) was called") from None
        self.told_s = 0.0

    def run(self, jobs: list[Job], chunk: int) -> tuple[list[Any], float, float]:
        """Results, the seconds that they took, and the processor time since the last call (s); the first has all until then."""
        began = time.perf_counter()
        try:
            results, took_s = run_jobs(self.engine, jobs, chunk), time.perf_counter() - began
            before, self.told_s = self.told_s, time.process_time()
            return results, took_s, self.told_s - before
        except SystemExit as stop:
            raise RuntimeError(f"sys.exit({stop.code!r}) was called") from None

    def who(self) -> tuple[str, int, dict[str, str]]:
        """Host, process, and what is installed there."""
        return node(), os.getpid(), installed()


WORTH_A_CALL = 48
"""Jobs below which a step costs nearly as much for the batch as for its robots: no call carries fewer unless there are
too few for all workers."""
AT_ONCE = 512
"""Jobs of one worker up to which it gets them in one call: each further batch costs as much, step by step, as some ten robots."""
LOOK_S = 1.0
"""How long to wait for results before looking whether Ray is still there."""
LOST_S = 5.0
"""How long what ended a worker may take to end itself: a raylet that was asked to ends its workers first."""
PATIENCE, PATIENCE_S = 30.0, 120.0
"""A call that takes this many times what it should, and this long (s), hangs: its worker is killed, and it is done again."""
NEWEST = 0.3
"""Weight of the newest measurement of a worker's speed."""


def helping(left: int, total: int, share: float, of_idle: float) -> int:
    """How many of the ``left`` of ``total`` jobs a worker gets that does ``share`` of the work, ``of_idle`` of what those do
    that have none now.

    A large lot goes out in ever smaller helpings, so that all finish together; a small one in one helping each, since
    a batch of half the size is nearly as slow as a whole one.
    """
    if total * share <= AT_ONCE:
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
    ``folder``: Ray's, where somebody guards it. A run has it in a process of its own (``ray_apart``).
    """

    def __init__(
        self,
        make_engine: EngineMaker,
        workers: int = 0,
        chunk: int = 0,
        address: str | None = None,
        folder: str | None = None,
    ) -> None:
        if workers < 0 or chunk < 0:
            raise ValueError("evaluator: workers and chunk must be 0 (automatic) or more")
        self.workers = workers or usable()
        self.chunk = chunk
        self.counts = Counts()
        self.shares = Shares(self.workers)
        self.worked_s = 0.0
        """Processor time of the workers."""
        self.patience_s = PATIENCE_S
        start_ray(address, self.workers, folder)
        # Next to no share of a core: what a lost machine leaves must find a place on one that is full.
        actor = ray.remote(num_cpus=0.01, max_restarts=-1, max_task_retries=-1, scheduling_strategy="SPREAD")(_Worker)
        self.actors = [actor.remote(make_engine) for _ in range(self.workers)]
        self._asked: list[Any] = [a.who.remote() for a in self.actors]
        self._pids: dict[int, int] = {}

    def evaluate(self, jobs: Sequence[Job]) -> list[Any]:
        """Raises EvaluatorError where Ray is lost, and what a job raised where one did."""
        self.counts.add(jobs)
        results: list[Any] = [None] * len(jobs)
        running: dict[Any, _Call] = {}
        idle, share, free = list(range(self.workers)), self.shares.now(), 1.0
        given = 0
        while given < len(jobs) or running:
            while given < len(jobs) and idle:
                who = idle.pop(0)
                size = self.chunk or helping(len(jobs) - given, len(jobs), share[who], share[who] / free)
                free -= share[who]
                some = list(jobs[given : given + size])
                call = _Call(given, len(some), who, sum(j.rollout.steps for j in some), time.monotonic())
                running[self._said(self.actors[who].run.remote, some, size)] = call
                given += len(some)
            for reference in self._done(running):
                call = running.pop(reference)
                idle.append(call.who)
                free += share[call.who]
                self._compare(call.who)
                found, seconds, worked_s = self._said(ray.get, reference)
                self.worked_s += worked_s
                self.shares.measured(call.who, call.steps, seconds)
                results[call.first : call.first + call.count] = found
        return results

    def _done(self, running: dict[Any, _Call]) -> list[Any]:
        """References whose results are there, as soon as one is."""
        while True:
            done, _ = self._said(ray.wait, list(running), num_returns=1, timeout=LOOK_S)
            if done:
                return list(done)
            if gone := lost():
                raise RayLostError(f"Ray is lost: {gone}")
            self._end_hanging(running)

    def _end_hanging(self, running: dict[Any, _Call]) -> None:
        """Kill the workers of calls that take far longer than they should; Ray starts them and their calls again."""
        for call in running.values():
            speed = self.shares.speed[call.who]
            patience = max(self.patience_s, PATIENCE * call.steps / speed) if speed else PATIENCE * self.patience_s
            if time.monotonic() - call.began > patience:
                with suppress(RayError):
                    ray.kill(self.actors[call.who], no_restart=False)
                # A stopped process does not listen to Ray. On another machine Ray's own kill has to do.
                if call.who in self._pids:
                    with suppress(OSError):
                        os.kill(self._pids[call.who], SIGKILL)
                call.began = time.monotonic()

    def _compare(self, who: int) -> None:
        """Refuse a worker where something else is installed than here. Raises EvaluatorError."""
        if self._asked[who] is None:
            return
        host, pid, theirs = self._said(ray.get, self._asked[who])
        self._asked[who] = None
        if host == node():
            self._pids[who] = pid
        for name, ours in installed().items():
            if theirs.get(name) != ours:
                raise EvaluatorError(
                    f"the worker on {host} has {name} {theirs.get(name, '-')}, this machine {ours}: results would differ; "
                    "install the same there, or leave that machine out"
                )

    def _said(self, ask: Callable[..., Any], *arguments: Any, **named: Any) -> Any:
        """What Ray answers. Raises what a job raised, and EvaluatorError for what is Ray's own."""
        try:
            return ask(*arguments, **named)
        except RayTaskError as error:
            cause = getattr(error, "cause", None)
            raise (cause if isinstance(cause, Exception) else EvaluatorError(_last_line(error))) from None
        except ActorDiedError as error:
            if gone := lost(LOST_S):
                raise RayLostError(f"Ray is lost: {gone}") from None
            raise EvaluatorError(f"a worker could not be started: {_last_line(error)}") from None
        except RayError as error:
            raise RayLostError(f"Ray is lost: {lost(LOST_S) or _last_line(error)}") from None

    def process_ids(self) -> list[int]:
        """Processes of the actors, for tests that kill one."""
        return [int(pid) for _, pid, _ in ray.get([a.who.remote() for a in self.actors])]

    def close(self) -> None:
        for actor in self.actors if ray.is_initialized() else ():
            with suppress(RayError):
                ray.kill(actor)
        self.actors = []


@dataclass
class _Call:
    """Jobs ``first`` and ``count`` more at a worker, ``steps`` robot-steps in all, since ``began`` (s)."""

    first: int
    count: int
    who: int
    steps: int
    began: float


def _last_line(error: Exception) -> str:
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    return lines[-1] if lines else type(error).__name__
