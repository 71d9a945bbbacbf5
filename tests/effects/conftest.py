"""Fixtures of the effect tests; their robots are in ``effect_robots.py``."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

# Under every import mode of pytest; a module called conftest could be another folder's.
sys.path.insert(0, str(Path(__file__).parent))

from effect_robots import Bench

from ee_dist.engines.contract import Engine
from ee_dist.engines.mujoco.engine import MuJoCoEngine
from ee_dist.engines.pybullet.engine import PyBulletEngine


@pytest.fixture(scope="session", params=["pybullet", "mujoco"])
def bench(request: pytest.FixtureRequest) -> Iterator[Bench]:
    """Both engines in turn: an effect is the same in each."""
    engine: Engine = PyBulletEngine() if request.param == "pybullet" else MuJoCoEngine(threads=1)
    yield Bench(engine)
    engine.close()


@pytest.fixture(scope="session")
def pybullet() -> Iterator[PyBulletEngine]:
    engine = PyBulletEngine()
    yield engine
    engine.close()
