"""How wall time falls with cores: a discrete-event simulation of a run, generation by generation and call by call.

A generation is asked for by one process (the search), which sends calls to workers one after the other; a worker simulates
what it got as one batch; when all results are back the next generation begins. Helpings follow the evaluator's own rule.
Nothing here is random.
"""

from __future__ import annotations

import heapq
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Any

from ee_dist.evaluation.ray_actors import helping


@dataclass(frozen=True)
class Costs:
    """Seconds. A call with n jobs of s steps keeps a worker busy for n set_up + s (per_batch_step + n per_robot_step)."""

    per_batch_step_s: float
    per_robot_step_s: float
    set_up_s: float
    call_s: float
    """From sending a call to having its result, less the work."""
    per_call_s: float
    """Of the search process, for each call it sends and takes back."""
    per_sent_s: float
    """Of the search process, for each job in a call."""
    per_asked_s: float
    """Of the search process, for each rollout asked for, simulated or known."""
    per_generation_s: float
    start_s: float
    """From the command to the first generation: imports, Ray, workers."""

    @classmethod
    def of(cls, values: Mapping[str, float]) -> Costs:
        """From a table that may hold more."""
        return cls(**{f.name: float(values[f.name]) for f in fields(cls)})

    def work_s(self, jobs: int, steps: int) -> float:
        """Of a worker, for a call."""
        return jobs * self.set_up_s + steps * (self.per_batch_step_s + jobs * self.per_robot_step_s)


@dataclass(frozen=True)
class Generation:
    """``asked`` rollouts, of which ``simulated`` are new, of ``steps`` steps each."""

    asked: int
    simulated: int
    steps: int


@dataclass
class Outcome:
    """Where the wall time of a run goes. The four parts add up to it: start, search (one process works), work (workers
    busy, had all been equally busy), waiting (for the last worker of a generation, calls under way)."""

    wall_s: float = 0.0
    parts: dict[str, float] = field(default_factory=dict)
    busy: float = 0.0
    """Share of the workers' time in which they simulate."""


def generations(trace: Sequence[Mapping[str, Any]]) -> list[Generation]:
    """From the JSON of a run."""
    return [Generation(int(g["asked"]), int(g["simulated"]), int(g["steps"])) for g in trace]


def simulate(trace: Sequence[Generation], costs: Costs, workers: int) -> Outcome:
    """One run on ``workers`` workers."""
    clock, search, work = costs.start_s, 0.0, 0.0
    for g in trace:
        thinking = costs.per_generation_s + g.asked * costs.per_asked_s
        clock += thinking
        search += thinking
        end, sending, worked = _generation(g, costs, workers, clock)
        clock, search, work = end, search + sending, work + worked
    even = work / workers
    parts = {"start": costs.start_s, "search": search, "work": even}
    parts["waiting"] = max(clock - sum(parts.values()), 0.0)
    return Outcome(clock, parts, work / (workers * clock) if clock else 0.0)


def _generation(g: Generation, costs: Costs, workers: int, clock: float) -> tuple[float, float, float]:
    """When its last result is in, and the time that the search and the workers spent on it."""
    idle = deque(range(min(workers, g.simulated)))
    running: list[tuple[float, int]] = []
    left, sending, worked = g.simulated, 0.0, 0.0
    while left or running:
        while left and idle:
            size = helping(left, g.simulated, 1.0 / workers, 1.0 / len(idle))
            left -= size
            spent = costs.per_call_s / 2 + size * costs.per_sent_s
            clock, sending = clock + spent, sending + spent
            busy = costs.work_s(size, g.steps)
            worked += busy
            heapq.heappush(running, (clock + costs.call_s + busy, idle.popleft()))
        done, who = heapq.heappop(running)
        clock = max(clock, done) + costs.per_call_s / 2
        sending += costs.per_call_s / 2
        idle.append(who)
    return clock, sending, worked


def study(trace: Sequence[Generation], costs: Costs, cores: int, runs: int) -> tuple[float, int]:
    """Wall time of ``runs`` such runs on ``cores`` cores, and how many go side by side when that is least.

    Side by side runs share the cores evenly; a run that ends makes room for the next one.
    """
    best: tuple[float, int] | None = None
    for beside in _choices(min(runs, cores)):
        each = simulate(trace, costs, max(1, cores // beside)).wall_s
        wall = each * -(-runs // beside)
        if best is None or wall < best[0]:
            best = (wall, beside)
    assert best is not None
    return best


def _choices(most: int) -> list[int]:
    """Numbers of runs side by side that are worth trying: powers of two, and as many as possible."""
    found, k = [], 1
    while k < most:
        found.append(k)
        k *= 2
    return [*found, most]


def limit_s(trace: Sequence[Generation], costs: Costs) -> float:
    """Wall time that no number of cores goes below: one robot a worker in every generation."""
    return simulate(trace, costs, max(g.simulated for g in trace) or 1).wall_s
