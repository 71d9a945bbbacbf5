"""Robots that no controller holds, against their equations of motion solved to ten digits."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import mujoco
import numpy as np
import pytest
from engine_robots import at, loose_drive, one_joint
from scipy.integrate import solve_ivp

from ee_dist.engines.contract import Engine, Rollout
from ee_dist.engines.drivers import Commands
from ee_dist.engines.halfway import goes_halfway
from ee_dist.engines.mujoco.mjcf_out import mjcf_text
from ee_dist.engines.one_joint import OneJointEngine
from ee_dist.robots.describe import load_robot
from ee_dist.robots.model import Robot
from ee_dist.trials.log import Array

STEP_S, SECONDS = 0.002, 1.0
ROWS = round(SECONDS / STEP_S)
MASS_KG, LENGTH_M, COM_M, INERTIA, GRAVITY = (0.8, 0.5), 0.3, (0.15, 0.12), (0.006, 0.003), 9.81
TWO_LINKS = """<robot name="two_links"><link name="table"/>
<link name="upper"><inertial><origin xyz="0 0 -0.15"/><mass value="0.8"/>
<inertia ixx="0.006" iyy="0.006" izz="0.006" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="lower"><inertial><origin xyz="0 0 -0.12"/><mass value="0.5"/>
<inertia ixx="0.003" iyy="0.003" izz="0.003" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="a" type="continuous"><parent link="table"/><child link="upper"/><axis xyz="0 1 0"/></joint>
<joint name="b" type="continuous"><parent link="upper"/><child link="lower"/><origin xyz="0 0 -0.3"/><axis xyz="0 1 0"/></joint>
</robot>"""


@pytest.fixture(scope="module")
def two_links(tmp_path_factory: pytest.TempPathFactory) -> Robot:
    file: Path = tmp_path_factory.mktemp("urdf") / "two_links.urdf"
    file.write_text(TWO_LINKS)
    drives = {"a": {"command": "torque", "torque_limit": 20.0}, "b": {"command": "none"}}
    described = {"urdf": str(file), "free_base": False, "drives": drives, "time_step_s": STEP_S}
    return load_robot(described)[0]


def torques() -> Array:
    """Steps of 50 ms, the first joint's alone."""
    steps = np.repeat(np.sin(np.arange(20) * 1.7), ROWS // 20)
    return np.stack([1.5 * steps, np.zeros(ROWS)], axis=1)


@cache
def solved(start: tuple[float, float, float, float]) -> Array:
    """(ROWS, 2) positions by Lagrange's equations of the two links."""
    (m1, m2), (c1, c2), (i1, i2) = MASS_KG, COM_M, INERTIA
    sent = torques()[:, 0]

    def slope(t: float, y: Array) -> list[float]:
        a, b, wa, wb = y
        cross = m2 * LENGTH_M * c2 * np.cos(b)
        inner = i2 + m2 * c2**2
        inertia = np.array(
            [[i1 + m1 * c1**2 + m2 * LENGTH_M**2 + inner + 2 * cross, inner + cross], [inner + cross, inner]]
        )
        swirl = m2 * LENGTH_M * c2 * np.sin(b)
        low = m2 * c2 * GRAVITY * np.sin(a + b)
        hung = (m1 * c1 + m2 * LENGTH_M) * GRAVITY * np.sin(a) + low
        pushed = sent[min(int(t / STEP_S + 1e-9), ROWS - 1)]
        pulled = [pushed + swirl * (2 * wa * wb + wb**2) - hung, -swirl * wa**2 - low]
        return [wa, wb, *np.linalg.solve(inertia, pulled)]

    found = [np.array(start)]
    for k in range(ROWS - 1):
        step = solve_ivp(slope, (k * STEP_S, (k + 1) * STEP_S - 1e-12), found[-1], rtol=1e-10, atol=1e-12)
        found.append(step.y[:, -1])
    return np.array(found)[:, :2]


@pytest.mark.parametrize("start", [(0.3, 1.5, 0.0, 0.0), (1.5, -0.5, 1.0, -2.0)])
def test_two_links_that_swing_go_as_their_equations_say(
    engine: Engine, two_links: Robot, start: tuple[float, float, float, float]
) -> None:
    a, b, wa, wb = start
    rollout = Rollout(two_links, Commands(torques()), ROWS, start=at([a, b], [wa, wb]), pose=True)
    (log,) = engine.rollout([rollout])
    assert log.joints is not None
    assert np.abs(log.joints - solved(start)).max() < 2e-3


def test_a_spring_neither_gains_nor_loses(engine: Engine) -> None:
    """Torques are those of half way through a step: at its start a spring would drive what it holds."""
    loose = one_joint("hinge", (0.0, 0.0, 1.0), step_s=0.005)
    robot = replace(loose, drives=(replace(loose_drive("joint"), command="none", spring=20.0),))
    assert goes_halfway(robot)
    for each in (engine, OneJointEngine()):
        (log,) = each.rollout([Rollout(robot, Commands(np.zeros((4000, 1))), 4000, start=at([0.2], [0.0]), pose=True)])
        assert log.joints is not None
        first, last = np.abs(log.joints[:800]).max(), np.abs(log.joints[-800:]).max()
        assert first == pytest.approx(0.2, rel=0.02) and last == pytest.approx(first, rel=0.01)


def test_the_general_engines_and_that_of_one_joint_agree(engine: Engine) -> None:
    robot = one_joint("hinge", (0.0, 1.0, 0.0), step_s=STEP_S)
    robot = replace(robot, drives=(replace(loose_drive("joint"), command="none", viscous=0.02, coulomb=0.05),))
    rollout = Rollout(
        robot, Commands(np.zeros((ROWS, 1))), ROWS, start=at([1.0], [2.0]), again=((200, at([0.5], [-1.0])),)
    )
    (one,), (other,) = (
        engine.rollout([replace(rollout, pose=True)]),
        OneJointEngine().rollout([replace(rollout, pose=True)]),
    )
    assert one.joints is not None and other.joints is not None
    assert np.abs(one.joints - other.joints).max() < 1e-6
    assert one.joints[200, 0] == pytest.approx(0.5, abs=1e-12)


def test_robots_that_are_held_or_stand_on_a_floor_go_as_engines_do(two_links: Robot) -> None:
    held = replace(two_links, drives=tuple(replace(d, command="position", kp=1.0) for d in two_links.drives))
    assert goes_halfway(two_links) and not goes_halfway(held)
    assert not goes_halfway(replace(two_links, free_base=True))
    assert not goes_halfway(replace(two_links, drives=two_links.drives[:1])), "nobody says what drives the other joint"


def test_what_is_exported_for_mujoco_goes_as_the_robot_does(two_links: Robot) -> None:
    """MuJoCo's own default would be tens of milliradians off after a second."""
    model = mujoco.MjModel.from_xml_string(mjcf_text(two_links, False, (0.0, 0.0)))
    data, went = mujoco.MjData(model), []
    data.qpos[:] = (0.3, 1.5)
    for sent in torques():
        went.append(data.qpos.copy())
        data.ctrl[:] = sent[: model.nu]
        mujoco.mj_step(model, data)
    assert np.abs(np.array(went) - solved((0.3, 1.5, 0.0, 0.0))).max() < 1e-4
    held = replace(two_links, drives=tuple(replace(d, command="position", kp=1.0) for d in two_links.drives))
    damped = two_links.map_drive("b", lambda d: replace(d, viscous=1.0))
    for robot in (held, damped):
        assert 'integrator="implicitfast"' in mjcf_text(robot, False, (0.0, 0.0))
