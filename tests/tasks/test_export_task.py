"""task=export on the real command line: files for other simulators that stand on their own."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import mujoco
import pytest

from ee_dist.effects.model_file import read_model
from ee_dist.robots.describe import load_robot

ARM = Path(__file__).parents[2] / "docs" / "examples" / "arm.urdf"
MODEL = """robot:
  urdf: {urdf}
  drives: {{turn: {{kp: 20, kd: 0.4}}, shoulder: {{kp: 25, kd: 0.6}}, elbow: {{kp: 10, kd: 0.2}}}}
effects:
  - {{effect: payload, target: forearm, mass_kg: 0.2, x_m: 0.1}}
  - {{effect: viscous_friction, target: elbow, damping_nm_s_rad: 0.05}}
{more}
"""


@pytest.fixture
def model(tmp_path):
    def write(more: str = "") -> Path:
        file = tmp_path / "model.yaml"
        file.write_text(MODEL.format(urdf=ARM, more=more))
        return file

    return write


def test_effects_that_mujoco_has_need_no_shim(cli, model):
    outcome = cli("task=export", f"model={model()}", "to=mjcf")
    assert outcome.status == 0, outcome.err
    (run,) = outcome.runs()
    assert not (run / "controller.py").exists()
    m = mujoco.MjModel.from_xml_path(str(run / "robot.xml"))
    assert m.body("forearm").mass[0] == pytest.approx(0.45)
    assert m.nu == 3
    assert [e["how"] for e in outcome.summary()["effects"]] == ["native", "native"]


def test_a_shim_runs_beside_plain_mujoco_in_another_process(cli, model):
    outcome = cli("task=export", f"model={model('  - {effect: backlash, target: elbow, gap_rad: 0.02}')}", "to=mjcf")
    assert outcome.status == 0, outcome.err
    (run,) = outcome.runs()
    assert [e["how"] for e in outcome.summary()["effects"]] == ["native", "native", "shim"]
    done = subprocess.run([sys.executable, "-I", "controller.py"], cwd=run, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    assert "elbow" in done.stdout


def test_what_a_model_has_put_right_is_no_longer_assumed(cli, tmp_path):
    file = tmp_path / "model.yaml"
    file.write_text(
        f"robot: {{urdf: {ARM}, drives: {{elbow: {{kp: 100, kd: 1, assumed: [kp, kd]}}}}}}\n"
        "effects: [{effect: position_gain, target: elbow, factor: 0.15}]\n"
    )
    outcome = cli("task=export", f"model={file}", "to=yaml")
    assert outcome.status == 0, outcome.err
    (run,) = outcome.runs()
    robot, _ = load_robot(run / "robot.yaml")
    assert robot.drives[0].kp == pytest.approx(15)
    assert robot.assumed == (("elbow", "kd"),)


def test_a_plain_description_is_a_model_without_effects(cli, tmp_path):
    shutil.copy(ARM, tmp_path / "arm.urdf")
    file = tmp_path / "arm.yaml"
    file.write_text("urdf: arm.urdf\ndrives: {elbow: {kp: 10, kd: 0.2}}\n")
    outcome = cli("task=export", f"model={file}", "to=yaml")
    assert outcome.status == 0, outcome.err
    (run,) = outcome.runs()
    assert outcome.summary()["effects"] == []
    assert load_robot(run / "robot.yaml")[0] == load_robot(file)[0] == read_model(run / "robot.yaml").model


def test_a_yaml_is_the_whole_robot_and_a_urdf_says_what_it_cannot_hold(cli, model):
    file = model("  - {effect: mounting_tilt, target: table, forward_deg: 5}")
    whole = cli("task=export", f"model={file}", "to=yaml")
    (run,) = whole.runs()
    assert load_robot(run / "robot.yaml")[0] == read_model(file).model
    urdf = cli("task=export", f"model={file}", "to=urdf")
    assert urdf.summary()["effects"][-1]["how"] == "not expressible"
    assert "1 of 3 effects are not in what was written" in urdf.out
    (run,) = urdf.runs()
    assert {p.name for p in run.iterdir() if p.is_file()} >= {"robot.urdf", "controller.py"}
    alone = cli("task=export", f"model={file}", "to=python")
    assert alone.summary()["files"] == ["controller.py"]
