"""PyBullet's states read by its C interface and by its functions: the same bits, and the second where the first is not."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pybullet as p
import pytest
from engine_robots import at, ball, mixed_models, network, no_commands, one_joint, sled

from ee_dist.engines.contract import Rollout
from ee_dist.engines.pybullet import native
from ee_dist.engines.pybullet import reading as reading_module
from ee_dist.engines.pybullet.engine import PyBulletEngine
from ee_dist.robots.model import Sensor
from ee_dist.trials.log import SensorLog


@pytest.fixture
def shown() -> None:
    """Where PyBullet's own wheel is used, the C interface must be found: its tests may not fall silent."""
    if native.interface() is None:
        if sys.platform == "linux" and sys.version_info[:2] == (3, 11):
            pytest.fail("PyBullet's C interface was not found")
        pytest.skip("this build of PyBullet does not show its C interface")


@pytest.fixture
def both(shown: None) -> tuple[PyBulletEngine, PyBulletEngine]:
    """An engine that reads by the C interface, and one that does not."""
    return PyBulletEngine(), PyBulletEngine(native=False)


def assert_same(found: list[SensorLog], known: list[SensorLog]) -> None:
    for a, b in zip(found, known, strict=True):
        assert a.sensors.tobytes() == b.sensors.tobytes()
        assert a.travel_m == b.travel_m
        assert (a.base_pose is None) == (b.base_pose is None)
        if a.base_pose is not None and b.base_pose is not None:
            assert a.base_pose.tobytes() == b.base_pose.tobytes()


@pytest.mark.parametrize("pose", [False, True])
def test_walking_robots_read_alike(both: tuple[PyBulletEngine, PyBulletEngine], pose: bool) -> None:
    extra = (Sensor("vx", "speed_x", ""), Sensor("turning", "turn_rate", ""), Sensor("roll", "roll", ""))
    models = mixed_models()
    asked = [Rollout(m, network(k), 120, pose=pose) for k in range(3) for m in models]
    more = [
        replace(r, model=replace(r.model, sensors=r.model.sensors + extra), driver=no_commands(r.model)) for r in asked
    ]
    for rollouts in (asked, more):
        known = both[1].rollout(rollouts)
        assert_same(both[0].rollout(rollouts), known)
        # Feet must have touched and left the floor, or contacts were not compared.
    touches = np.concatenate([log.sensors[:, :4] for log in both[1].rollout(asked)])
    assert set(np.unique(touches)) == {-1.0, 1.0}


def test_robots_without_joints_or_floor_read_alike(both: tuple[PyBulletEngine, PyBulletEngine]) -> None:
    swinging = one_joint("hinge", (0.0, 1.0, 0.0))
    asked = [
        Rollout(ball(0.15, com_m=(0.01, 0.0, 0.02)), no_commands(ball()), 60, pose=True),
        Rollout(sled(), no_commands(sled()), 60, start=at([], [], [0, 0, 0.05, 0, 0, 0, 1], [1, 0, 0, 0, 0, 0])),
        Rollout(swinging, no_commands(swinging), 60, start=at([0.4], [0.1])),
    ]
    known = both[1].rollout(asked)
    assert_same(both[0].rollout(asked), known)
    assert known[0].sensors[-1, 1] == 1.0  # the ball has landed


def test_more_contacts_than_there_is_room_for(
    both: tuple[PyBulletEngine, PyBulletEngine], monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = [Rollout(m, network(k), 80) for k, m in enumerate(mixed_models())]
    known = both[1].rollout(asked)
    monkeypatch.setattr(reading_module, "CONTACTS", 1)
    assert_same(both[0].rollout(asked), known)


def test_without_the_interface_pybullets_functions_do(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    foreign = tmp_path / "library.so"
    foreign.write_bytes(b"MZ" + bytes(100))
    with pytest.raises(ValueError, match="not a little-endian 64-bit ELF file"):
        native._symbols(foreign, ("main",))
    with pytest.raises(ValueError, match="names no single symbol"):
        native._symbols(Path(p.__file__), ("no_such_symbol_in_bullet",))
    native.interface.cache_clear()
    try:
        monkeypatch.setattr(native, "_TABLE", "no_such_symbol_in_bullet")
        assert native.interface() is None
        log = PyBulletEngine().rollout([Rollout(ball(), no_commands(ball()), 10)])[0]
        assert log.finite
    finally:
        native.interface.cache_clear()


@pytest.mark.usefixtures("shown")
def test_an_interface_that_disagrees_is_not_used(monkeypatch: pytest.MonkeyPatch) -> None:
    native.interface.cache_clear()
    try:
        monkeypatch.setattr(native, "_DECLARATIONS", native._DECLARATIONS.replace("double on_a[3]", "double on_a[4]"))
        assert native.interface() is None
    finally:
        native.interface.cache_clear()
