"""What an MJCF says in ways that are easily overlooked, held against MuJoCo's own compilation."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pybullet as p
import pytest

from ee_dist.engines.contract import Rollout
from ee_dist.engines.drivers import Commands
from ee_dist.engines.mujoco.bodies import Group
from ee_dist.engines.mujoco.engine import MuJoCoEngine
from ee_dist.engines.mujoco.mjcf import read_mjcf
from ee_dist.engines.mujoco.model import Model
from ee_dist.engines.pybullet.engine import PyBulletEngine
from ee_dist.engines.pybullet.world import World
from ee_dist.robots.describe import load_robot
from ee_dist.robots.mass_matrix import rotation_matrix
from ee_dist.robots.model import Robot, RobotError
from ee_dist.robots.starter import starter

CUBE = '<mesh name="cube" vertex="0 0 0 .1 0 0 0 .1 0 0 0 .1 .1 .1 0 .1 0 .1 0 .1 .1 .1 .1 .1"/>'
"""10 cm long, so 1 kg in water."""
INERTIAL = '<inertial pos="0 0 0" mass="{}" diaginertia="1 1 1"/>'
POLE = '<geom type="capsule" fromto="0 0 0 0 0 .3" size=".02" mass="1"/>'


def written(folder: Path, world: str, rest: str = "") -> Path:
    file = folder / "robot.xml"
    file.write_text(f"<mujoco><worldbody>{world}</worldbody>{rest}</mujoco>")
    return file


def built(robot: Robot) -> mujoco.MjModel:
    """MuJoCo's model of a robot as the engine has it."""
    model = Model(robot)
    model.fill(model.numbers(robot))
    return model.compiled


def by_mujoco(file: Path) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """MuJoCo's own model of a file, at its first keyframe if it has one."""
    m = mujoco.MjModel.from_xml_path(str(file))
    d = mujoco.MjData(m)
    if m.nkey:
        mujoco.mj_resetDataKeyframe(m, d, 0)
    mujoco.mj_forward(m, d)
    return m, d


@pytest.mark.parametrize(
    ("geoms", "rest"),
    [
        ('<geom type="mesh" mesh="cube" mass="2"/><geom size=".01" pos="0 0 .3" mass=".1"/>', ""),
        ('<geom type="mesh" mesh="cube" contype="0" conaffinity="0"/><geom size=".01" pos="0 0 .3" mass=".1"/>', ""),
        (f'{INERTIAL.format(0.3)}<body pos="0 0 .1"><geom type="mesh" mesh="cube" mass=".2"/></body>', ""),
        (f'{INERTIAL.format(9)}<geom type="mesh" mesh="cube" mass="2" contype="0" conaffinity="0"/><geom size=".1"/>',
         '<compiler inertiafromgeom="true"/>'),
        (f'{INERTIAL.format(9)}<geom type="mesh" mesh="cube"/>', ""),
        (f'{INERTIAL.format(9)}<geom type="mesh" mesh="cube"/><geom size=".1"/>', '<compiler inertiafromgeom="false"/>'),
        ('<geom type="mesh" mesh="cube" mass="0"/><geom size=".1"/>', ""),
    ],
)  # fmt: skip
def test_meshes_weigh_as_in_mujoco(tmp_path: Path, geoms: str, rest: str) -> None:
    file = written(tmp_path, f'<body name="arm"><joint axis="0 1 0"/>{geoms}</body>', f"<asset>{CUBE}</asset>{rest}")
    robot, _ = load_robot(file)
    theirs, _ = by_mujoco(file)
    assert sum(part.mass_kg for part in robot.parts[1:]) == pytest.approx(theirs.body_mass.sum())
    assert built(robot).dof_M0 == pytest.approx(theirs.dof_M0)


def test_a_lost_mesh_is_an_error_where_its_mass_would_move(tmp_path: Path) -> None:
    mesh = '<asset><mesh name="m" file="nowhere.stl"/></asset>'
    file = written(tmp_path, f'<body><geom type="mesh" mesh="m"/><body><joint/>{POLE}</body></body>', mesh)
    assert read_mjcf(file).parts[-1].mass_kg == 1.0
    file = written(tmp_path, f'<body><joint/>{POLE}<body><geom type="mesh" mesh="m"/></body></body>', mesh)
    with pytest.raises(RobotError, match=r"no mesh .*nowhere.stl, and no <inertial>"):
        read_mjcf(file)


CART = (
    '<body name="cart"><joint name="x" type="slide" axis="1 0 0"/><geom type="box" size=".1 .1 .1" mass="1"/>'
    f'<body name="pole"><joint name="pole" axis="0 1 0"/>{POLE}</body></body>'
)
TILTED = '<keyframe><key qpos="0.3 3"/></keyframe>'


def test_gains_that_a_file_states_are_asked_about(tmp_path: Path) -> None:
    """A file that is simulated has gains, whether anybody knew them or not."""
    for kind, asked in (("position", True), ("motor", False)):
        gain = ' kp="20"' if asked else ""
        file = written(tmp_path, CART, f'<actuator><{kind} joint="x"{gain}/></actuator>')
        made = starter(read_mjcf(file), "mjcf", file.name, str(file))
        assert any(m.startswith("whether the file's gains of x are the robot's") for m in made.missing) == asked
        torques = "whether the robot's own drives obey torques, as the file's actuators of x do"
        assert any(m.startswith(torques) for m in made.missing) != asked


def test_of_a_file_without_actuators_it_is_said_how_a_controller_leads_a_joint(tmp_path: Path) -> None:
    """The comments are lines of drives: with their mark taken off they are the description of a robot that takes commands."""
    cart = CART.replace("<joint ", '<joint limited="true" range="-1 1" ')
    file = written(tmp_path, cart, "")
    made = starter(read_mjcf(file), "mjcf", file.name, str(file))
    assert {d.command for d in made.robot.drives} == {"none"}
    assert any(m.startswith("what drives x, pole: the file has no actuators") for m in made.missing)
    assert made.read[2].startswith("0 joints with a drive")
    lines = made.text.splitlines()
    led = [line.replace("#", " ", 1) for line in lines if line.startswith("#  ")]
    kept = [line for line in lines if not line.startswith((*(f"  {d.joint}:" for d in made.robot.drives), "#"))]
    kept[kept.index("drives:") + 1 : kept.index("drives:") + 1] = led
    (tmp_path / "led.yaml").write_text("\n".join(kept))
    robot, _ = load_robot(tmp_path / "led.yaml")
    assert [(d.joint, d.command) for d in robot.drives] == [("x", "position"), ("pole", "position")]
    assert all(d.kp > 0 and d.kd > 0 and np.isfinite(d.torque_limit) for d in robot.drives)
    assert robot.assumed_joints("kp") and robot.assumed_joints("torque_limit")
    driven = written(tmp_path, cart, '<actuator><motor joint="x"/></actuator>')
    assert "#  " not in starter(read_mjcf(driven), "mjcf", driven.name, str(driven)).text


def test_joints_that_the_file_leaves_undriven_swing_from_where_they_start(tmp_path: Path) -> None:
    file = written(tmp_path, CART, f'<actuator><motor joint="x"/></actuator>{TILTED}')
    body = read_mjcf(file)
    made = starter(body, "mjcf", file.name, str(file))
    robot, _ = load_robot(file)
    for found in (made.robot, robot):
        assert [(d.joint, d.command, d.kp) for d in found.drives] == [("x", "torque", 0.0), ("pole", "none", 0.0)]
    assert any(r.startswith("1 joints with a drive") for r in made.read)
    m, d = by_mujoco(file)
    expected = np.zeros((300, 2))
    for row in expected:
        row[:] = d.qpos
        mujoco.mj_step(m, d)
    job = [Rollout(robot, Commands(np.zeros((1, 2))), len(expected), pose=True)]
    for engine in (MuJoCoEngine(threads=1), PyBulletEngine()):
        (log,) = engine.rollout(job)
        assert log.joints is not None
        assert log.joints[0] == pytest.approx([0.3, 3.0])
        assert np.abs(log.joints - expected).max() < 0.05 * np.ptp(expected[:, 1])


def test_a_joint_without_any_drive_begins_at_its_start(tmp_path: Path) -> None:
    file = written(tmp_path, CART, TILTED)
    robot = replace(load_robot(file)[0], drives=(), sensors=())
    group = Group(Model(robot), [Rollout(robot, Commands(np.zeros((1, 0))), 1)], 1)
    assert group.positions[0] == pytest.approx([0.3, 3.0])
    world = World(robot, 1)
    world.prepare([robot], [None])
    states = [p.getJointState(world.bodies[0], k, physicsClientId=world.client)[0] for _, k in world.joint_links]
    world.close()
    assert states == pytest.approx([0.3, 3.0])


@pytest.mark.parametrize(
    ("joint", "rest"),
    [("", ""), ("<freejoint/>", ""), ("<freejoint/>", '<keyframe><key qpos="1 2 3 .6 0 .8 0 .4"/></keyframe>')],
)
def test_a_base_inside_a_massless_one_is_placed_by_both(tmp_path: Path, joint: str, rest: str) -> None:
    world = (
        f'<body pos="0 0 1" euler="0 90 0">{joint}<body name="base" pos=".2 0 .1" euler="0 0 30"><geom size=".1" mass="3"/>'
        f'<body><joint axis="0 1 0"/>{POLE}</body></body></body>'
    )
    file = written(tmp_path, world, rest)
    robot, _ = load_robot(file)
    m, d = by_mujoco(file)
    base = m.body("base").id
    assert robot.root.name == "base"
    assert robot.start_position_m == pytest.approx(d.xpos[base])
    assert rotation_matrix(robot.start_rotation).ravel() == pytest.approx(d.xmat[base])
    ours = built(robot)
    data = mujoco.MjData(ours)
    data.qpos[-1] = robot.joints[0].start
    mujoco.mj_forward(ours, data)
    # A force on the joint is the same in any frame of the base.
    assert data.qfrc_bias[-1] == pytest.approx(d.qfrc_bias[-1])


def test_a_robot_stands_as_far_above_its_floor_as_in_mujoco(tmp_path: Path) -> None:
    file = written(
        tmp_path,
        '<geom type="plane" size="2 2 .1" pos="0 0 -.75"/><geom type="plane" size="2 2 .1" pos="3 0 0" zaxis="-1 0 0"/>'
        f'<body name="a" pos="0 0 .05"><joint name="j" axis="0 1 0"/>{POLE}</body>',
    )
    robot, notes = load_robot(file)
    assert robot.world.has_floor
    assert robot.start_position_m == (0.0, 0.0, 0.75)
    assert "planes left out, for there is one level floor: 1" in notes


def test_a_tilted_floor_is_said_and_lies_where_the_robot_stands(tmp_path: Path) -> None:
    plane = '<geom type="plane" size="1 1 1" euler="0 10 0"/>'
    file = written(tmp_path, f'{plane}<body pos="1 0 1"><freejoint/>{POLE}</body>')
    robot, notes = load_robot(file)
    assert any("tilted by 10 degrees" in n for n in notes)
    assert robot.start_position_m[2] == pytest.approx(1 + np.tan(np.radians(10)))


@pytest.mark.parametrize(
    ("floor", "foot"),
    [
        ('friction="1"', 'friction="0.3"'),
        ('friction="0.4"', 'friction="0.7"'),
        ('friction="1"', 'friction="0.3" priority="1"'),
        ('friction="0.2" priority="2"', 'friction="0.9" priority="1"'),
    ],
)
def test_a_foot_grips_as_mujoco_chooses_between_it_and_the_floor(tmp_path: Path, floor: str, foot: str) -> None:
    world = f'<geom type="plane" size="1 1 1" {floor}/><body pos="0 0 .09"><freejoint/>'
    file = written(tmp_path, f'{world}<geom size=".1" {foot}/></body>')
    _, d = by_mujoco(file)
    robot, _ = load_robot(file)
    assert robot.root.grip == pytest.approx(d.contact[0].friction[0])


def test_shapes_that_cannot_touch_here_are_said(tmp_path: Path) -> None:
    feet = '<geom type="mesh" mesh="cube" pos="0 0 -.4"/><geom type="ellipsoid" size=".1 .1 .1" pos="0 0 -.4"/>'
    file = written(
        tmp_path,
        '<geom type="plane" size="1 1 1"/><body name="trunk"><freejoint/><geom type="box" size=".1 .1 .1" mass="3"/>'
        f'<body name="leg">{INERTIAL.format(0.3)}<joint axis="0 1 0"/>{feet}</body></body>',
        f"<asset>{CUBE}</asset>",
    )
    (note,) = [n for n in load_robot(file)[1] if "shapes that touch" in n]
    assert "2 of leg" in note


def hinged(folder: Path, actuators: str, joint: str = "", rest: str = "") -> Path:
    """A pole on a hinge ``j`` from -1 to 1 rad."""
    body = f'<body><joint name="j" axis="0 1 0" range="-1 1" {joint}/>{POLE}</body>'
    return written(folder, body, f'<compiler angle="radian"/><actuator>{actuators}</actuator>{rest}')


@pytest.mark.parametrize("geared", ["<position {}/>", "<motor {}/>", '<muscle {} lengthrange="0 1"/>'])
def test_armature_and_damping_of_an_actuator_come_through_its_gear(tmp_path: Path, geared: str) -> None:
    fields = 'joint="j" gear="3" armature=".1" damping=".2"'
    robot, _ = load_robot(hinged(tmp_path, geared.format(fields), 'armature=".05" damping=".3"'))
    m, d = by_mujoco(tmp_path / "robot.xml")
    assert built(robot).dof_M0 == pytest.approx(m.dof_M0)
    still, d.qvel[0] = float(d.qfrc_passive[0]), 1.0
    mujoco.mj_forward(m, d)
    assert robot.drives[0].viscous == pytest.approx(still - d.qfrc_passive[0])


def test_the_delay_of_an_actuator_is_that_of_its_commands(tmp_path: Path) -> None:
    robot, notes = load_robot(hinged(tmp_path, '<position joint="j" kp="5" kv=".1" delay=".02" nsample="20"/>'))
    assert robot.drives[0].delay_s == 0.02
    assert not notes


def test_gravity_that_is_switched_off_is_off(tmp_path: Path) -> None:
    flags = '<option><flag gravity="disable" damper="disable" limit="disable"/></option>'
    robot, notes = load_robot(hinged(tmp_path, '<motor joint="j"/>', rest=flags))
    assert robot.world.gravity_m_s2 == 0.0
    assert notes == ("switched off in the file, but not here: limit, damper",)


@pytest.mark.parametrize(("carried", "gravity"), [(("cart", "pole"), 0.0), (("pole",), 9.81)])
def test_weight_that_the_file_compensates_is_none_where_it_is_that_of_all(
    tmp_path: Path, carried: tuple[str, ...], gravity: float
) -> None:
    bodies = CART
    for name in carried:
        bodies = bodies.replace(f'<body name="{name}">', f'<body name="{name}" gravcomp="1">')
    file = written(tmp_path, bodies, '<actuator><motor joint="x"/></actuator>')
    made = starter(read_mjcf(file), "mjcf", file.name, str(file))
    assert made.robot.world.gravity_m_s2 == gravity
    (line,) = (x for x in made.text.splitlines() if x.startswith("gravity_m_s2"))
    assert ("the file compensates the weight of all bodies that move" in line) == (not gravity)
    assert ("1 gravity compensation left out" in made.read) == bool(gravity)
    assert not any("gravity compensations" in r for r in made.read)


LIMITED = '<{} name="a" joint="j" {}/>'


@pytest.mark.parametrize(
    ("actuators", "joint", "rest", "said"),
    [
        (LIMITED.format("position", 'kp="5" forcerange="-1 5"'), "", "", "a: its torque is not limited alike both ways"),
        (LIMITED.format("motor", 'ctrlrange="0 3"'), "", "", "a: its torque is not limited alike both ways"),
        (LIMITED.format("motor", ""), 'actuatorfrcrange="-1 4"', "", "a: its torque is not limited alike both ways"),
        (LIMITED.format("general", 'biastype="affine" biasprm="2 0 0" forcerange="-3 3"'), "", "", "a: its constant torque"),
        (LIMITED.format("position", 'kp="5" ctrlrange="-.5 1"'), "", "", "leave its ctrlrange, -0.5 to 1 at the joint"),
        (LIMITED.format("velocity", 'kv="5" ctrlrange="-2 2"'), "", "", "leave its ctrlrange, -2 to 2 at the joint"),
        (LIMITED.format("position", 'kp="5" ctrlrange="-1 1" forcerange="-5 5"'), "", "", None),
        (LIMITED.format("position", 'kp="5" inheritrange="1"'), "", "", None),
        ('<velocity joint="j" kv="3"/><position name="p" joint="j" kp="10"/>', "", "", "only one drive of a joint is read.*: p"),
        ("", 'stiffness="4 2"', "", "not linear are taken as if they were: j"),
        ("", 'damping=".3 .5"', "", "not linear are taken as if they were: j"),
        (LIMITED.format("motor", 'damping=".3 .5"'), "", "", "not linear are taken as if they were: j"),
        ("", "", '<option density="1000" viscosity=".001"/>', "the fluid .* its density and viscosity"),
    ],
)  # fmt: skip
def test_what_a_drive_has_no_place_for_is_said_in_one_line(
    tmp_path: Path, actuators: str, joint: str, rest: str, said: str | None
) -> None:
    notes = [n for n in load_robot(hinged(tmp_path, actuators, joint, rest))[1] if "swing freely" not in n]
    assert len(notes) == (said is not None)
    assert said is None or re.search(said, notes[0])


def test_what_holds_a_free_joint_is_said(tmp_path: Path) -> None:
    freely = '<body><joint type="free" damping="2" armature=".5"/>'
    file = written(tmp_path, f'{freely}<geom size=".1"/></body>')
    assert "the free joint's damping and armature left out" in read_mjcf(file).notes


def test_joints_that_only_a_tendon_would_move_are_said_to_swing(tmp_path: Path) -> None:
    links = "".join(
        f'<body pos="0 0 {-k}"><joint name="{name}" axis="0 1 0"/>{POLE}</body>'
        for k, name in enumerate(("a", "b", "c"))
    )
    rest = (
        '<tendon><fixed name="both"><joint joint="b" coef="1"/><joint joint="c" coef="1"/></fixed></tendon>'
        '<actuator><position joint="a" kp="10"/><position tendon="both" kp="10"/></actuator>'
    )
    body = read_mjcf(written(tmp_path, links, rest))
    assert "joints that nothing drives here, and that swing: b, c" in body.notes
    driven = read_mjcf(written(tmp_path, links, '<actuator><position joint="a" kp="10"/></actuator>'))
    assert not any("swing" in note for note in driven.notes), "a file that leaves them loose means it"
