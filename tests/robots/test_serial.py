"""A robot survives its plain form exactly, and what is not a robot is refused with one line that names the place."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ee_dist.robots.model import Law, Robot, World
from ee_dist.robots.quadruped import quadruped
from ee_dist.robots.serial import RobotFormatError, robot_from_dict, robot_from_json, robot_to_dict, robot_to_json

FLOATS = st.floats(allow_nan=False)


def test_quadruped_comes_back_equal_to_the_last_bit() -> None:
    robot = quadruped()
    again = robot_from_json(robot_to_json(robot))
    assert again == robot
    assert again.digest == robot.digest


@given(mass=FLOATS, limit=FLOATS, name=st.text(st.characters(exclude_categories=["Cs"])), value=FLOATS)
def test_any_number_and_name_comes_back(mass: float, limit: float, name: str, value: float) -> None:
    robot = quadruped().with_part("body", mass_kg=mass).with_drive("hip_rear_left", torque_limit=limit)
    robot = (
        replace(robot, name=name, assumed=((name, "kp"),))
        .with_law(Law(name, "hip_rear_left", ((name, value),)))
        .without("upper_front_left")
    )
    assert repr(robot_from_json(robot_to_json(robot))) == repr(robot)


def test_text_is_json_that_other_programs_read_even_with_infinity() -> None:
    robot = quadruped().with_joint("hip_rear_left", upper=math.inf, lower=-math.inf)

    def refuse(word: str) -> None:
        raise AssertionError(f"{word} is not JSON")

    data = json.loads(robot_to_json(robot), parse_constant=refuse)
    assert data["robot"]["joints"][4]["upper"] == "inf"
    assert robot_from_dict(data).joint("hip_rear_left").lower == -math.inf


def test_keys_with_a_default_may_be_left_out() -> None:
    data = robot_to_dict(quadruped())
    for drive in data["robot"]["drives"]:
        del drive["backlash"]
    del data["robot"]["world"]
    assert robot_from_dict(data) == replace(quadruped(), world=World())


def _part(data: Any) -> Any:
    return data["robot"]["parts"][1]


BREAKAGES: list[tuple[Callable[[Any], Any], str]] = [
    (lambda d: d["robot"].update(colour="red"), "robot: unknown key 'colour'"),
    (lambda d: _part(d).update(mass=1.0), "robot.parts[1]: unknown key 'mass'"),
    (lambda d: _part(d).pop("mass_kg"), "robot.parts[1]: missing key 'mass_kg'"),
    (lambda d: _part(d).update(mass_kg="heavy"), "robot.parts[1].mass_kg: expected a number, not 'heavy'"),
    (lambda d: _part(d).update(mass_kg=True), "robot.parts[1].mass_kg: expected a number, not True"),
    (lambda d: _part(d).update(com_m=[0.0, 0.0]), "robot.parts[1].com_m: expected 3 entries, not 2"),
    (lambda d: _part(d).update(shapes={}), "robot.parts[1].shapes: expected a list, not {}"),
    (lambda d: _part(d).update(name=3), "robot.parts[1].name: expected a text, not 3"),
    (lambda d: d["robot"].update(free_base=1), "robot.free_base: expected true or false, not 1"),
    (lambda d: d["robot"]["wiring"]["source"].append(0.5), "robot.wiring.source[8]: expected a whole number, not 0.5"),
    (lambda d: d["robot"].update(world=[]), "robot.world: expected a mapping, not []"),
    (lambda d: d.update(version=2), "version: expected 1, not 2"),
    (lambda d: d.pop("robot"), "file: missing key 'robot'"),
]


@pytest.mark.parametrize(("breakage", "message"), BREAKAGES, ids=[m for _, m in BREAKAGES])
def test_what_is_wrong_is_named_with_its_place(breakage: Callable[[Any], Any], message: str) -> None:
    data = robot_to_dict(quadruped())
    breakage(data)
    with pytest.raises(RobotFormatError) as caught:
        robot_from_dict(data)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("text", ["", "{", "[1]", "null", b"\xff\xfe\x00", "[" * 100_000])
def test_text_that_is_no_robot_is_refused(text: str | bytes) -> None:
    with pytest.raises(RobotFormatError):
        robot_from_json(text)


def test_every_field_is_in_the_plain_form() -> None:
    def keys(value: Any) -> int:
        if isinstance(value, dict):
            return len(value) + sum(keys(v) for v in value.values())
        return sum(keys(v) for v in value) if isinstance(value, list) else 0

    def fields_of(value: Any) -> int:
        if hasattr(value, "__dataclass_fields__"):
            names = value.__dataclass_fields__
            return len(names) + sum(fields_of(getattr(value, n)) for n in names)
        return sum(fields_of(v) for v in value) if isinstance(value, tuple) else 0

    robot: Robot = quadruped()
    assert keys(robot_to_dict(robot)["robot"]) == fields_of(robot)
