"""The time step of a robot whose description names none: as coarse as its drives allow, and fine enough for what they do."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ee_dist.engines.contract import Rollout
from ee_dist.engines.drivers import Commands
from ee_dist.engines.mujoco.engine import MuJoCoEngine
from ee_dist.robots.describe import load_robot, read_body
from ee_dist.robots.starter import starter
from ee_dist.robots.time_step import FINE_S, STEPS_S, coarsest_step_s
from ee_dist.trials.log import State

ARM = """<robot name="arm"><link name="base"/>
  <link name="upper"><inertial><origin xyz="0.1 0 0"/><mass value="0.4"/>
    <inertia ixx="1e-4" iyy="1e-3" izz="1e-3" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="lower"><inertial><origin xyz="0.1 0 0"/><mass value="0.3"/>
    <inertia ixx="1e-4" iyy="1e-3" izz="1e-3" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="a" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" effort="9" velocity="9"/></joint>
  <joint name="b" type="revolute"><parent link="upper"/><child link="lower"/><origin xyz="0.2 0 0"/><axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" effort="9" velocity="9"/></joint></robot>"""


def arm(folder: Path, kp: float = 18.0, kd: float = 0.4, rotor: float = 0.02, **more: object):
    (folder / "arm.urdf").write_text(ARM)
    drive = {"kp": kp, "kd": kd, "torque_limit": 9.0, "speed_limit": 30.0, "rotor_inertia": rotor}
    return load_robot({"urdf": str(folder / "arm.urdf"), "drives": {"a": drive, "b": drive}, **more})


@pytest.mark.parametrize(("kp", "rotor", "step"), [(18.0, 0.02, 0.01), (60.0, 0.02, 0.005), (900.0, 0.02, FINE_S)])
def test_stiffer_drives_are_stepped_more_finely(tmp_path: Path, kp: float, rotor: float, step: float) -> None:
    robot, notes = arm(tmp_path, kp, rotor=rotor)
    assert robot.time_step_s == step and not any("coarse" in n for n in notes)


@pytest.mark.parametrize(
    ("assumed", "step"),
    [([], 0.01), (["rotor_inertia"], FINE_S), (["rotor_inertia", "kp", "kd"], 0.01), (["kp"], 0.01)],
)
def test_a_rotor_that_was_guessed_may_be_a_tenth_beside_gains_that_are_known(
    tmp_path: Path, assumed: list[str], step: float
) -> None:
    arm(tmp_path)
    drive = {"kp": 18.0, "kd": 0.4, "torque_limit": 9.0, "speed_limit": 30.0, "rotor_inertia": 0.02, "assumed": assumed}
    robot, _ = load_robot({"urdf": str(tmp_path / "arm.urdf"), "drives": {"a": drive, "b": drive}})
    assert robot.time_step_s == step


def test_contacts_and_free_swings_keep_the_fine_one(tmp_path: Path) -> None:
    assert arm(tmp_path, has_floor=True)[0].time_step_s == FINE_S
    drive = {"command": "torque", "torque_limit": 5.0, "speed_limit": 20.0}
    robot, _ = load_robot({"urdf": str(tmp_path / "arm.urdf"), "drives": {"a": drive, "b": drive}})
    assert robot.time_step_s == FINE_S


def test_a_step_that_is_named_is_taken_and_one_that_is_too_coarse_is_told(tmp_path: Path) -> None:
    robot, notes = arm(tmp_path, time_step_s=0.004)
    assert robot.time_step_s == 0.004 and not any("coarse" in n for n in notes)
    robot, notes = arm(tmp_path, time_step_s=1 / 30)
    assert robot.time_step_s == pytest.approx(1 / 30)
    assert any("time_step_s 0.0333333: too coarse for its controllers, which need 0.01 s" in n for n in notes)


@pytest.mark.parametrize("kp", [4.0, 18.0, 60.0])
def test_the_motion_is_that_of_a_step_ten_times_finer(tmp_path: Path, kp: float) -> None:
    robot, _ = arm(tmp_path, kp, kd=0.02 * kp)
    assert robot.time_step_s in STEPS_S and robot.time_step_s <= coarsest_step_s(robot)
    found = []
    for every in (1, 10):
        fine = replace(robot, time_step_s=robot.time_step_s / every)
        t = np.arange(0, 3.0, robot.time_step_s)
        sent = np.stack([0.6 * np.sin(4 * t), 0.5 * np.sin(7 * t)], axis=1)
        commands = np.repeat(sent, every, axis=0)
        (log,) = MuJoCoEngine(1).rollout([Rollout(fine, Commands(commands), len(commands), pose=True)])
        assert log.joints is not None
        found.append(log.joints[::every])
    off = np.sqrt(np.mean((found[0] - found[1]) ** 2)) / np.sqrt(np.mean(found[1] ** 2))
    assert off < 0.04, "of the motion"


def test_a_link_too_light_for_its_gains_is_told_and_a_starter_never_has_one(tmp_path: Path) -> None:
    base, last = ARM.split('<link name="lower">')
    last = last.replace('value="0.3"', 'value="0.01"').replace("1e-4", "1e-5").replace("1e-3", "1e-5")
    light = f'{base}<link name="lower">{last.replace("0.1 0 0", "0.01 0 0")}'
    (tmp_path / "light.urdf").write_text(light)
    drive = {"kp": 100.0, "kd": 0.05, "torque_limit": 9.0}
    robot, notes = load_robot({"urdf": str(tmp_path / "light.urdf"), "drives": {"a": drive, "b": drive}})
    assert robot.time_step_s == FINE_S
    (told,) = [n for n in notes if "too coarse" in n]
    assert "the drive of b (kp 100, kd 0.05) moves only 1" in told and "rotor_inertia" in told
    begun = starter(read_body("urdf", tmp_path / "light.urdf"), "urdf", "light.urdf", "light.urdf")
    assert all(d.rotor_inertia > 0 for d in begun.robot.drives)
    assert begun.robot.time_step_s <= coarsest_step_s(begun.robot)
    assert any("rotor inertia" in m for m in begun.missing), "what was assumed is still to be measured"


@pytest.mark.parametrize(
    "drives",
    [
        {},
        {"a": {"command": "none"}, "b": {"command": "none"}},
        {"a": {"command": "torque", "torque_limit": 5.0}},
        {"a": {"kp": 18.0, "kd": 0.4}},
    ],
)
def test_links_of_which_some_are_not_held_take_the_fine_step(tmp_path: Path, drives: dict[str, object]) -> None:
    (tmp_path / "arm.urdf").write_text(ARM)
    robot, _ = load_robot({"urdf": str(tmp_path / "arm.urdf"), "drives": drives, "free_base": False})
    assert robot.time_step_s == FINE_S


def test_fingers_that_nobody_drives_leave_an_arm_its_step(tmp_path: Path) -> None:
    finger = """<link name="finger"><inertial><mass value="0.02"/>
    <inertia ixx="1e-5" iyy="1e-5" izz="1e-5" ixy="0" ixz="0" iyz="0"/></inertial></link>
    <joint name="f" type="prismatic"><parent link="lower"/><child link="finger"/><axis xyz="0 1 0"/>
    <limit lower="0" upper="0.04" effort="9" velocity="1"/></joint></robot>"""
    (tmp_path / "arm.urdf").write_text(ARM.replace("</robot>", finger))
    drive = {"kp": 18.0, "kd": 0.4, "torque_limit": 9.0, "speed_limit": 30.0, "rotor_inertia": 0.02}
    robot, _ = load_robot({"urdf": str(tmp_path / "arm.urdf"), "drives": {"a": drive, "b": drive}, "free_base": False})
    assert robot.time_step_s == STEPS_S[0]


def test_a_free_swing_of_two_links_loses_next_to_nothing_by_itself(tmp_path: Path) -> None:
    """What two links without any friction have left of their energy after four seconds, in the step that they get."""
    (tmp_path / "arm.urdf").write_text(ARM.replace('"-2"', '"-6"').replace('"2"', '"6"'))
    robot, _ = load_robot(
        {"urdf": str(tmp_path / "arm.urdf"), "free_base": False, "drives": {j: {"command": "none"} for j in "ab"}}
    )
    steps = round(4.0 / robot.time_step_s)
    start = State(np.array([0.3, -0.4]), np.zeros(2))
    (log,) = MuJoCoEngine(1).rollout([Rollout(robot, Commands(np.zeros((steps, 2))), steps, start=start, pose=True)])
    assert log.joints is not None
    speed = np.gradient(log.joints, robot.time_step_s, axis=0)
    lost = 1.0 - _energy(log.joints[-2], speed[-2]) / _energy(start.joints, start.speeds)
    assert abs(lost) < 3e-4


def _energy(q: np.ndarray, w: np.ndarray) -> float:
    """J, above hanging straight down (zero is along x, and y turns it downwards), of the two links of ARM."""
    (m1, m2), (c1, c2), i, l1 = (0.4, 0.3), (0.1, 0.1), 1e-3, 0.2
    a, b, wa, wb = q[0], q[0] + q[1], w[0], w[0] + w[1]
    height = m1 * (c1 - c1 * np.sin(a)) + m2 * (l1 + c2 - l1 * np.sin(a) - c2 * np.sin(b))
    moved = m1 * (c1 * wa) ** 2 + m2 * ((l1 * wa) ** 2 + (c2 * wb) ** 2 + 2 * l1 * c2 * wa * wb * np.cos(a - b))
    return float(9.81 * height + 0.5 * (moved + i * (wa**2 + wb**2)))


def test_what_a_bolted_base_is_taken_to_weigh_is_not_told_of_the_file(tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text(ARM)
    begun = starter(read_body("urdf", tmp_path / "arm.urdf"), "urdf", "arm.urdf", "arm.urdf")
    assert begun.read[0] == "3 parts, 0.7 kg of them move"
