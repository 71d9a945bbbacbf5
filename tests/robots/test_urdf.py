"""A URDF as a robot: what comes from the file, what both engines make of it, and one clear line for each mistake."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ee_dist.engines.contract import Rollout
from ee_dist.engines.drivers import Commands
from ee_dist.engines.mujoco.engine import MuJoCoEngine
from ee_dist.engines.pybullet.engine import PyBulletEngine
from ee_dist.robots.describe import load_robot, read_body, robot_of
from ee_dist.robots.described import robot_of_body
from ee_dist.robots.model import RobotError
from ee_dist.robots.serial import robot_from_json, robot_to_json
from ee_dist.robots.urdf import read_urdf
from ee_dist.robots.urdf_attributes import UrdfError, turn_of_rpy
from ee_dist.trials.noise import channel_range

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
    assert {n: d["torque_limit"] for n, d in body.drives.items()} == {"turn": 4.0, "shoulder": 6.0, "elbow": 3.0}
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

    body = read_urdf(changed(tmp_path, forearm=meshed, upper_arm=meshed))
    (note,) = body.notes
    assert "collision meshes of 2 links left out" in note
    assert "forearm" in note


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
        ({"elbow": _set("limit", "effort", "-3")}, r"joint 'elbow': <limit effort=-3>; expected 0 or more"),
        ({"elbow": _set("limit", "upper", "1e308")}, r"expected a number of at most 1e\+09"),
        ({"forearm": _set("inertial/mass", "value", "-1")}, r"link 'forearm': mass -1 kg; expected a positive number"),
        ({"elbow": lambda e: e.set("type", "floating")}, r"is floating, which only the joint of the whole robot"),
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


def test_a_xacro_says_how_it_becomes_a_urdf(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    file = tmp_path / "arm.urdf.xacro"
    file.write_text('<robot xmlns:xacro="http://www.ros.org/wiki/xacro" name="r"><xacro:macro name="m"/></robot>')
    with pytest.raises(UrdfError, match=r"is a xacro, .*install xacro, or run 'xacro arm.urdf.xacro > robot.urdf'"):
        load_robot(file)


def test_a_xacro_is_expanded_by_the_program_that_is_installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A stand-in for ROS's program, which is not: it prints what the file names, or fails as xacro does."""
    program = tmp_path / "bin" / "xacro"
    program.parent.mkdir()
    program.write_text(
        f"#!/bin/sh\nif grep -q broken $1; then echo 'trace'; echo 'No such macro: arm' >&2; exit 2; fi\ncat {ARM}\n"
    )
    program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{program.parent}:/usr/bin:/bin")
    file = tmp_path / "arm.urdf.xacro"
    file.write_text('<robot xmlns:xacro="http://www.ros.org/wiki/xacro" name="r"><xacro:arm name="m"/></robot>')
    assert [p.name for p in read_urdf(file).parts] == [p.name for p in read_urdf(ARM).parts]
    file.write_text('<robot xmlns:xacro="http://www.ros.org/wiki/xacro" name="broken"/>')
    with pytest.raises(UrdfError, match=r"arm.urdf.xacro: xacro failed: No such macro: arm$"):
        read_urdf(file)
    program.write_text(
        "#!/bin/sh\nprintf 'when: no\\nno module ament\\nwhen processing file: a\\nwhen processing file: b\\n' >&2; exit 2\n"
    )
    with pytest.raises(UrdfError, match=r"xacro failed: no module ament when processing file: b$"):
        read_urdf(file)


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
        ("urdf: ARM\nvelocity_limits: yes", "velocity_limits: expected 'scale' .*'obeyed' .*, not True"),
        (
            "urdf: ARM\ninertia_about: hinge",
            "inertia_about: expected 'centre' .*'joint' or a list of links, not 'hinge'",
        ),
        (
            "urdf: ARM\ninertia_about: [uper]",
            "inertia_about: no link named 'uper' that a hinge carries; did you mean upper",
        ),
        ("urdf: ARM\ninertia_about: joint", "has more inertia about the joint than the .* they are about its centre"),
        ("urdf: ARM\ntime_step_s: 2", "seconds, not milliseconds"),
        ("urdf: ARM\ndrives: {elbow: {kp: .nan}}", "drives: elbow: kp: nan; expected 0 to 1e"),
        (
            "urdf: ARM\ndrives: {elbow: {kp: 1, assumed: kp}}",
            r"elbow: assumed: expected a list such as \[kp, kd\], not 'kp'",
        ),
        ("urdf: ARM\ndrives: {elbow: {kp: 1, assumed: [joint]}}", "elbow: assumed: unknown key 'joint'"),
        ("urdf: ARM\ndrives: {elbow: {kp: 1, assumed: [kb]}}", "elbow: assumed: unknown key 'kb'; did you mean k"),
        ("urdf: ARM\ndrives: {elbow: {kp: -1}}", "drives: elbow: kp: -1; expected 0 to 1e"),
        ("urdf: ARM\ndrives: {elbow: {kp: 1e308}}", "drives: elbow: kp: 1e.308; expected 0 to 1e"),
        ("urdf: ARM\ndrives: {elbow: {kp: 1, speed_limit: 0}}", "elbow: speed_limit: 0; expected more than 0"),
        (
            "urdf: ARM\ndrives: {elbow: {command: voltage}}",
            "command: 'voltage'; expected one of position, speed, torque",
        ),
        ("urdf: ARM\ndrives: {elbow: {command: speed}}", r"expected at least 'kp' \(torque per speed error\)"),
        ("urdf: ARM\ngravity_m_s2: 1e9", "gravity_m_s2: 1e.09; expected -1000 to 1000"),
        (
            "urdf: ARM\ndrives: {elbow: {kp: 1}}\nsensors: [{name: a, kind: roll, noise: -1}]",
            "sensors: a: noise: -1; expected 0 to",
        ),
        (
            "urdf: ARM\ndrives: {elbow: {kp: 1}}\nsensors: [{name: a, kind: roll}, {name: a, kind: pitch}]",
            "sensors: two are named 'a'",
        ),
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


def text_of(inside: str) -> str:
    return f'<robot name="r">{inside}</robot>'


def link(
    name: str, mass: float | None = 1.0, com: str = "0 0 0", inertia: float = 0.01,
    diagonal: tuple[float, float, float] | None = None,
) -> str:  # fmt: skip
    if mass is None:
        return f'<link name="{name}"/>'
    own = dict(zip(("ixx", "iyy", "izz"), diagonal or (inertia,) * 3, strict=True))
    moments = " ".join(f'{k}="{own.get(k, 0)}"' for k in ["ixx", "ixy", "ixz", "iyy", "iyz", "izz"])
    return f'<link name="{name}"><inertial><origin xyz="{com}"/><mass value="{mass}"/><inertia {moments}/></inertial></link>'


def hinge(name: str, parent: str, child: str, kind: str = "revolute", inside: str = "", xyz: str = "0 0 0.1") -> str:
    limit = "" if "limit" in inside else '<limit lower="-1" upper="1" effort="5" velocity="3"/>'
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/><origin xyz="{xyz}"/>'
        f'<axis xyz="0 1 0"/>{limit}{inside}</joint>'
    )


def read(tmp_path: Path, *inside: str):  # type: ignore[no-untyped-def]
    file = tmp_path / "robot.urdf"
    file.write_text(text_of("".join(inside)))
    return read_urdf(file)


def test_an_implicit_world_gives_way_to_the_link_that_it_holds(tmp_path: Path) -> None:
    body = read(
        tmp_path,
        hinge("weld", "world", "base", "fixed", xyz="0 0 0.7"),
        link("base"),
        hinge("a", "base", "arm"),
        link("arm"),
    )
    assert [p.name for p in body.parts] == ["base", "arm"]
    assert body.start_position_m == (0.0, 0.0, 0.7)
    assert body.joints[0].top_speed == 3.0


def test_a_world_that_a_joint_turns_on_stays_and_both_engines_take_it(tmp_path: Path) -> None:
    (tmp_path / "r.yaml").write_text("urdf: robot.urdf\ndrives: {a: {kp: 1}}\n")
    read(tmp_path, link("world", None), hinge("a", "world", "arm"), link("arm", com="0 0 0.2"))
    robot, notes = load_robot(tmp_path / "r.yaml")
    assert robot.root.name == "world"
    assert notes == ()
    job = [Rollout(robot, Commands(np.full((1, 1), 0.3)), 50, pose=True)]
    for engine in (PyBulletEngine(), MuJoCoEngine(threads=1)):
        assert engine.rollout(job)[0].finite


def test_frames_of_a_nanogram_are_frames(tmp_path: Path) -> None:
    body = read(
        tmp_path, link("base"), hinge("a", "base", "arm"), link("arm"),
        hinge("t", "arm", "tool", "fixed"), link("tool", 1e-9, inertia=0.0),
    )  # fmt: skip
    assert [p.name for p in body.parts] == ["base", "arm"]
    assert body.notes == ()


def test_a_helper_link_between_two_joints_gets_a_small_mass_and_says_so(tmp_path: Path) -> None:
    body = read(
        tmp_path, link("base"), hinge("a", "base", "cross", "continuous"), link("cross", 0.0, inertia=0.0),
        hinge("b", "cross", "arm"), link("arm"),
    )  # fmt: skip
    assert 0 < body.parts[1].mass_kg < 0.01
    assert any("cross" in a for a in body.assumed)


def test_a_massless_link_takes_over_what_is_bolted_to_it(tmp_path: Path) -> None:
    body = read(
        tmp_path, link("base"), hinge("a", "base", "frame"), link("frame", None),
        hinge("t", "frame", "load", "fixed", xyz="0.2 0 0"), link("load", 2.0, com="0.1 0 0"),
    )  # fmt: skip
    assert [(p.name, p.mass_kg) for p in body.parts] == [("base", 1.0), ("frame", 2.0)]
    assert body.parts[1].com_m == pytest.approx((0.3, 0.0, 0.0))


def test_a_floating_joint_makes_the_base_free_and_a_mimic_is_held(tmp_path: Path) -> None:
    body = read(
        tmp_path, link("world", None), hinge("float", "world", "base", "floating"), link("base"),
        hinge("a", "base", "one", "prismatic"), link("one"),
        hinge("b", "base", "two", "prismatic", '<mimic joint="a"/>'), link("two"),
    )  # fmt: skip
    assert body.free_base
    assert [j.kind for j in body.joints] == ["slide", "fixed"]
    assert any("mimics 'a'" in n for n in body.notes)


def test_a_floating_robot_starts_where_its_joint_puts_it(tmp_path: Path) -> None:
    turned = '1 0 2" rpy="0 0 1.5707963267948966'
    body = read(
        tmp_path, link("world", None), hinge("float", "world", "frame", "floating", xyz=turned), link("frame", None),
        hinge("bond", "frame", "base", "fixed", xyz="0.5 0 0"), link("base"),
    )  # fmt: skip
    assert body.start_position_m == pytest.approx((1.0, 0.5, 2.0))
    assert body.start_rotation == pytest.approx((0.0, 0.0, math.sqrt(0.5), math.sqrt(0.5)))


def test_a_joint_without_limits_has_no_stops_and_a_finite_scale(tmp_path: Path) -> None:
    (tmp_path / "r.yaml").write_text("urdf: robot.urdf\ndrives: {a: {kp: 1, torque_limit: 2}}\n")
    body = read(
        tmp_path, link("base"), hinge("a", "base", "arm", inside='<limit effort="0" velocity="0"/>'), link("arm")
    )
    assert "states no limits" in body.assumed[0]
    robot, _ = load_robot(tmp_path / "r.yaml")
    for sensor in robot.sensors:
        assert 0 < channel_range(robot, sensor) <= 4 * math.pi


def test_an_inertia_about_the_joint_is_hinted_at(tmp_path: Path) -> None:
    thin = 4 / 3 * 1.0 * 0.25**2
    about_joint, about_centre = link("arm", com="0 0 0.25", inertia=thin), link("arm", com="0 0 0.25", inertia=thin / 4)
    body = read(tmp_path, link("base"), hinge("a", "base", "arm"), about_joint)
    assert "add 'inertia_about: joint'" in body.notes[0]
    # Of a moment that stands at every axis, what no body can have about its length is taken down.
    robot, notes = robot_of_body(body, {"inertia_about": "joint"}, "arm.yaml")
    assert not [n for n in notes if "hint" in n]
    assert sorted(robot.part("arm").inertia_kg_m2[:3]) == pytest.approx([thin / 4, thin / 4, thin / 2])
    MuJoCoEngine(threads=1).rollout([Rollout(robot, Commands(np.zeros((1, 0))), 2)])
    assert not read(tmp_path, link("base"), hinge("a", "base", "arm"), about_centre).notes


def test_inertias_of_some_links_alone_are_about_their_joints(tmp_path: Path) -> None:
    thin = 4 / 3 * 1.0 * 0.25**2
    body = read(
        tmp_path, link("base"), hinge("a", "base", "arm"), link("arm", com="0 0 0.25", inertia=thin),
        hinge("b", "arm", "hand"), link("hand", com="0 0 0.25", inertia=thin / 4),
    )  # fmt: skip
    told, named, every = (
        robot_of_body(body, {} if about is None else {"inertia_about": about}, "arm.yaml")
        for about in (None, ["arm"], [])
    )
    (hint,) = [n for n in told[1] if n.startswith("hint")]
    assert "inertia of arm looks" in hint and "means all 2 links that hinges carry" in hint
    assert "'inertia_about: [LINK, ...]' means those it names" in hint
    assert not [n for n in named[1] if n.startswith("hint")]
    assert sorted(named[0].part("arm").inertia_kg_m2[:3]) == pytest.approx([thin / 4, thin / 4, thin / 2])
    assert named[0].part("hand") == told[0].part("hand")
    assert every[0].parts == told[0].parts


def test_a_drive_without_a_speed_limit_has_the_speed_of_its_joint_as_scale() -> None:
    robot, _ = load_robot({"urdf": str(ARM), "drives": {"shoulder": {"kp": 1}}})
    velocity = next(s for s in robot.sensors if s.kind == "velocity")
    assert math.isinf(robot.drives[0].speed_limit)
    assert channel_range(robot, velocity) == 2 * robot.joint("shoulder").top_speed
    assert math.isfinite(channel_range(robot.with_joint("shoulder", top_speed=math.inf), velocity))


def test_sensors_of_the_base_may_stand_beside_the_usual_ones_of_all_joints() -> None:
    body = read_urdf(ARM)
    drives = {"shoulder": {"kp": 20}, "elbow": {"kp": 10}}
    usual, more = (
        robot_of_body(body, {"drives": drives, "free_base": True} | listed, "arm.yaml")[0].sensors
        for listed in ({}, {"sensors": ["joints", {"name": "tilt", "kind": "roll"}]})
    )
    assert more[:-1] == usual and (more[-1].name, more[-1].kind) == ("tilt", "roll")
    with pytest.raises(
        RobotError, match=r"sensors\[0\]: expected \{name, kind, target\}, or joints for those of every"
    ):
        robot_of_body(body, {"drives": drives, "sensors": ["joint"]}, "arm.yaml")


def test_controllers_may_keep_to_the_velocity_limits_of_the_file() -> None:
    body = read_urdf(ARM)
    drives = {"shoulder": {"kp": 20}, "elbow": {"kp": 10, "command_speed": 0.5}}
    scaled, obeyed = (
        robot_of_body(body, {"drives": drives, "velocity_limits": how}, "arm.yaml")[0] for how in ("scale", "obeyed")
    )
    tops = [obeyed.joint(d.joint).top_speed for d in obeyed.drives]
    assert [d.command_speed for d in scaled.drives] == [math.inf, 0.5]
    assert [d.command_speed for d in obeyed.drives] == [tops[0], 0.5]
    bare = replace(body, joints=tuple(replace(j, top_speed=math.inf) for j in body.joints))
    with pytest.raises(RobotError, match="velocity_limits: obeyed: the file states none"):
        robot_of_body(bare, {"drives": drives, "velocity_limits": "obeyed"}, "arm.yaml")
    for only in ("command_acceleration", "command_duration", "feed_forward"):
        by_torque = drives | {"shoulder": {"command": "torque", "torque_limit": 3.0, only: 2.0}}
        with pytest.raises(RobotError, match=f"{only} is of controllers of positions"):
            robot_of_body(body, {"drives": by_torque}, "arm.yaml")


def test_limits_that_an_export_left_blank_are_none(tmp_path: Path) -> None:
    def blank(joint: ET.Element) -> None:
        limit = joint.find("limit")
        assert limit is not None
        limit.attrib.update(lower="0", upper="0", effort="0", velocity="0")

    body = read_urdf(changed(tmp_path, elbow=blank))
    (elbow,) = [j for j in body.joints if j.name == "elbow"]
    assert elbow.upper > 6 and elbow.lower < -6
    assert any("joint 'elbow': its limits are all zero, as an export leaves them blank" in a for a in body.assumed)


def test_moments_that_miss_the_triangle_inequality_by_a_little_are_raised_and_said(tmp_path: Path) -> None:
    body = read(tmp_path, link("base"), hinge("a", "base", "arm"), link("arm", diagonal=(0.0016, 0.006, 0.0078)))
    xx, yy, zz, *products = body.parts[1].inertia_kg_m2
    assert zz == pytest.approx(0.0078) and xx + yy == pytest.approx(zz)
    assert xx / yy == pytest.approx(0.0016 / 0.006) and products == pytest.approx([0, 0, 0], abs=1e-12)
    assert len(body.assumed) == 1 and "'arm' (2.6 %)" in body.assumed[0]
    robot, _ = robot_of_body(body, {"drives": {"a": {"kp": 1}}}, "r.yaml")
    job = [Rollout(robot, Commands(np.full((1, 1), 0.3)), 50, pose=True)]
    for engine in (PyBulletEngine(), MuJoCoEngine(threads=1)):
        assert engine.rollout(job)[0].finite


def test_all_links_whose_inertia_no_rigid_body_has_are_named_at_once(tmp_path: Path) -> None:
    with pytest.raises(UrdfError, match=r"'one' \(0.001, 0.001, 0.01\), 'two' \(-0.001.*take them from CAD") as caught:
        read(
            tmp_path, link("base"), hinge("a", "base", "one"), link("one", diagonal=(0.001, 0.001, 0.01)),
            hinge("b", "one", "two"), link("two", diagonal=(0.001, -0.001, 0.001)), hinge("c", "two", "three"), link("three"),
        )  # fmt: skip
    assert "\n" not in str(caught.value) and "three" not in str(caught.value)


def test_what_is_fixed_to_a_bolted_base_needs_no_inertia(tmp_path: Path) -> None:
    body = read(
        tmp_path, link("base", diagonal=(0.001, 0.001, 0.01)), hinge("f", "base", "mast", "fixed"),
        link("mast", diagonal=(0.0, 0.0, 0.01)), hinge("a", "base", "arm"), link("arm"),
    )  # fmt: skip
    assert "'base' (0.001, 0.001, 0.01), 'mast' (0, 0, 0.01)" in body.assumed[0]
    drives = {"drives": {"a": {"kp": 1}}}
    robot, _ = robot_of_body(body, drives, "r.yaml")
    job = [Rollout(robot, Commands(np.full((1, 1), 0.3)), 50, pose=True)]
    for engine in (PyBulletEngine(), MuJoCoEngine(threads=1)):
        assert engine.rollout(job)[0].finite
    with pytest.raises(RobotError, match=r"'mast'.*no rigid body has this inertia.*free_base: false"):
        robot_of_body(body, drives | {"free_base": True}, "r.yaml")


LEFT_OUT = [(0.0, 0.008, 0.0), (1e-6, 0.008, 1e-6)]


@pytest.mark.parametrize("diagonal", LEFT_OUT)
def test_moments_that_a_planar_robot_leaves_out_count_for_nothing(
    tmp_path: Path, diagonal: tuple[float, float, float]
) -> None:
    """Both links turn about y, whose moment is given: the motion is that of the same robot with all moments."""
    drives, logs = {"drives": {"a": {"kp": 5}, "b": {"kp": 5}}, "free_base": False}, []
    for own in (diagonal, (0.005, 0.008, 0.006)):
        body = read(
            tmp_path, link("base"), hinge("a", "base", "one"), link("one", com="0 0 0.1", diagonal=own),
            hinge("b", "one", "two", inside='<dynamics damping="0.1"/>'), link("two", com="0 0 0.1", diagonal=own),
        )  # fmt: skip
        robot, _ = robot_of_body(body, drives, "r.yaml")
        (log,) = MuJoCoEngine(threads=1).rollout([Rollout(robot, Commands(np.full((1, 2), 0.3)), 50)])
        logs.append(log.sensors)
        if own == diagonal:
            (note,) = [a for a in body.assumed if "left out" in a]
            assert "'one' (" in note and "'two' (" in note and "all joints turn about one direction" in note
            with pytest.raises(RobotError, match=r"'one'.*no rigid body has this inertia.*free_base: false"):
                robot_of_body(body, drives | {"free_base": True}, "r.yaml")
    assert np.allclose(*logs, atol=1e-6)


@pytest.mark.parametrize("diagonal", [(0.0, 0.008, 0.001), (0.0004, 0.8, 0.0004), (0.008, 0.0, 0.0), (0.0, 0.0, 0.0)])
def test_others_that_no_rigid_body_has_are_refused_of_planar_robots_too(
    tmp_path: Path, diagonal: tuple[float, float, float]
) -> None:
    with pytest.raises(UrdfError, match="no rigid body has this inertia"):
        read(tmp_path, link("base"), hinge("a", "base", "one"), link("one", diagonal=diagonal))
    about_z = hinge("a", "base", "one").replace("0 1 0", "0 0 1")
    with pytest.raises(UrdfError, match="no rigid body has this inertia"):
        read(tmp_path, link("base"), about_z, link("one", diagonal=(0.0, 0.0, 0.0)))


@pytest.mark.parametrize("diagonal", LEFT_OUT)
def test_moments_that_are_left_out_of_a_robot_that_turns_about_two_directions_are_refused(
    tmp_path: Path, diagonal: tuple[float, float, float]
) -> None:
    yawing = hinge("a", "base", "one").replace("0 1 0", "0 0 1")
    with pytest.raises(UrdfError, match=r"'two' .* no rigid body has this inertia"):
        read(tmp_path, link("base"), yawing, link("one"), hinge("b", "one", "two"), link("two", diagonal=diagonal))


def test_an_inertia_of_another_unit_is_refused_before_anything_is_guessed_from_it(tmp_path: Path) -> None:
    def mistyped(link: ET.Element) -> None:
        link.find("inertial/inertia").attrib.update(ixx="6.9e4", iyy="6.9e4")  # type: ignore[union-attr]

    with pytest.raises(
        RobotError, match=r"'forearm' \(6.9e\+04 kg.m\^2 for .* m away from its centre\).*1 kg.mm\^2 is 1e-6"
    ):
        read_body("urdf", changed(tmp_path, forearm=mistyped))
    assert read_body("urdf", ARM).parts


def test_shapes_of_size_zero_are_left_out_and_said(tmp_path: Path) -> None:
    def flat(link: ET.Element) -> None:
        link.find("collision/geometry/box").set("size", "0 0 0")  # type: ignore[union-attr]

    body = read_urdf(changed(tmp_path, forearm=flat))
    assert "collision shapes of size 0 left out: forearm" in body.notes
    assert all(min(s.size) > 0 for p in body.parts for s in p.shapes)

    def inside_out(link: ET.Element) -> None:
        link.find("collision/geometry/box").set("size", "0.1 -0.1 0.1")  # type: ignore[union-attr]

    with pytest.raises(UrdfError, match="expected three positive numbers"):
        read_urdf(changed(tmp_path, forearm=inside_out))
