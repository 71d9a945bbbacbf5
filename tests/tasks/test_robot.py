"""task=robot on the real command line: the table, a description that loads again, a picture."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from ee_dist.robots.describe import load_robot
from ee_dist.robots.ranges import span
from ee_dist.robots.serial import robot_to_dict
from ee_dist.tasks.errors import unasked_end
from ee_dist.tasks.robot import sweep

ARM = Path(__file__).parents[2] / "docs" / "examples" / "arm.urdf"
MJCF = """<mujoco model="swing"><worldbody><body name="arm"><joint name="h" axis="0 1 0" range="-60 60" damping="0.2"/>
<geom type="capsule" size="0.02 0.1" pos="0 0 -0.1"/></body></worldbody>
<actuator><position joint="h" kp="20" kv="1" forcerange="-4 4"/></actuator></mujoco>"""


def test_a_urdf_becomes_a_description_with_its_assumptions_marked(cli):
    outcome = cli("task=robot", f"urdf={ARM}")
    assert outcome.status == 0, outcome.err
    (run,) = outcome.runs()
    assert (run / "robot.rrd").stat().st_size > 1000
    text = (run / "robot.yaml").read_text()
    marked = [line for line in text.splitlines() if " assumed: " in line]
    assert [line.strip().split(":")[0] for line in marked] == [
        "free_base", "# time_step_s", "gravity_m_s2", "turn", "shoulder", "elbow",
    ]  # fmt: skip
    guessed = ["command", "kp", "kd", "rotor_inertia"]
    assert yaml.safe_load(text)["drives"]["elbow"]["assumed"] == guessed
    assert yaml.safe_load(text)["drives"]["shoulder"]["torque_limit"] == 6.0
    robot, _ = load_robot(run / "robot.yaml")
    assert robot.motor_names == ("turn", "shoulder", "elbow")
    assert robot.assumed == tuple((j, f) for j in robot.motor_names for f in guessed)
    found = outcome.summary()
    assert found["degrees_of_freedom"] == 3
    assert found["mass_kg"] == pytest.approx(sum(p.mass_kg for p in robot.parts))
    assert any("rotor inertia" in m for m in found["missing"])
    assert "turn, shoulder, elbow: command, kp, kd" in outcome.out
    assert (
        f"Next: python -m ee_dist task=import measured=YOUR_LOG robot=urdf robot.drives={run / 'robot.yaml'}"
        in outcome.out
    )


def test_an_mjcf_brings_its_own_drives_and_the_robot_is_usable_at_once(cli, tmp_path):
    file = tmp_path / "swing.xml"
    file.write_text(MJCF.replace('kv="1"', ""))
    outcome = cli("task=robot", f"mjcf={file}")
    assert outcome.status == 0, outcome.err
    (run,) = outcome.runs()
    assert "-0.0" not in (run / "robot.yaml").read_text()
    robot, _ = load_robot(run / "robot.yaml")
    assert robot == load_robot(file)[0]
    assert "# assumed" not in (run / "robot.yaml").read_text().split("drives:")[1]
    moved = sweep(robot)
    assert moved.shape[1] == 1
    assert 0.2 < moved.max() <= robot.joint("h").upper
    trial = cli(
        "task=trial", "robot=mjcf", f"robot.file={file}", "engine=mujoco", "evaluator=serial",
        "task.excitations=['multisine:seconds=1']", "+hidden=[]",
    )  # fmt: skip
    assert trial.status == 0, trial.err


def test_what_a_description_assumed_goes_with_its_recordings_and_is_found(cli, tmp_path):
    """By the commands alone: described, tried on a robot that has other servos, compared, explained."""
    described = cli("task=robot", f"urdf={ARM}")
    (run,) = described.runs()
    hidden = (("position_gain", "factor: 0.15"), ("coulomb_friction", "torque_nm: 0.2"))
    softer = ",".join(f"{{effect: {name}, target: all_joints, {value}}}" for name, value in hidden)
    trial = cli(
        "task=trial", "robot=urdf", f"robot.drives={run / 'robot.yaml'}", "engine=mujoco", "evaluator=serial",
        "task.excitations=['multisine:seconds=2','multisine:seconds=2,seed=2']", f"+hidden=[{softer}]",
        f"hydra.run.dir={tmp_path / 'trial'}",
    )  # fmt: skip
    assert trial.status == 0, trial.err
    log = [f"measured={tmp_path / 'trial' / 'trial.mcap'}", "engine=mujoco", "evaluator=serial"]
    compared = cli("task=compare", *log)
    assert "The description only assumed kp, kd, rotor_inertia of 3 drives" in " ".join(compared.out.split())
    only = "task.only=[position_gain,speed_gain,coulomb_friction,part_mass]"
    explained = cli("task=explain", *log, only)
    assert explained.status == 0, explained.err
    said = " ".join(explained.out.split())
    assert "The description only guessed at what these drives do" in said
    found = explained.summary()["candidates"][0]
    assert found["name"] == "assumed drives"
    gain = next(t for t in found["terms"] if t["effect"] == "position_gain")
    assert gain["target"] == "all_joints"
    assert gain["values"]["factor"] == pytest.approx(0.15, rel=0.1)


@pytest.mark.parametrize(
    ("marks", "said"),
    [([["nowhere", "kp"]], "drives: nowhere: assumed: no drive of that name"),
     ([["elbow", "colour"]], "drives: elbow: assumed: unknown key 'colour'")],
)  # fmt: skip
def test_marks_that_cannot_be_are_one_line_wherever_a_robot_comes_from(cli, tmp_path, marks, said):
    whole = robot_to_dict(load_robot({"urdf": str(ARM), "drives": {"elbow": {"kp": 10, "kd": 0.2}}})[0])
    whole["robot"]["assumed"] = marks
    file = tmp_path / "model.yaml"
    file.write_text(yaml.safe_dump({"robot": whole, "effects": []}))
    outcome = cli("task=export", f"model={file}", "to=yaml")
    assert outcome.status == 2
    assert said in outcome.err
    assert len(outcome.err.strip().splitlines()) == 1


def test_what_is_bolted_down_does_not_move_and_two_turns_are_a_limit(cli, tmp_path):
    """A table beside the arm weighs what it likes; files round two turns up."""
    file = tmp_path / "bench.xml"
    file.write_text(
        '<mujoco model="bench"><compiler angle="radian"/><worldbody><body name="table"><geom size="0.2" mass="30"/>'
        '<body name="first_link_of_the_arm"><joint name="a_joint_with_a_long_name" axis="0 1 0" range="-6.28319 6.28319"/>'
        '<geom size="0.05" mass="2" pos="0 0 -0.1"/><body name="tool"><geom size="0.05" mass="0.5" pos="0 0 -0.2"/></body>'
        "</body></body></worldbody>"
        '<actuator><position joint="a_joint_with_a_long_name" kp="1234.5" kv="123.4" forcerange="-150.5 150.5"/></actuator>'
        "</mujoco>"
    )
    outcome = cli("task=robot", f"mjcf={file}")
    assert outcome.status == 0, outcome.err
    assert "2.5 kg of them move" in outcome.out
    assert (outcome.summary()["mass_kg"], outcome.summary()["moving_mass_kg"]) == pytest.approx((32.5, 2.5))
    (row,) = [line for line in outcome.out.splitlines() if "position" in line and "-6.28" in line]
    assert "6.28 position 1234" in row
    assert "…" not in outcome.out
    (run,) = outcome.runs()
    joint = load_robot(run / "robot.yaml")[0].joint("a_joint_with_a_long_name")
    assert span(joint) == (joint.lower, joint.upper)


def test_who_stops_reading_ends_the_run_in_words():
    stop = SystemExit(1)
    stop.__context__ = BrokenPipeError()
    assert "sys.exit" not in unasked_end(stop)
    assert "sys.exit(3)" in unasked_end(SystemExit(3))


def test_a_description_in_the_place_of_its_xml_is_told_where_it_goes(cli, tmp_path):
    file = tmp_path / "arm.yaml"
    file.write_text("mjcf: arm.xml\n")
    outcome = cli("task=trial", "robot=mjcf", f"robot.file={file}", "engine=mujoco")
    assert outcome.status != 0
    assert f"a description of drives is given as robot.drives={file}" in outcome.err
