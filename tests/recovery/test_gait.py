"""What is no gait: told by the log of a trial, and never told of one that walks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ee_dist.effects import apply, term
from ee_dist.engines.contract import Rollout
from ee_dist.engines.drivers import Network, weight_count
from ee_dist.engines.mujoco.engine import MuJoCoEngine
from ee_dist.engines.pybullet.engine import PyBulletEngine
from ee_dist.recovery.gait import BACK, ENERGY, FLIGHT, FLOOR, gait
from ee_dist.robots.quadruped import quadruped
from ee_dist.tasks.outcome import score
from ee_dist.trials.log import SensorLog

ROBOT = quadruped()
STEPS = 200


def log_of(
    height_m: np.ndarray, forward_m: np.ndarray, turn: np.ndarray | None = None, torque: float = 0.0
) -> SensorLog:
    """A trial in which the body has these heights (T,) and places along x (T,), joints at rest."""
    steps = len(height_m)
    pose = np.zeros((steps, 7))
    pose[:, 0], pose[:, 2], pose[:, 6] = forward_m, height_m, 1.0
    if turn is not None:
        pose[:, 3:] = turn
    still = np.zeros((steps, len(ROBOT.drives)))
    return SensorLog(
        np.arange(steps) * 0.01, np.zeros((steps, 8)), still, ROBOT.sensor_names, tuple(s.unit for s in ROBOT.sensors),
        ROBOT.motor_names, base_pose=pose, joints=still.copy(), torques=still + torque, travel_m=float(forward_m[-1]),
    )  # fmt: skip


STANDING = ROBOT.start_position_m[2]
TIME = np.arange(STEPS) * 0.01
SLOW = np.linspace(0.0, 0.2, STEPS)


def rolled(from_row: int) -> SensorLog:
    """Over by half a turn, slowly and not into the floor, upside down from this row on."""
    angle = np.clip(np.pi / 2 + (TIME - TIME[from_row]) * 5.0, 0.0, np.pi)
    turn = np.stack([np.sin(angle / 2), 0 * angle, 0 * angle, np.cos(angle / 2)], axis=1)
    height = STANDING + (0.035 - STANDING) * angle / np.pi + 0.2 * np.sin(angle)
    return log_of(height, SLOW, turn)


@pytest.mark.parametrize(
    ("log", "cheats"),
    [
        (log_of(np.full(STEPS, STANDING), SLOW), ()),
        (rolled(180), ()),
        (rolled(60), (BACK,)),
        (log_of(STANDING + np.maximum(0.0, 0.1 * np.sin(20 * TIME)), SLOW), ()),
        (log_of(STANDING + np.minimum(0.3 * TIME, 0.15), SLOW), (FLIGHT,)),
        (log_of(STANDING - 0.25 * TIME, SLOW), (FLOOR,)),
        (log_of(np.full(STEPS, STANDING), 5.0 * TIME**2), (ENERGY,)),
        (log_of(STANDING + 2.0 * TIME, 5.0 * TIME**2), (FLIGHT, ENERGY)),
    ],
)
def test_what_a_log_shows(log, cheats):
    found = gait(ROBOT, log)
    assert found is not None
    assert found.cheats == cheats, found


def test_downhill_gravity_gives_the_energy():
    """A slide down a slope on the feet is not from nowhere; the same on the level is."""
    down = log_of(np.full(STEPS, STANDING), 0.5 * 9.81 * np.sin(np.deg2rad(20)) * TIME**2)
    assert gait(apply(ROBOT, [term("floor_tilt", "floor", forward_deg=20.0)]), down).cheats == ()
    assert gait(ROBOT, down).cheats == (ENERGY,)
    assert gait(apply(ROBOT, [term("floor_tilt", "floor", forward_deg=-20.0)]), down).cheats == (ENERGY,)


def test_work_of_the_drives_is_not_from_nowhere():
    fast = log_of(np.full(STEPS, STANDING), 5.0 * TIME**2, torque=2.0)
    moving = replace(fast, joints=np.tile(40.0 * TIME[:, None], (1, len(ROBOT.drives))))
    found = gait(ROBOT, moving)
    assert ENERGY not in found.cheats


@pytest.mark.parametrize("engine", [PyBulletEngine, lambda: MuJoCoEngine(threads=1)])
def test_no_gait_of_an_engine_is_accused(engine):
    rng = np.random.default_rng(4)
    networks = [Network(tuple(map(float, np.round(rng.uniform(-1, 1, weight_count(8, 8)), 2)))) for _ in range(12)]
    lame = apply(ROBOT, [term("part_lost", "upper_rear_left")])
    made = engine()
    for robot in (ROBOT, lame):
        for log in made.rollout([Rollout(robot, n, 300, pose=True) for n in networks]):
            found = gait(robot, log)
            assert found.cheats == (), found
            assert found.energy_j < 0.2 * found.energy_limit_j, "the margin is thin"
    made.close()


def test_without_a_pose_nothing_is_said():
    assert gait(ROBOT, replace(log_of(np.full(STEPS, STANDING), SLOW), base_pose=None)) is None


def test_a_trial_that_cheats_does_not_count_as_restored():
    plain = score(1.0, [0.5, 2.0], (), ())
    assert (plain.recovered_fraction, plain.counted_fraction, plain.restored) == (2.0, 2.0, True)
    refused = score(1.0, [0.5, 2.0], (), (), [(), (BACK,)])
    assert (refused.recovered_fraction, refused.counted_fraction, refused.restored) == (2.0, 0.5, False)
    none = score(1.0, [2.0], (), (), [(BACK,)])
    assert not none.restored
    assert np.isnan(none.counted_fraction)
