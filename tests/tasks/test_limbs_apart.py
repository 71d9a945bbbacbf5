"""Two arms on one base, on the command line: each is simulated by itself, with one digest whoever simulates them."""

from __future__ import annotations

from pathlib import Path

import yaml

from ee_dist.robots.describe import load_robot
from ee_dist.robots.limbs import limbs

LINK = (
    '<link name="{0}"><inertial><origin xyz="0.1 0 0"/><mass value="0.4"/>'
    '<inertia ixx="0.0002" iyy="0.002" izz="0.002" ixy="0" ixz="0" iyz="0"/></inertial></link>'
    '<joint name="{0}_joint" type="revolute"><parent link="table"/><child link="{0}"/><origin xyz="0 {1} 0.3"/>'
    '<axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="8" velocity="8"/></joint>'
)


def described(folder: Path) -> Path:
    urdf = folder / "two.urdf"
    urdf.write_text(
        f'<robot name="two"><link name="table"/>{LINK.format("left", 0.2)}{LINK.format("right", -0.2)}</robot>'
    )
    drive = {"command": "position", "kp": 20.0, "kd": 0.6, "rotor_inertia": 0.005}
    content = {"urdf": str(urdf), "free_base": False, "drives": {"left_joint": drive, "right_joint": drive}}
    file = folder / "two.yaml"
    file.write_text(yaml.safe_dump(content))
    return file


def test_limbs_have_one_digest_serial_and_ray(cli, tmp_path: Path) -> None:
    file = described(tmp_path)
    assert len(limbs(load_robot(file)[0])) == 2
    robot = ("robot=urdf", f"robot.drives={file}", "engine=mujoco")
    hidden = "+hidden=[{effect: coulomb_friction, target: right_joint, torque_nm: 0.3}]"
    plan = "task.excitations=['multisine:seconds=4,amplitude=0.3,seed=1','slow_sines:seconds=4,amplitude=0.3,seed=2']"
    made = cli("task=trial", *robot, hidden, plan, "noise=0.001")
    assert made.status == 0, made.err
    only = "task.only=[coulomb_friction,zero_offset]"
    asked = ("task=explain", f"measured={made.runs()[0]}", "engine=mujoco", only, "task.rerun=false")
    found, apart = cli(*asked, "evaluator=serial"), cli(*asked, "evaluator=ray", "evaluator.workers=2")
    assert found.status == apart.status == 0, (found.err, apart.err)
    assert "coulomb friction at right joint" in " ".join(found.out.split())
    assert found.summary()["result_digest"] == apart.summary()["result_digest"]
