"""An MJCF as a robot: what comes of its bodies, joints, actuators and sensors, held against MuJoCo itself."""

from __future__ import annotations

import math
from pathlib import Path

import mujoco
import numpy as np
import pytest

from ee_dist.engines.contract import EngineError, Rollout
from ee_dist.engines.drivers import Commands
from ee_dist.engines.mujoco.engine import MuJoCoEngine
from ee_dist.engines.mujoco.mjcf import read_mjcf
from ee_dist.engines.mujoco.mjcf_bare import compiled
from ee_dist.engines.pybullet.engine import PyBulletEngine
from ee_dist.robots.describe import load_robot, robot_of
from ee_dist.robots.model import Robot, RobotError
from ee_dist.trials.log import start_of

ARM = """<mujoco model="arm">
  <compiler angle="degree"/>
  <option timestep="0.002" integrator="implicitfast"/>
  <default>
    <joint damping="0.3" armature="0.02"/>
    <default class="wrist"><joint damping="0.1" range="-90 120"/></default>
  </default>
  <asset><mesh name="shell" file="nowhere.stl"/></asset>
  <worldbody>
    <geom name="floor" type="plane" size="1 1 1"/>
    <body name="base" pos="0 0 0.5" euler="0 0 30">
      <inertial mass="3" pos="0 0 0" diaginertia="0.01 0.01 0.01"/>
      <geom type="mesh" mesh="shell" contype="0" conaffinity="0"/>
      <body name="upper" pos="0 0 0.1">
        <inertial mass="2" pos="0.01 0 0.15" fullinertia="0.02 0.021 0.004 0.001 0 0.0005"/>
        <joint name="shoulder" axis="0 1 0" pos="0.02 0 0.01" range="-170 170"/>
        <geom type="capsule" size="0.03 0.1" pos="0 0 0.15"/>
        <body name="lower" pos="0 0 0.3" quat="0.9 0.1 0 0">
          <inertial mass="1" pos="0 0.02 0.1" diaginertia="0.008 0.008 0.001"/>
          <joint name="elbow" class="wrist" axis="0 1 0" ref="10"/>
          <joint name="roll" class="wrist" axis="0 0 1" pos="0 0 0.05"/>
          <site name="tip" pos="0 0 0.2"/>
          <body name="tool" pos="0 0 0.25"><site name="flange"/>
            <body name="rod"><inertial mass="0.2" pos="0 0 0.05" diaginertia="1e-4 1e-4 1e-4"/>
              <joint name="rod" type="slide" axis="1 0 0" range="-0.1 0.1" damping="5" stiffness="80" springref="0.02"/>
            </body>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator>
    <position name="a" joint="shoulder" kp="900" kv="120" forcerange="-60 60"/>
    <general name="b" joint="elbow" gear="2" gainprm="100" biastype="affine" biasprm="0 -50 -3"/>
    <motor name="c" joint="roll" ctrlrange="-3 3"/>
  </actuator>
  <sensor>
    <jointpos name="q1" joint="shoulder" noise="0.001"/><jointpos name="q2" joint="elbow"/><jointpos name="q3" joint="roll"/>
    <jointvel name="v1" joint="shoulder"/><jointpos name="x" joint="rod"/><actuatorfrc name="t1" actuator="a"/>
    <accelerometer name="imu" site="flange"/>
  </sensor>
  <keyframe><key name="home" qpos="0.5 -0.4 0.3 0"/></keyframe>
</mujoco>"""


@pytest.fixture
def arm(tmp_path: Path) -> Path:
    file = tmp_path / "arm.xml"
    file.write_text(ARM)
    return file


def native(file: Path, robot: Robot, ctrl: np.ndarray) -> np.ndarray:
    """Positions (T, M) of the robot's joints in MuJoCo under its own actuators."""
    m = compiled(file)
    m.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    d = mujoco.MjData(m)
    at = [m.joint(name).qposadr[0] for name in robot.motor_names]
    d.qpos[at] = start_of(robot)
    found = np.zeros((len(ctrl), len(at)))
    for row, value in zip(found, ctrl, strict=True):
        row[:] = d.qpos[at]
        d.ctrl[:] = value
        mujoco.mj_step(m, d)
    return found


def test_an_arm_moves_as_mujoco_says(arm: Path) -> None:
    robot, notes = load_robot(arm)
    t = np.arange(500) * robot.time_step_s
    wave = np.sin(4 * t) * np.minimum(t, 0.5)
    commands = np.stack([0.5 + 0.6 * wave, -0.4 + 0.5 * wave, 0.4 * wave, np.zeros_like(t)], axis=1)
    (log,) = MuJoCoEngine(threads=1).rollout([Rollout(robot, Commands(commands), len(t), pose=True)])
    # The elbow's ctrl counts with gear 2 and a gain twice its stiffness: one unit is one radian at the joint.
    expected = native(arm, robot, commands[:, :3])
    assert log.joints is not None
    # Friction of joints is the drive path's own, implicit in another way than MuJoCo's; a soft controller is explicit.
    assert (np.abs(log.joints - expected).max(axis=0) < 5e-3 * np.ptp(expected, axis=0)).all()
    assert np.ptp(expected, axis=0).min() > 0.003
    assert not any("actuator b" in n for n in notes)


def test_masses_and_degrees_of_freedom_are_mujocos(arm: Path) -> None:
    robot, _ = load_robot(arm)
    m = compiled(arm)
    assert sum(p.mass_kg for p in robot.parts) == pytest.approx(m.body_mass.sum(), abs=1e-4)
    assert sum(j.kind != "fixed" for j in robot.joints) == m.nv
    assert not robot.free_base
    assert robot.start_position_m == (0.0, 0.0, 0.5)
    assert robot.world.has_floor


def test_actuators_are_drives_with_their_limits_and_passive_joints_keep_theirs(arm: Path) -> None:
    robot, notes = load_robot(arm)
    shoulder, elbow, roll, rod = robot.drives
    assert (shoulder.command, shoulder.kp, shoulder.kd, shoulder.torque_limit) == ("position", 900.0, 120.0, 60.0)
    assert (elbow.command, elbow.kp, elbow.kd) == ("position", 200.0, 12.0)
    assert math.isinf(elbow.torque_limit)
    assert (roll.command, roll.torque_limit, roll.viscous, roll.rotor_inertia) == ("torque", 3.0, 0.1, 0.02)
    assert (rod.command, rod.spring, rod.spring_rest, rod.viscous) == ("none", 80.0, 0.02, 5.0)
    assert robot.joint("elbow").start == pytest.approx(-0.4)
    assert [s.name for s in robot.sensors] == ["q1", "q2", "q3", "v1", "x", "t1"]
    assert robot.sensors[0].noise == 0.001
    assert any("sensors left out" in n and "imu" in n for n in notes)


@pytest.mark.parametrize(
    ("actuator", "fields", "said"),
    [
        ('<velocity joint="h" kv="5"/>', {"command": "speed", "kp": 5.0}, None),
        ('<motor joint="h" gear="10"/>', {"command": "torque"}, "10 times MuJoCo's ctrl"),
        ('<position joint="h" kp="5"/><velocity joint="h" kv="2"/>', {"kp": 5.0, "kd": 2.0}, "taken as damping"),
        ('<general joint="h" biastype="affine" biasprm="3 0 -2"/>', {"viscous": 2.0, "offset_torque": 3.0}, None),
        ('<muscle joint="h" lengthrange="0.1 1"/>', {"command": "none"}, "actuators left out"),
        ('<intvelocity joint="h" kp="4" actrange="-1 1"/>', {"command": "none"}, "actuators left out"),
    ],
)
def test_each_kind_of_actuator(tmp_path: Path, actuator: str, fields: dict[str, object], said: str | None) -> None:
    file = tmp_path / "one.xml"
    file.write_text(
        '<mujoco><worldbody><body name="b"><joint name="h" type="hinge" frictionloss="0.1"/><geom size="0.1"/></body>'
        f"</worldbody><actuator>{actuator}</actuator></mujoco>"
    )
    robot, notes = load_robot(file)
    for name, value in fields.items():
        assert getattr(robot.drives[0], name) == value
    assert (said is None) == (not notes)
    assert said is None or any(said in n for n in notes)
    assert robot.drives[0].coulomb == 0.1


def test_a_free_robot_starts_as_its_keyframe_says(tmp_path: Path) -> None:
    file = tmp_path / "hopper.xml"
    file.write_text(
        '<mujoco><worldbody><body name="trunk" pos="0 0 1"><freejoint/><geom type="box" size="0.1 0.1 0.05" mass="2"/>'
        '<body name="leg"><joint name="hip" axis="0 1 0" range="20 90"/><geom name="foot" type="sphere" size="0.03" '
        'pos="0 0 -0.3" mass="0.2" friction="0.6"/><site name="sole" pos="0 0 -0.3" size="0.05"/></body></body></worldbody>'
        '<actuator><position joint="hip" kp="10"/></actuator><sensor><touch name="t" site="sole"/></sensor>'
        '<keyframe><key qpos="0 0 0.4 1 0 0 0 0.6"/></keyframe></mujoco>'
    )
    robot, _ = load_robot(file)
    assert robot.free_base
    assert robot.start_position_m == (0.0, 0.0, 0.4)
    assert robot.part("leg").grip == 0.6
    assert [(s.name, s.kind, s.target) for s in robot.sensors] == [("t", "touch", "leg")]
    for engine in (MuJoCoEngine(threads=1), PyBulletEngine()):
        (log,) = engine.rollout([Rollout(robot, Commands(np.array([[0.6]])), 400, pose=True)])
        assert log.joints is not None
        assert log.base_pose is not None
        assert log.joints[0] == 0.6
        assert log.base_pose[-1, 2] < 0.4
        assert (log.channel("t") == 1).any()


def test_a_description_goes_on_top_of_an_mjcf(arm: Path, tmp_path: Path) -> None:
    (tmp_path / "arm.yaml").write_text("mjcf: arm.xml\ntime_step_s: 0.001\ndrives: {shoulder: {kp: 50, kd: 5}}\n")
    robot, _ = load_robot(tmp_path / "arm.yaml")
    assert (robot.drives[0].kp, robot.drives[0].torque_limit, robot.time_step_s) == (50.0, 60.0, 0.001)
    assert robot.motor_names == ("shoulder", "elbow", "roll", "rod")
    assert robot_of("mjcf", str(arm))[0] == load_robot(arm)[0]
    (tmp_path / "drives.yaml").write_text("drives: {shoulder: {kp: 50, kd: 5}}\n")
    assert robot_of("mjcf", str(arm), str(tmp_path / "drives.yaml"))[0].drives == robot.drives
    with pytest.raises(RobotError, match=r"robot=mjcf needs robot.file=FILE.xml"):
        robot_of("mjcf")


def test_a_controller_too_steep_for_a_step_is_held_by_mujoco_and_refused_by_pybullet(arm: Path) -> None:
    robot = load_robot(arm)[0].with_drive("shoulder", kp=9000.0, kd=3000.0)
    job = [Rollout(robot, Commands(np.array([[0.5, -0.4, 0.0, 0.0]])), 300, pose=True)]
    (log,) = MuJoCoEngine(threads=1).rollout(job)
    assert log.joints is not None
    assert np.abs(log.joints[-1, 0] - 0.5) < 0.02
    with pytest.raises(EngineError, match=r"pybullet cannot hold 'shoulder': .*use engine=mujoco"):
        PyBulletEngine().rollout(job)


ONE = '<mujoco><worldbody><body name="b"><joint/>{}<geom size="0.1"/></body></worldbody>{}</mujoco>'


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (ONE.format('<replicate count="1000"><replicate count="1000"><site/></replicate></replicate>', ""), "10000 elements"),
        (ONE.format("", '<include file="robot.xml"/>'), "includes itself"),
        (ONE.format("", '<include file="absent.xml"/>'), "absent.xml: no such file"),
        (ONE.format('<inertial mass="-1" pos="0 0 0" diaginertia="1 1 1"/>', ""), "MuJoCo cannot build it: .*mass"),
        (ONE.format('<inertial mass="1e308" pos="0 0 0" diaginertia="1 1 1"/>', ""), "mass_kg: 1e.308; expected"),
        (ONE.format('<inertial mass="nan" pos="0 0 0" diaginertia="1 1 1"/>', ""), "MuJoCo cannot build it"),
        (ONE.format("<nonsense/>", ""), "MuJoCo cannot build it: .*nonsense"),
        ("<mujoco/>", "no <body> within its <worldbody>"),
        (ONE.replace("<joint/>", '<joint type="ball"/>').format("", ""), "is a ball; write it as three hinges"),
        (ONE.format("", "<worldbody><body><freejoint/><geom size='1'/></body></worldbody>"), "the robot alone"),
        ('<mujoco><worldbody><body><joint/><geom type="mesh" mesh="m"/></body></worldbody><asset><mesh name="m" '
         'file="/dev/zero"/></asset></mujoco>', "no mesh /dev/zero"),
        (ONE.format("", '<asset><texture name="t" type="2d" builtin="flat" width="100000" height="100000"/></asset>'
                    '<size memory="900G"/>'), None),
    ],
)  # fmt: skip
def test_a_wrong_or_hostile_mjcf_is_one_line(tmp_path: Path, text: str, message: str | None) -> None:
    file = tmp_path / "robot.xml"
    file.write_text(text)
    if message is None:
        assert load_robot(file)[0].parts
        return
    with pytest.raises(RobotError, match=message) as caught:
        load_robot(file)
    assert "\n" not in str(caught.value)
    assert str(file) in str(caught.value) or "absent" in str(caught.value)


def test_a_world_of_several_bolted_trees_is_one_robot(tmp_path: Path) -> None:
    file = tmp_path / "two.xml"
    body = '<body name="{0}" pos="{1} 0 0"><joint name="h{0}" axis="0 1 0"/><geom size="0.05" pos="0 0 -0.2"/></body>'
    file.write_text(f"<mujoco><worldbody>{body.format('l', 0)}{body.format('r', 1)}</worldbody></mujoco>")
    body_read = read_mjcf(file)
    assert [p.name for p in body_read.parts] == ["world", "l", "r"]
    assert body_read.joints[1].position_m == (1.0, 0.0, 0.0)


@pytest.mark.parametrize(("option", "step"), [('timestep="0.002"', 0.002), ('integrator="implicitfast"', 0.005)])
def test_a_file_that_names_no_step_is_simulated_as_finely_as_its_drives_need(
    option: str, step: float, tmp_path: Path
) -> None:
    """MuJoCo's own default is for contacts, and most files of arms leave it at that."""
    file = tmp_path / "servos.xml"
    file.write_text(
        """<mujoco><include file="options.xml"/><worldbody><body name="base"><body name="link">
          <inertial mass="1" pos="0 0 0.1" diaginertia="0.004 0.004 0.001"/>
          <joint name="turn" axis="0 1 0" armature="0.02" range="-1 1"/></body></body></worldbody>
          <actuator><position name="servo" joint="turn" kp="20" kv="2"/></actuator></mujoco>"""
    )
    (tmp_path / "options.xml").write_text(f"<mujoco><option {option}/></mujoco>")
    robot, _ = load_robot({"mjcf": str(file), "free_base": False})
    assert robot.time_step_s == step
    assert read_mjcf(file).time_step_s == (step if "timestep" in option else None)
