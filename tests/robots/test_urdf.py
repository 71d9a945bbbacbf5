"""A URDF as a robot: what comes from the file, what both engines make of it, and one clear line for each mistake."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest

from ee_dist.engines.contract import Rollout
from ee_dist.engines.drivers import Commands
from ee_dist.engines.mujoco.engine import MuJoCoEngine
from ee_dist.engines.pybullet.engine import PyBulletEngine
from ee_dist.robots.describe import load_robot, robot_of
from ee_dist.robots.model import RobotError
from ee_dist.robots.serial import robot_from_json, robot_to_json
from ee_dist.robots.urdf import UrdfError, read_urdf, turn_of_rpy

EXAMPLES = Path(__file__).parents[2] / "docs" / "examples"
ARM = EXAMPLES / "arm.urdf"


def changed(tmp_path: Path, **edits: object) -> Path:
    """The arm with elements changed: name of a link or joint -> function of its element."""
    tree = ET.parse(ARM)
    for name, edit in edits.items():
        element = next(e for e in tree.getroot() if e.get("name") == name)
        edit(element)  # type: ignore[operator]
    out = tmp_path / "arm.urdf"
    tree.write(out)
    return out


def test_masses_limits_and_shapes_come_from_the_file() -> None:
    body = read_urdf(ARM)
    assert [j.name for j in body.joints] == ["turn", "shoulder", "elbow"]
    assert [p.mass_kg for p in body.parts[1:]] == [0.6, 0.4, 0.25]
    assert (body.joints[1].lower, body.joints[1].upper) == (-1.6, 1.6)
    assert body.effort == {"turn": 4.0, "shoulder": 6.0, "elbow": 3.0}
    forearm = body.parts[3]
    assert forearm.shapes[0].size == (0.08, 0.015, 0.015)
    # The tool has no mass and is rigidly attached: its shape went to the forearm, at the tool's place.
    assert forearm.shapes[1].kind == "sphere"
    assert forearm.shapes[1].position_m == pytest.approx((0.17, 0.0, 0.0))


def test_roll_pitch_yaw_turn_about_fixed_axes() -> None:
    x, y, z, w = turn_of_rpy((0.0, math.pi / 2, 0.0))
    assert (x, y, z, w) == pytest.approx((0, math.sqrt(0.5), 0, math.sqrt(0.5)))


def test_inertia_is_turned_into_the_axes_of_the_part(tmp_path: Path) -> None:
    def turned(link: ET.Element) -> None:
        link.find("inertial/origin").set("rpy", f"0 0 {math.pi / 2}")  # type: ignore[union-attr]

    part = read_urdf(changed(tmp_path, upper_arm=turned)).parts[2]
    xx, yy, zz, *products = part.inertia_kg_m2
    assert (xx, yy, zz) == pytest.approx((0.0014, 0.0001, 0.0014))
    assert products == pytest.approx([0, 0, 0], abs=1e-12)


def test_a_described_urdf_survives_writing_and_reading() -> None:
    robot, _ = load_robot(EXAMPLES / "arm.yaml")
    assert robot_from_json(robot_to_json(robot)) == robot
    assert robot.drives[1].torque_limit == 6.0
    assert not robot.free_base
    assert robot_of("urdf", str(ARM), str(EXAMPLES / "arm.yaml"))[0].digest == robot.digest


def test_both_engines_hold_the_arm_alike() -> None:
    robot, _ = load_robot(EXAMPLES / "arm.yaml")
    t = np.arange(300) * robot.time_step_s
    commands = np.stack([0.5 * np.sin(2 * t), 0.3 * np.sin(3 * t), 0.6 * np.sin(2.5 * t)], axis=1)
    job = [Rollout(robot, Commands(commands), len(t), pose=True)]
    one, other = (e.rollout(job)[0].joints for e in (PyBulletEngine(), MuJoCoEngine(threads=1)))
    assert one is not None
    assert other is not None
    assert np.abs(one - other).max() < 0.02
    assert np.abs(one[:, 2]).max() > 0.3


def test_a_free_base_falls(tmp_path: Path) -> None:
    (tmp_path / "robot.yaml").write_text(
        f"urdf: {ARM}\nfree_base: true\nstart_position_m: [0, 0, 1]\nhas_floor: false\ndrives: {{turn: {{kp: 1}}}}\n"
        "sensors: [{name: height, kind: height}]\n"
    )
    robot, notes = load_robot(tmp_path / "robot.yaml")
    assert any("shoulder" in n for n in notes)
    log = MuJoCoEngine(threads=1).rollout([Rollout(robot, Commands(np.zeros((1, 1))), 101)])[0]
    assert log.channel("height")[-1] == pytest.approx(1 - 0.5 * 9.81 * (100 * robot.time_step_s) ** 2, abs=0.03)


def test_meshes_are_skipped_with_a_note(tmp_path: Path) -> None:
    def meshed(link: ET.Element) -> None:
        geometry = link.find("collision/geometry")
        assert geometry is not None
        geometry.clear()
        ET.SubElement(geometry, "mesh", filename="arm.stl")

    body = read_urdf(changed(tmp_path, forearm=meshed))
    assert "mesh" in body.notes[0]
    assert "forearm" in body.notes[0]


def _drop(tag: str):  # type: ignore[no-untyped-def]
    def edit(element: ET.Element) -> None:
        element.remove(element.find(tag))  # type: ignore[arg-type]

    return edit


def _set(tag: str, key: str, value: str):  # type: ignore[no-untyped-def]
    return lambda element: element.find(tag).set(key, value)


@pytest.mark.parametrize(
    ("edits", "message"),
    [
        ({"forearm": _drop("inertial")}, r"link 'forearm': no <inertial>, but joint 'elbow' moves it"),
        ({"forearm": _set("inertial/mass", "value", "0")}, r"link 'forearm': mass 0 kg; expected a positive number"),
        ({"forearm": _set("inertial/mass", "value", "half")}, r"'half'> is not a number"),
        ({"forearm": _set("inertial/inertia", "ixx", "0.1")}, r"no rigid body has this inertia"),
        ({"elbow": _set("child", "link", "hand")}, r"joint 'elbow': its child link 'hand' is not in the file"),
        ({"elbow": _set("parent", "link", "tool")}, r"form a loop"),
        ({"elbow": _drop("limit")}, r"joint 'elbow': a revolute joint needs <limit"),
        ({"elbow": _set("limit", "lower", "3")}, r"leave no range"),
        ({"elbow": _set("axis", "xyz", "0 0 0")}, r"no direction"),
        ({"elbow": lambda e: e.set("type", "planar")}, r"kind 'planar' is not supported"),
    ],
)
def test_a_wrong_urdf_is_one_clear_line(tmp_path: Path, edits: dict[str, object], message: str) -> None:
    with pytest.raises(UrdfError, match=message) as caught:
        read_urdf(changed(tmp_path, **edits))
    assert "\n" not in str(caught.value)
    assert "arm.urdf" in str(caught.value)


def test_broken_xml_names_the_line(tmp_path: Path) -> None:
    file = tmp_path / "cut.urdf"
    file.write_text(ARM.read_text()[:400])
    with pytest.raises(UrdfError, match=r"not well-formed XML: .*line \d+"):
        read_urdf(file)
    with pytest.raises(UrdfError, match="no such file"):
        read_urdf(tmp_path / "absent.urdf")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("urdf: ARM\ndrives: {elbo: {kp: 1}}", "no moving joint named 'elbo'; did you mean elbow"),
        ("urdf: ARM\ndrives: {elbow: {kd: 1}}", "elbow: expected at least 'kp'"),
        ("urdf: ARM\ndrives: {elbow: {kp: strong}}", "elbow: kp: expected a number, not 'strong'"),
        ("urdf: ARM\ndrives: {elbow: {kp: 1, damping: 2}}", "unknown key 'damping'"),
        (
            "urdf: ARM\ndrives: {elbow: {kp: 1}}\nsensors: [{name: a, kind: position, target: turn}]",
            "no driven joint named 'turn'",
        ),
        ("urdf: ARM\ndrives: {elbow: {kp: 1}}\nsensors: [{name: a, kind: smell}]", "no sensor kind 'smell'"),
        ("urdf: ARM\nfree_bas: true", "unknown key 'free_bas'; did you mean free_base"),
        ("urdf: ARM\ntime_step_s: 2", "seconds, not milliseconds"),
        ("robot: servo_pendlum", "no robot named 'servo_pendlum'; did you mean servo_pendulum"),
        ("robot: servo_pendulum\nmass: 1", "servo_pendulum has no 'mass'; did you mean mass_kg"),
        ("robot: servo_pendulum\nmass_kg: heavy", "mass_kg: expected a number"),
        ("- a\n- b", "expected a mapping"),
        ("a: [b", "not YAML"),
    ],
)
def test_a_wrong_description_is_one_clear_line(tmp_path: Path, text: str, message: str) -> None:
    file = tmp_path / "robot.yaml"
    file.write_text(text.replace("ARM", str(ARM)))
    with pytest.raises(RobotError, match=message) as caught:
        load_robot(file)
    assert "\n" not in str(caught.value)
