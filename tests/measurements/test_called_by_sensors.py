"""Columns that are called as the robot's sensors are belong to them, with a path before the name or a unit behind it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from ee_dist.measurements.importer import import_files
from ee_dist.measurements.mapping_file import read_mapping
from ee_dist.measurements.proposal.by_sensor import column_of
from ee_dist.measurements.proposal.files import proposal_for
from ee_dist.measurements.proposal.model import LIKELY, Hints
from ee_dist.measurements.proposal.words import read_name
from ee_dist.measurements.proposal.write import as_yaml
from ee_dist.robots.describe import load_robot
from ee_dist.robots.model import Robot, Sensor

URDF = """<robot name="cart"><link name="rail"/>
<link name="cart"><inertial><mass value="0.5"/>
<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="pole"><inertial><origin xyz="0 0 -0.3"/><mass value="0.2"/>
<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="slide" type="prismatic"><parent link="rail"/><child link="cart"/><axis xyz="1 0 0"/>
<limit lower="-0.5" upper="0.5" effort="10" velocity="2"/></joint>
<joint name="hinge" type="continuous"><parent link="cart"/><child link="pole"/><axis xyz="0 1 0"/></joint></robot>"""
DRIVEN = """urdf: cart.urdf
free_base: false
drives: {slide: {command: torque}, hinge: {command: none}}
sensors:
  - {name: cart_position, kind: position, target: slide}
  - {name: pole_angle, kind: position, target: hinge}
  - {name: cart_velocity, kind: velocity, target: slide}
"""
T = np.arange(1000) / 200
CART, POLE = 0.2 * np.sin(2 * T) + 0.05 * np.sin(5.1 * T), 0.9 * np.cos(3.3 * T)
FORCE = 2 * np.sin(2.3 * T + 0.4)


def cart(folder: Path) -> Robot:
    (folder / "cart.urdf").write_text(URDF)
    (folder / "cart.yaml").write_text(DRIVEN)
    return load_robot(folder / "cart.yaml")[0]


@pytest.mark.parametrize("joints", [None, ["slide", "hinge"]])
@pytest.mark.parametrize(
    ("names", "sizes"),
    [
        (("data.cart_position", "data.pole_angle", "data.cart_velocity", "force_slide_N"), (1, 1, 1)),
        (("cart_position_mm", "pole_angle_deg", "cart_velocity_m_s", "force_slide_N"), (1000, 180 / np.pi, 1)),
        (("run/cart_position [m]", "run/pole_angle [rad]", "run/cart_velocity [m/s]", "command_slide_N"), (1, 1, 1)),
    ],
)
def test_a_log_in_the_sensors_words_needs_no_mapping(
    tmp_path: Path, names: tuple[str, ...], sizes: tuple[float, ...], joints: list[str] | None
) -> None:
    robot = cart(tmp_path)
    seen = [v * s for v, s in zip((CART, POLE, np.gradient(CART, T)), sizes, strict=True)]
    frame = {"time": T} | dict(zip(names, (*seen, FORCE), strict=True)) | {"cart_position_hat": CART + 0.01}
    pd.DataFrame(frame).to_csv(tmp_path / "log.csv", index=False)
    proposal = proposal_for([tmp_path / "log.csv"], robot, Hints(joints=joints))
    assert not proposal.questions, proposal.questions
    (tmp_path / "mapping.yaml").write_text(as_yaml(proposal, "cart.yaml", "log.csv"))
    ((record, _),) = import_files([tmp_path / "log.csv"], read_mapping(tmp_path / "mapping.yaml"), robot)
    log = record.log
    for k, wanted in enumerate((CART, POLE, np.gradient(CART, T))):
        at = np.interp(log.times_s, T, wanted)
        assert np.allclose(log.sensors[:, k], at, atol=1e-9)
    assert np.ptp(log.commands[:, 0]) == pytest.approx(np.ptp(FORCE), rel=0.01)
    if names[-1] == "force_slide_N":
        assert next(c.sure for c in proposal.choices if c.group == "commands") == LIKELY


def test_a_small_angle_is_not_taken_for_turns(tmp_path: Path) -> None:
    frame = pd.DataFrame({"time": T, "cart_position": CART, "pole_angle": 0.02 * POLE, "command_slide_N": FORCE})
    frame.to_csv(tmp_path / "log.csv", index=False)
    proposal = proposal_for([tmp_path / "log.csv"], cart(tmp_path), Hints())
    (choice,) = [c for c in proposal.choices if c.name == "pole_angle"]
    assert (choice.entry or {})["unit"] == "rad" and choice.sure == LIKELY


@pytest.mark.parametrize(
    ("address", "found"),
    [
        ("cart_position", ("cart_position", None)),
        ("state[cart_position]", ("state[cart_position]", None)),
        ("a.b.cart_position_mm", ("a.b.cart_position_mm", "mm")),
        ("desired.cart_position", None),
        ("cart_position_hat", None),
        ("cart_position_deg", None),
    ],
)
def test_what_is_called_as_a_sensor(address: str, found: tuple[str, str | None] | None) -> None:
    assert column_of(Sensor("cart_position", "position", "slide", "m"), [address, "time"]) == found


def test_of_two_columns_of_one_name_neither_is_taken() -> None:
    assert column_of(Sensor("height", "height", "", "m"), ["a.height", "b.height"]) is None


@pytest.mark.parametrize(("name", "unit"), [("x_speed_m_s", "m/s"), ("w_rad_s", "rad/s"), ("team_s", None)])
def test_metres_a_second(name: str, unit: str | None) -> None:
    assert read_name(name).unit == unit
