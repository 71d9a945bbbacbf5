"""The paper's robot, by its numbers."""

from __future__ import annotations

import math
import pickle
from dataclasses import fields, replace

import numpy as np
import pytest

from ee_dist.engines.contract import Rollout
from ee_dist.engines.drivers import Commands, weight_count
from ee_dist.engines.pybullet.engine import PyBulletEngine
from ee_dist.robots.model import Law, Robot, RobotError
from ee_dist.robots.quadruped import quadruped

ROBOT = quadruped()


def test_nine_parts_eight_hinges_of_45_degrees_four_and_four_sensors():
    assert len(ROBOT.parts) == 9
    assert [j.kind for j in ROBOT.joints] == ["hinge"] * 8
    assert {(j.lower, j.upper) for j in ROBOT.joints} == {(-math.pi / 4, math.pi / 4)}
    assert [s.kind for s in ROBOT.sensors] == ["touch"] * 4 + ["angle"] * 4
    assert weight_count(len(ROBOT.sensors), len(ROBOT.drives)) == 68


def test_equal_robots_have_equal_digests_and_others_do_not():
    assert quadruped().digest == ROBOT.digest == pickle.loads(pickle.dumps(ROBOT)).digest
    assert ROBOT.with_drive("knee_front_left", kp=14.0).digest != ROBOT.digest


def test_every_field_counts_in_the_digest_but_what_was_assumed_of_it():
    other = {
        "name": "another",
        "parts": (replace(ROBOT.parts[0], mass_kg=9.0), *ROBOT.parts[1:]),
        "joints": ROBOT.joints[::-1],
        "drives": ROBOT.drives[::-1],
        "sensors": ROBOT.sensors[::-1],
        "wiring": replace(ROBOT.wiring, source=ROBOT.wiring.source[::-1]),
        "world": replace(ROBOT.world, friction=0.1),
        "laws": (Law("damper", "knee_front_left", (("share", 0.1),)),),
        "free_base": False,
        "start_position_m": (0.0, 0.0, 7.0),
        "start_rotation": (1.0, 0.0, 0.0, 0.0),
        "time_step_s": 0.5,
        "lost": ("upper_rear_left",),
    }
    assert set(other) == {f.name for f in fields(Robot) if f.compare}
    digests = {replace(ROBOT, **{name: value}).digest for name, value in other.items()}
    assert len(digests - {ROBOT.digest}) == len(other)


def test_a_lost_leg_takes_both_its_parts():
    broken = ROBOT.without("upper_rear_left")
    assert broken.lost == ("upper_rear_left", "lower_rear_left")
    assert len(broken.present_joints) == 6
    assert broken.without("lower_rear_left") == broken


@pytest.mark.parametrize(
    "call", [lambda r: r.part("tail"), lambda r: r.without("body"), lambda r: r.with_drive("tail", kp=1.0)]
)
def test_unknown_names_are_said(call):
    with pytest.raises(RobotError, match="there are"):
        call(ROBOT)


def test_it_stands_at_rest():
    engine = PyBulletEngine()
    (log,) = engine.rollout([Rollout(ROBOT, Commands(np.zeros((1, 8))), 300, pose=True)])
    engine.close()
    assert log.base_pose is not None
    assert abs(log.base_pose[-1, 2] - ROBOT.start_position_m[2]) < 0.01, "it sinks by millimetres into its rubber feet"
    assert np.abs(log.base_pose[-1, 3:5]).max() < 0.02, "it stands level"
    assert abs(log.travel_m) < 0.01
    assert (log.sensors[-1, :4] == 1.0).all(), "all feet are down"


def test_drives_stay_within_torque_speed_and_stops():
    engine = PyBulletEngine()
    rng = np.random.default_rng(0)
    wild = rng.uniform(-1.2, 1.2, size=(300, 8))
    (log,) = engine.rollout([Rollout(ROBOT, Commands(wild), 300, pose=True)])
    engine.close()
    assert log.joints is not None and log.torques is not None
    assert np.abs(log.joints).max() < math.pi / 4 + 0.12, "stops give a little, they do not let through"
    assert np.abs(np.diff(log.joints, axis=0)).max() / ROBOT.time_step_s < 3 * ROBOT.drives[0].speed_limit
