"""Joints that were not recorded because they stood still."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ee_dist.robots.describe import load_robot
from ee_dist.robots.inverse_dynamics import joint_torques
from ee_dist.robots.model import Robot, RobotError

URDF = """<robot name="arm">
  <link name="table"/>
  <link name="upper"><inertial><origin xyz="0.12 0.01 0"/><mass value="0.5"/>
    <inertia ixx="0.0002" iyy="0.0025" izz="0.0025" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="lower"><inertial><origin xyz="0.1 0 0.02"/><mass value="0.3"/>
    <inertia ixx="0.0001" iyy="0.0012" izz="0.0012" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="finger"><inertial><origin xyz="0.02 0 0"/><mass value="0.1"/>
    <inertia ixx="0.00001" iyy="0.0001" izz="0.0001" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="shoulder" type="revolute"><parent link="table"/><child link="upper"/><origin xyz="0 0 0.3" rpy="0 0.2 0"/>
    <axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="12" velocity="8"/></joint>
  <joint name="elbow" type="revolute"><parent link="upper"/><child link="lower"/><origin xyz="0.25 0 0" rpy="0.3 0 0"/>
    <axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="8" velocity="8"/></joint>
  <joint name="grip" type="prismatic"><parent link="lower"/><child link="finger"/><origin xyz="0.2 0 0"/>
    <axis xyz="1 0 0"/><limit lower="0" upper="0.05" effort="8" velocity="8"/></joint>
</robot>"""
DRIVES = {name: {"kp": 20} for name in ("shoulder", "elbow", "grip")}


def arm(folder: Path, **more: Any) -> tuple[Robot, tuple[str, ...]]:
    (folder / "arm.urdf").write_text(URDF)
    return load_robot({"urdf": "arm.urdf", "drives": DRIVES, **more}, folder)


def test_a_joint_that_stands_still_weighs_as_it_does_where_it_stands(tmp_path: Path) -> None:
    whole, _ = arm(tmp_path)
    still, notes = arm(tmp_path, fixed_joints={"elbow": 0.7, "grip": 0.03})
    assert still.motor_names == ("shoulder",)
    assert [s.name for s in still.sensors] == ["position_shoulder", "velocity_shoulder"]
    assert any("elbow at 0.7, grip at 0.03" in note for note in notes)
    t = np.linspace(0, 2, 100)
    q, v, a = np.sin(3 * t), 3 * np.cos(3 * t), -9 * np.sin(3 * t)

    def columns(shoulder: np.ndarray, elbow: float, grip: float) -> np.ndarray:
        return np.stack([shoulder, np.full_like(t, elbow), np.full_like(t, grip)], axis=1)

    expected = joint_torques(whole, columns(q, 0.7, 0.03), columns(v, 0, 0), columns(a, 0, 0))[:, 0]
    found = joint_torques(still, q[:, None], v[:, None], a[:, None])[:, 0]
    assert found == pytest.approx(expected, abs=1e-9)


def test_what_the_description_says_of_their_drives_and_sensors_may_stay(tmp_path: Path) -> None:
    listed = [{"name": f"angle_{j}", "kind": "position", "target": j} for j in ("shoulder", "grip")]
    robot, _ = arm(tmp_path, fixed_joints={"grip": 0.0}, sensors=listed)
    assert robot.motor_names == ("shoulder", "elbow")
    assert [s.name for s in robot.sensors] == ["angle_shoulder"]


@pytest.mark.parametrize(("asked", "said"), [
    ({"elbo": 0.1}, "no moving joint named 'elbo'; did you mean elbow"),
    ({"grip": 0.5}, "grip cannot stand at 0.5 m: it goes from 0 to 0.05"),
    ({"elbow": "high"}, "fixed_joints: elbow"),
    (["elbow"], "expected 'joint: where it stood'"),
])  # fmt: skip
def test_what_cannot_be_is_refused_in_a_line(tmp_path: Path, asked: Any, said: str) -> None:
    with pytest.raises(RobotError) as refused:
        arm(tmp_path, fixed_joints=asked)
    assert said in str(refused.value) and "\n" not in str(refused.value)


def test_none_is_as_before(tmp_path: Path) -> None:
    assert arm(tmp_path, fixed_joints={})[0] == arm(tmp_path)[0]
