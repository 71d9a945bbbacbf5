from __future__ import annotations

import pickle
from dataclasses import replace

import pytest

from ee_dist.basics.altered import altered
from ee_dist.robots.describe import load_robot


@pytest.fixture(scope="module")
def robot():
    return load_robot("servo_pendulum")[0]


def test_it_is_what_dataclasses_make_of_it(robot):
    drive = robot.drives[0]
    assert altered(drive, kp=3.0, coulomb=0.1) == replace(drive, kp=3.0, coulomb=0.1)
    assert pickle.dumps(altered(drive, kp=3.0)) == pickle.dumps(replace(drive, kp=3.0))
    assert drive.kp != 3.0


def test_what_a_record_makes_of_its_own_fields_is_made_again(robot):
    drive = altered(robot.drives[0], stribeck_speed=0.7, stribeck_load_speed=0.0)
    assert drive.stribeck_load_speed == 0.7


def test_what_was_cached_is_not_taken_along(robot):
    before = robot.digest
    heavier = altered(robot, time_step_s=0.5 * robot.time_step_s)
    assert heavier.digest != before == robot.digest


def test_a_name_that_is_no_field(robot):
    with pytest.raises(TypeError, match="Drive has no field kpp"):
        altered(robot.drives[0], kpp=1.0)
