"""Numbered columns of limbs that are alike: the weight that controllers hold tells left from right."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ee_dist.measurements.proposal.files import proposal_for
from ee_dist.measurements.proposal.limbs import exchanged, limbs_of
from ee_dist.measurements.proposal.model import Hints
from ee_dist.robots.describe import load_robot
from ee_dist.robots.inverse_dynamics import joint_torques
from ee_dist.robots.model import Robot
from ee_dist.trials.log import Array

LINK = """<link name="{name}"><inertial><origin xyz="{com}"/><mass value="{mass}"/>
<inertia ixx="0.004" iyy="0.004" izz="0.004" ixy="0" ixz="0" iyz="0"/></inertial></link>"""
JOINT = """<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/><origin xyz="{at}"/>
<axis xyz="{axis}"/><limit lower="{low}" upper="{high}" effort="30" velocity="9"/></joint>"""
DRIVE = "{{command: position, kp: 40, kd: 1, rotor_inertia: 0.01}}"


def four_legs(folder: Path, sideways: float = 0.1) -> Robot:
    """Hips that carry their legs ``sideways`` (m), left ones to the left, on a bolted trunk."""
    parts = ['<link name="trunk"/>']
    names = []
    for leg, x, y in (("fr", 0.3, -1), ("fl", 0.3, 1), ("rr", -0.3, -1), ("rl", -0.3, 1)):
        parts += [
            JOINT.format(name=f"{leg}_hip", parent="trunk", child=f"{leg}_upper", at=f"{x} {0.1 * y} 0", axis="1 0 0",
                         low=-0.4, high=0.4),
            LINK.format(name=f"{leg}_upper", com=f"0.02 {sideways * y} 0", mass=1.0),
            JOINT.format(name=f"{leg}_knee", parent=f"{leg}_upper", child=f"{leg}_lower", at=f"0 {sideways * y} -0.25",
                         axis="0 1 0", low=0.1, high=1.2),
            LINK.format(name=f"{leg}_lower", com="0.01 0 -0.1", mass=0.4),
        ]  # fmt: skip
        names += [f"{leg}_hip", f"{leg}_knee"]
    (folder / "legs.urdf").write_text(f'<robot name="legs">{"".join(parts)}</robot>')
    drives = "".join(f"  {n}: {DRIVE.format()}\n" for n in names)
    (folder / "legs.yaml").write_text(f"urdf: legs.urdf\nfree_base: false\ndrives:\n{drives}")
    return load_robot(folder / "legs.yaml")[0]


def held(robot: Robot) -> tuple[Array, Array, Array]:
    """Times, positions and goals (T, M) of joints whose controllers hold the weight, in the robot's order."""
    t = np.arange(0, 8, 0.01)
    wave = np.sin(np.outer(t, np.linspace(2.0, 5.0, len(robot.motor_names))))
    knees = np.array([n.endswith("knee") for n in robot.motor_names])
    position = np.where(knees, 0.6 + 0.4 * wave, 0.15 * wave)
    weight = joint_torques(robot, position, 0 * position, 0 * position)
    return t, position, position + weight / 40.0


def columns_of(robot: Robot, order: tuple[str, ...]) -> list[int]:
    """Joints limb by limb."""
    return [robot.motor_names.index(f"{leg}_{joint}") for leg in order for joint in ("hip", "knee")]


def taken(robot: Robot) -> tuple[str, ...]:
    """The order in which columns are taken to be where nobody says another."""
    return tuple(robot.motor_names[k] for k in columns_of(robot, ("fr", "fl", "rr", "rl")))


def test_limbs_are_chains_that_are_alike(tmp_path: Path) -> None:
    robot = four_legs(tmp_path)
    limbs = limbs_of(robot, robot.motor_names)
    assert [limb[0] for limb in limbs] == ["fr_hip", "fl_hip", "rr_hip", "rl_hip"] and {len(m) for m in limbs} == {2}


@pytest.mark.parametrize("order", [("fl", "fr", "rl", "rr"), ("fl", "fr", "rr", "rl")])
def test_the_order_in_which_weight_is_held_is_told(tmp_path: Path, order: tuple[str, ...]) -> None:
    robot = four_legs(tmp_path)
    _, position, goal = held(robot)
    at = columns_of(robot, order)
    found = exchanged(robot, taken(robot), position[:, at], goal[:, at])
    assert found is not None and found.goes > 0.95 and found.went < 0.6
    assert found.names == tuple(robot.motor_names[k] for k in at)


def test_nothing_is_told_where_the_order_is_right_or_weight_is_alike(tmp_path: Path) -> None:
    robot = four_legs(tmp_path)
    _, position, goal = held(robot)
    for order in (("fr", "fl", "rr", "rl"), ("rr", "rl", "fr", "fl")):
        at = columns_of(robot, order)
        assert exchanged(robot, taken(robot), position[:, at], goal[:, at]) is None, "fore and hind legs weigh alike"
    # Controllers that carry the weight themselves leave no error.
    rng = np.random.default_rng(0)
    goal = position + 1e-3 * rng.standard_normal(position.shape)
    assert exchanged(robot, taken(robot), position[:, at], goal[:, at]) is None


def test_import_asks_for_it_with_the_order_to_say(tmp_path: Path) -> None:
    robot = four_legs(tmp_path)
    t, position, goal = held(robot)
    at = columns_of(robot, ("fl", "fr", "rl", "rr"))
    np.savez(tmp_path / "log.npz", time=t, dof_pos=position[:, at], des_dof_pos=goal[:, at])
    asked = proposal_for([tmp_path / "log.npz"], robot, Hints())
    wanted = ",".join(robot.motor_names[k] for k in at)
    assert any(f"task.joints=[{wanted}]" in q and "weight" in q for q in asked.questions)
    said = proposal_for([tmp_path / "log.npz"], robot, Hints(joints=tuple(wanted.split(","))))
    assert not said.questions
