"""Joints put to another state in the middle of a rollout: their motion begins anew, what drives hold goes on."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from engine_robots import at, one_joint

from ee_dist.engines.contract import Engine, Rollout
from ee_dist.engines.drivers import Commands
from ee_dist.engines.one_joint import OneJointEngine
from ee_dist.robots.model import Drive, Robot
from ee_dist.trials.log import Array

STEP_S, ROWS, ANEW, LATE = 0.002, 200, 80, 25


def led(delay_s: float = 0.0) -> Robot:
    robot = one_joint("hinge", (0.0, 1.0, 0.0), step_s=STEP_S)
    drive = Drive(joint="joint", kp=40.0, ki=0.0, kd=4.0, torque_limit=30.0, speed_limit=np.inf, rotor_inertia=0.0,
                  supply_nominal_v=0.0, delay_s=delay_s)  # fmt: skip
    return replace(robot, drives=(drive,))


def commands() -> Array:
    return 0.5 * np.sin(np.arange(ROWS) * STEP_S * 2 * np.pi * 2.0)[:, None]


def positions(engine: Engine, *rollouts: Rollout) -> list[Array]:
    return [log.channel("position") for log in engine.rollout(rollouts)]


@pytest.fixture(params=["general", "one_joint"])
def either(request: pytest.FixtureRequest, engine: Engine) -> Engine:
    return engine if request.param == "general" else OneJointEngine()


def test_a_motion_begun_anew_is_that_of_its_own_start(either: Engine) -> None:
    robot, sent, anew = led(), commands(), at([0.3], [-1.5])
    begun, alone, untouched = positions(
        either,
        Rollout(robot, Commands(sent), ROWS, start=at([0.1], [0.0]), again=((ANEW, anew),)),
        Rollout(robot, Commands(sent[ANEW:]), ROWS - ANEW, start=anew),
        Rollout(robot, Commands(sent), ROWS, start=at([0.1], [0.0])),
    )
    assert begun[ANEW] == pytest.approx(0.3, abs=1e-12)
    assert begun[ANEW:] == pytest.approx(alone, abs=1e-9)
    # Nobody else in the batch, and nothing before that row, is touched.
    np.testing.assert_array_equal(begun[:ANEW], untouched[:ANEW])
    assert np.abs(untouched[ANEW:] - alone).max() > 0.05


def test_commands_on_their_way_arrive_after_a_new_beginning(either: Engine) -> None:
    robot, sent, anew = led(delay_s=LATE * STEP_S), commands(), at([0.3], [-1.5])
    arriving = np.concatenate([np.repeat(sent[:1], LATE, axis=0), sent])[ANEW:ROWS]
    begun, told, forgotten = positions(
        either,
        Rollout(robot, Commands(sent), ROWS, start=at([0.1], [0.0]), again=((ANEW, anew),)),
        Rollout(led(), Commands(arriving), ROWS - ANEW, start=anew),
        Rollout(robot, Commands(sent[ANEW:]), ROWS - ANEW, start=anew),
    )
    assert begun[ANEW:] == pytest.approx(told, abs=1e-9)
    assert np.abs(forgotten - told).max() > 0.01


def test_rows_of_a_new_beginning_are_part_of_what_a_cache_goes_by() -> None:
    one = Rollout(led(), Commands(commands()), ROWS, start=at([0.1], [0.0]))
    others = [(), ((5, at([0.3], [0.0])),), ((6, at([0.3], [0.0])),), ((5, at([0.3], [1.0])),)]
    assert len({replace(one, again=again).key for again in others}) == len(others)
