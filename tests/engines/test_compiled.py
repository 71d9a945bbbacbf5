"""Compiled functions do what is written: the bits of Python's own arithmetic, and no need for a file to keep them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numba
import numpy as np
import pytest
from engine_robots import no_commands
from hypothesis import given, settings
from hypothesis import strategies as st

from ee_dist.engines import compiled as module
from ee_dist.engines import drive, drivers, friction, goals, loop, transmission
from ee_dist.engines.contract import Rollout
from ee_dist.engines.mujoco.engine import MuJoCoEngine
from ee_dist.robots.model import COMMANDS, RobotError, Sensor
from ee_dist.robots.quadruped import quadruped


def both(function: Callable[..., None], arguments: list[Any]) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """What the function leaves in its arrays: compiled, and run by Python."""
    results = []
    for run in (function, function.py_func):  # type: ignore[attr-defined]
        mine = [a.copy() if isinstance(a, np.ndarray) else a for a in arguments]
        with np.errstate(all="ignore"):
            run(*mine)
        results.append([a for a in mine if isinstance(a, np.ndarray)])
    return results[0], results[1]


def assert_same_bits(function: Callable[..., None], arguments: list[Any]) -> None:
    for found, known in zip(*both(function, arguments), strict=True):
        assert found.tobytes() == known.tobytes()


sizes = {"robots": st.integers(1, 5), "seed": st.integers(0, 2**32 - 1)}


@settings(max_examples=30, deadline=None)
@given(channels=st.integers(1, 20), hidden=st.integers(1, 9), motors=st.integers(1, 12), **sizes)
def test_a_network(robots: int, channels: int, hidden: int, motors: int, seed: int) -> None:
    rng = np.random.default_rng(seed)

    def some(*shape: int) -> np.ndarray:
        return rng.uniform(-1, 1, (robots, *shape))

    weights = [some(hidden, channels + 1 + hidden), some(hidden), some(motors, hidden + 1)]
    kept = [some(channels + 1 + hidden), some(hidden + 1)]
    assert_same_bits(drivers._think, [some(channels), *weights, some(motors), some(motors), *kept, some(motors)])


@settings(max_examples=30, deadline=None)
@given(motors=st.integers(1, 9), loaded=st.booleans(), begun=st.booleans(), **sizes)
def test_friction(robots: int, motors: int, loaded: bool, begun: bool, seed: int) -> None:
    rng = np.random.default_rng(seed)
    shape = (robots, motors)
    table = rng.uniform(0, 0.5, (len(friction.RUBBING), *shape)) * rng.integers(0, 2, (len(friction.RUBBING), *shape))
    table[friction.RUBBING.index("friction_asymmetry")] -= 0.2
    rubbing = rng.random(shape) < 0.7
    torque, motor, speed, last_speed, last_torque = rng.normal(size=(5, *shape))
    fading, of_load, enabled, give, last_give = rng.uniform(0, 1, (5, *shape))
    arrays = [torque, motor, speed, fading, of_load, enabled, give, last_speed, last_torque, last_give]
    assert_same_bits(friction._rub, [table, np.full(shape, 2.0), rubbing, loaded, *arrays, begun, np.empty(shape)])


@settings(max_examples=30, deadline=None)
@given(motors=st.integers(1, 9), **sizes)
def test_goals_under_limits(robots: int, motors: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    shape = (robots, motors)
    by_position, led, eased, timed = (rng.random((4, *shape)) < 0.7)[:]
    top, most = (np.where(rng.random(shape) < 0.7, rng.uniform(0.1, 9, shape), np.inf) for _ in range(2))
    wanted, q, pace = rng.normal(size=(3, *shape))
    at = np.where(rng.random(shape) < 0.8, rng.normal(size=shape), np.nan)
    closed = rng.integers(0, 2, shape).astype(float)
    left, lasts = rng.uniform(0, 0.05, (2, *shape))
    told = np.where(rng.random(shape) < 0.5, wanted, rng.normal(size=shape))
    kinds = [by_position, led, eased & by_position & np.isfinite(most), timed & by_position]
    arrays = [wanted, q, closed, at, pace, left, told, np.empty(shape)]
    assert_same_bits(goals._lead, [*kinds, top, most, lasts, 0.01, *arrays])


@settings(max_examples=30, deadline=None)
@given(motors=st.integers(1, 9), **sizes)
def test_transmissions(robots: int, motors: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    shape = (robots, motors)
    play, compliance = rng.uniform(0, 0.1, (2, *shape)) * rng.integers(0, 2, (2, *shape))
    loose, elastic = play > 0, (play > 0) | (compliance > 0)
    rotor, landing, stiffness, damping = rng.uniform(0.01, 1, (4, *shape))
    active, q, qd, position, speed, carried = rng.normal(size=(6, *shape))
    side = rng.integers(-1, 2, shape) * loose.astype(float)
    assert_same_bits(transmission._follow, [elastic, loose, side, play, compliance, carried, q, qd, position, speed])
    given_up = [active, stiffness, damping, q, qd, side, position, speed, carried, np.empty(shape)]
    assert_same_bits(transmission._carry, [elastic, loose, play, compliance, rotor, landing, 0.01, *given_up])


@settings(max_examples=30, deadline=None)
@given(motors=st.integers(1, 9), elastic=st.booleans(), **sizes)
def test_a_drive_and_its_stops(robots: int, motors: int, elastic: bool, seed: int) -> None:
    rng = np.random.default_rng(seed)
    shape = (robots, motors)
    table = rng.uniform(0, 3, (len(drive.MOTOR), *shape)) * (rng.random((len(drive.MOTOR), *shape)) < 0.7)
    state = [rng.normal(0, 2, shape) for _ in range(3)]
    switched = [rng.uniform(0, 1, shape) for _ in range(3)]
    written = [rng.normal(0, 1, shape) for _ in range(6)]
    kinds = rng.integers(0, len(COMMANDS), shape)
    ahead = rng.normal(0, 2, shape)
    assert_same_bits(drive._drive, [kinds, table, *state, ahead, *switched, 0.01, elastic, *written])
    lower = rng.uniform(-2, 0, shape)
    present = rng.random(shape) < 0.8
    upper, inertia = lower + rng.uniform(0, 2, shape), rng.uniform(0.001, 0.1, shape)
    assert_same_bits(drive._stop, [*state, lower, upper, inertia, present, 0.01])


def test_not_a_number_is_not_made_one() -> None:
    """A motion that left the finite numbers must show in the log."""
    assert np.isnan(drive._within(np.nan, 1.0))
    assert np.isnan(drivers._clipped(np.nan))
    one = np.ones((1, 1))
    torque = np.nan * one
    drive._stop(torque, one, one, -one, 2 * one, one, one > 0, 0.01)
    assert np.isnan(torque).all()


def test_channels_show_their_joint_or_touch() -> None:
    rng = np.random.default_rng(3)
    joints, speeds, torque, current = rng.normal(size=(4, 2, 4))
    touch = np.array([[True, False], [False, True]])
    middle, half = rng.normal(size=(2, 2, 4))
    kinds, places = np.array([4, 5, 0, 1, 2, 6, 5, 3]), np.array([2, 0, 1, 3, 0, 0, 1, 1])
    out = np.full((2, 8), 7.0)
    loop._fill(kinds, places, joints, speeds, torque, current, touch, middle, half, out)
    assert np.array_equal(out[:, 0], (joints[:, 2] - middle[:, 2]) / half[:, 2])
    assert np.array_equal(out[:, [1, 6]], np.where(touch, 1.0, -1.0))
    assert np.array_equal(out[:, 2:5], np.stack([joints[:, 1], speeds[:, 3], torque[:, 0]], axis=1))
    assert np.array_equal(out[:, 7], current[:, 1])
    assert (out[:, 5] == 7.0).all()  # of the base: not filled here


def test_a_sensor_of_a_joint_without_a_drive_is_said() -> None:
    """Compiled code does not look whether a place is there."""
    robot = quadruped()
    blind = replace(robot, sensors=(*robot.sensors, Sensor("tail", "position", "tail_joint")))
    with pytest.raises(
        RobotError, match="'tail' shows joint 'tail_joint', which no drive moves; there are: hip_front_left"
    ):
        MuJoCoEngine(threads=1).rollout([Rollout(blind, no_commands(blind), 2)])


def test_without_a_folder_to_write_to_a_function_is_compiled_all_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    compile_in_memory = numba.njit

    def nowhere(*arguments: Any, cache: bool = False, **options: Any) -> Any:
        if cache:
            raise RuntimeError("cannot cache function: no locator available")
        return compile_in_memory(*arguments, **options)

    monkeypatch.setattr(module.numba, "njit", nowhere)
    assert module.compiled(lambda x: x + 1.0)(1.5) == 2.5
