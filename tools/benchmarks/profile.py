"""Where the time of a rollout goes: each stage of the loop under a stopwatch, processor time a robot-step."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from benchmarks.steps import StepSetting, sample_rollouts
from ee_dist.engines import loop
from ee_dist.tasks.wiring import EngineMaker

STAGES = (
    (loop.SensingPath, "step", "sensing effects"),
    (loop.Controllers, "step", "network"),
    (loop.DrivePath, "step", "drives"),
    (loop._Channels, "__call__", "true values of the channels"),
    (loop.DrivePath, "__init__", "set-up of the batch"),
    (loop.SensingPath, "__init__", "set-up of the batch"),
    (loop.Controllers, "__init__", "set-up of the batch"),
    (loop._Channels, "__init__", "set-up of the batch"),
)
"""What is timed: class, method, name of the row. Engines add their own."""


def _engine_stages(engine: str) -> tuple[tuple[type, str, str], ...]:
    if engine == "pybullet":
        from ee_dist.engines.pybullet.engine import BulletBodies, PyBulletEngine

        return (
            (BulletBodies, "step", "engine: torques sent, step"),
            (BulletBodies, "read", "reading joints and contacts"),
            (PyBulletEngine, "_place", "set-up of the batch"),
        )
    from ee_dist.engines.mujoco.bodies import MuJoCoBodies
    from ee_dist.engines.mujoco.engine import MuJoCoEngine

    return (
        (MuJoCoBodies, "step", "engine: torques sent, step"),
        (MuJoCoBodies, "read", "reading joints and contacts"),
        (MuJoCoEngine, "_place", "set-up of the batch"),
    )


@contextmanager
def _watched(stages: tuple[tuple[type, str, str], ...], spent: dict[str, int]) -> Iterator[None]:
    """Replace the methods by ones that add up their time, for a while."""
    before: list[tuple[type, str, Callable[..., Any]]] = []
    try:
        for owner, name, row in stages:
            method = getattr(owner, name)
            before.append((owner, name, method))
            setattr(owner, name, _timed(method, row, spent))
        yield
    finally:
        for owner, name, method in before:
            setattr(owner, name, method)


def _timed(method: Callable[..., Any], row: str, spent: dict[str, int]) -> Callable[..., Any]:
    def run(*arguments: Any, **named: Any) -> Any:
        began = time.process_time_ns()
        try:
            return method(*arguments, **named)
        finally:
            spent[row] = spent.get(row, 0) + time.process_time_ns() - began

    return run


def profile(setting: StepSetting) -> dict[str, float]:
    """Microseconds of a core a robot-step, for each stage and in all, largest first. The stopwatch itself costs about
    1 us a call, which a batch shares."""
    engine = EngineMaker(setting.engine, setting.threads)()
    rollouts = sample_rollouts(setting)
    engine.rollout(rollouts)
    spent: dict[str, int] = {}
    with _watched((*STAGES, *_engine_stages(setting.engine)), spent):
        began = time.process_time_ns()
        engine.rollout(rollouts)
        total = time.process_time_ns() - began
    engine.close()
    spent["recording, logs, everything else"] = total - sum(spent.values())
    per = 1e-3 / (setting.robots * setting.steps)
    found = {row: ns * per for row, ns in sorted(spent.items(), key=lambda item: -item[1])}
    return {**found, "in all": total * per}
