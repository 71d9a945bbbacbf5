"""What is PyBullet's own: robots share worlds, and worlds are few."""

from __future__ import annotations

import numpy as np
import pytest
from engine_robots import calm_commands

from ee_dist.engines.contract import Rollout
from ee_dist.engines.drivers import Commands
from ee_dist.engines.pybullet import engine as pybullet_engine
from ee_dist.engines.pybullet.engine import POOL, WORLDS, PyBulletEngine
from ee_dist.engines.pybullet.world import World
from ee_dist.robots.model import Robot
from ee_dist.robots.quadruped import quadruped


@pytest.fixture
def open_worlds(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """How many worlds are open, after each that was opened."""
    counts: list[int] = []
    now = 0

    class Counted(World):
        def __init__(self, robot: Robot, size: int) -> None:
            nonlocal now
            super().__init__(robot, size)
            now += 1
            counts.append(now)

        def close(self) -> None:
            nonlocal now
            super().close()
            now -= 1

    monkeypatch.setattr(pybullet_engine, "World", Counted)
    return counts


def floors(count: int) -> list[Robot]:
    """Robots of which no two can share a world."""
    return [quadruped().with_world(compliance_m_n=1e-5 * k) for k in range(count)]


def test_many_unlike_robots_open_few_worlds_and_move_as_each_does_alone(open_worlds: list[int]) -> None:
    steps, engine = 5, PyBulletEngine()
    driver = Commands(calm_commands(0, steps))
    asked = [Rollout(r, driver, steps) for r in floors(2 * WORLDS + POOL + 3)]
    together = engine.rollout(asked)
    assert len(open_worlds) == len(asked)
    assert max(open_worlds) <= WORLDS + POOL
    for k in (0, WORLDS, len(asked) - 1):
        alone = engine.rollout([asked[k]])[0]
        assert together[k].sensors.tobytes() == alone.sensors.tobytes()
    engine.close()


def test_like_robots_share_worlds_and_find_them_again(open_worlds: list[int]) -> None:
    steps, engine = 5, PyBulletEngine()
    asked = [Rollout(quadruped(), Commands(calm_commands(k, steps)), steps) for k in range(21)]
    first = engine.rollout(asked)
    assert len(open_worlds) == 4  # of 8, 8, 4 and 1
    again = engine.rollout(asked)
    assert len(open_worlds) == 4
    assert all(np.array_equal(a.sensors, b.sensors) for a, b in zip(first, again, strict=True))
    engine.close()
