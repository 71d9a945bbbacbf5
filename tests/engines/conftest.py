"""Fixtures of the engine tests; their robots are in ``engine_robots.py``."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

# Under every import mode of pytest; a module called conftest could be another folder's.
sys.path.insert(0, str(Path(__file__).parent))

from ee_dist.engines.contract import Engine
from ee_dist.engines.mujoco.engine import MuJoCoEngine
from ee_dist.engines.pybullet.engine import PyBulletEngine


@pytest.fixture(scope="session")
def engines() -> Iterator[dict[str, Engine]]:
    """Both engines, used again and again as a run uses them."""
    made: dict[str, Engine] = {"pybullet": PyBulletEngine(), "mujoco": MuJoCoEngine(threads=1)}
    yield made
    for engine in made.values():
        engine.close()


@pytest.fixture(params=["pybullet", "mujoco"])
def engine(request: pytest.FixtureRequest, engines: dict[str, Engine]) -> Engine:
    return engines[request.param]
