"""Limits of a file that are none: what nobody knew, written as 0 or as a large round number, leads no guess of a drive."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from ee_dist.robots.inertia import felt_inertia
from ee_dist.robots.limits import LEVER_M, TORQUE_PER_INERTIA
from ee_dist.robots.model import Robot
from ee_dist.robots.starter import Starter, starter
from ee_dist.robots.urdf import read_urdf

LINK = """<link name="{name}"><inertial><origin xyz="0 0 {com}"/><mass value="{mass}"/>
<inertia ixx="0.001" iyy="0.001" izz="0.0002" ixy="0" ixz="0" iyz="0"/></inertial></link>"""
JOINT = """<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/><origin xyz="0 0 0.2"/>
<axis xyz="0 1 0"/><limit lower="-2" upper="2" {effort} velocity="3"/></joint>"""


def begun(
    folder: Path, first: str, second: str, mass: float = 0.3, kind: str = "revolute", more: str = "", base: float = 0.0
) -> Starter:
    """The description to begin with of two links on a base, whose joints have these limits."""
    parts = [
        LINK.format(name="base", com=0.0, mass=base) if base else '<link name="base"/>',
        JOINT.format(name="a", kind=kind, parent="base", child="upper", effort=first),
        LINK.format(name="upper", com=0.1, mass=mass),
        JOINT.format(name="b", kind="revolute", parent="upper", child="lower", effort=second),
        LINK.format(name="lower", com=0.1, mass=mass),
    ]
    file = folder / "arm.urdf"
    file.write_text(f'<robot name="arm">{"".join(parts)}{more}</robot>')
    return starter(read_urdf(file), "urdf", "arm.urdf", "arm.urdf")


def test_a_limit_far_beyond_what_the_arm_needs_is_none_and_said_so(tmp_path: Path) -> None:
    found, open_ = begun(tmp_path, 'effort="10000"', 'effort="10000"'), begun(tmp_path, "", "")
    (said,) = [line for line in found.assumed if line.startswith("effort ")]
    assert said.startswith("effort 10000 of a, b is taken for no real limit: ") and "\n" not in said
    assert found.robot.drives == open_.robot.drives
    for drive in found.robot.drives:
        assert drive.torque_limit < 10 and drive.kp < 100 and drive.rotor_inertia < 0.1
        assert drive.joint in found.robot.assumed_joints("torque_limit")


def test_only_the_joint_that_states_it_is_guessed(tmp_path: Path) -> None:
    found = begun(tmp_path, 'effort="10000"', 'effort="3"')
    assert [line.split(" is taken")[0] for line in found.assumed if "no real" in line] == ["effort 10000 of a"]
    assert found.robot.drives[1].torque_limit == 3.0


def test_an_effort_of_0_is_said_to_be_none(tmp_path: Path) -> None:
    found = begun(tmp_path, 'effort="0"', 'effort="3"')
    assert [line.split(":")[0] for line in found.assumed if "no real" in line] == ["effort 0 of a is no real limit"]
    assert found.robot.drives[0].torque_limit == begun(tmp_path, "", 'effort="3"').robot.drives[0].torque_limit


def test_what_cad_programs_enter_for_a_light_servo_arm_stays_its_limit(tmp_path: Path) -> None:
    found = begun(tmp_path, 'effort="10"', 'effort="10"')
    assert not [line for line in found.assumed if "no real" in line]
    assert [(d.torque_limit, d.kp) for d in found.robot.drives] == [(10.0, 100.0)] * 2


@pytest.mark.parametrize(("kind", "unit"), [("revolute", "N.m"), ("prismatic", "N")])
def test_a_heavy_robot_needs_what_a_light_one_does_not(tmp_path: Path, kind: str, unit: str) -> None:
    light = begun(tmp_path, 'effort="5000"', 'effort="3"', 0.3, kind)
    assert [line.partition(" takes ")[2].split(";")[0].split()[1] for line in light.assumed if "no real" in line] == [
        unit
    ]
    heavy = begun(tmp_path, 'effort="5000"', 'effort="300"', 30.0, kind)
    assert not [line for line in heavy.assumed if "no real" in line]


def test_what_is_bolted_down_needs_no_motor(tmp_path: Path) -> None:
    """Neither a heavy base, nor the mass that a base without one is given, makes the arm's motors any stronger."""
    light = begun(tmp_path, "", "")
    heavy = begun(tmp_path, "", "", base=40.0)
    assert [d.torque_limit for d in heavy.robot.drives] == [d.torque_limit for d in light.robot.drives]
    needed = 0.6 * 9.81 * LEVER_M + TORQUE_PER_INERTIA * felt_inertia(bare(light.robot))[0]
    assert light.robot.drives[0].torque_limit == pytest.approx(needed, rel=0.05)


def bare(robot: Robot) -> Robot:
    return replace(robot, drives=tuple(replace(d, rotor_inertia=0.0) for d in robot.drives))


def chain(folder: Path, efforts: list[float], mass: float = 0.5) -> Starter:
    parts, below = ['<link name="base"/>'], "base"
    for k, effort in enumerate(efforts):
        name = f"link_{k}"
        parts += [
            JOINT.format(name=f"j{k}", kind="revolute", parent=below, child=name, effort=f'effort="{effort:g}"'),
            LINK.format(name=name, com=0.1, mass=mass),
        ]
        below = name
    file = folder / "chain.urdf"
    file.write_text(f'<robot name="chain">{"".join(parts)}</robot>')
    return starter(read_urdf(file), "urdf", "chain.urdf", "chain.urdf")


@pytest.mark.parametrize(
    ("efforts", "none"),
    [
        ([200.0] * 5, True),
        ([200.0] * 3, False),
        ([200.0] * 4 + [5.0], False),
        ([40.0] * 5, False),
    ],
)
def test_one_large_number_at_all_joints_is_none(tmp_path: Path, efforts: list[float], none: bool) -> None:
    """It is not fifty times what the first joint needs; but nobody turns a hand by the motor that holds the arm. Servos of one
    kind at all joints are some times what the first needs."""
    found = chain(tmp_path, efforts)
    assert bool([line for line in found.assumed if "no real limit" in line]) is none
    if none:
        assert all(d.torque_limit < 0.2 * efforts[0] for d in found.robot.drives)


def test_a_joint_that_turns_without_end_and_states_no_effort_is_taken_to_swing_freely(tmp_path: Path) -> None:
    def pendulum(first: str, second: str) -> Starter:
        begun(tmp_path, first, second)
        file = tmp_path / "arm.urdf"
        head, tail = file.read_text().split('<joint name="b" type="revolute">')
        file.write_text(f'{head}<joint name="b" type="continuous">{tail}')
        return starter(read_urdf(file), "urdf", "arm.urdf", "arm.urdf")

    for unstated in ("", 'effort="0"'):
        found = pendulum('effort="3"', unstated)
        arm, swinging = found.robot.drives
        assert (arm.command, swinging.command) == ("position", "none")
        (said,) = [line for line in found.assumed if line.startswith("b: taken to swing freely")]
        assert "\n" not in said and not [line for line in found.assumed if "effort 0" in line]
        assert "b: {command: none" in found.text
    # Where no joint states one, or this one does, there is nothing to tell it by.
    for first, second in (("", ""), ('effort="3"', 'effort="3"')):
        assert [d.command for d in pendulum(first, second).robot.drives] == ["position", "position"]


@pytest.mark.parametrize(("named", "said"), [(("b",), ["a"]), (("a", "b"), []), ((), []), (("other",), [])])
def test_joints_that_no_transmission_drives_are_told(tmp_path: Path, named: tuple[str, ...], said: list[str]) -> None:
    more = "".join(f'<transmission name="t"><joint name="{n}"/><actuator name="m"/></transmission>' for n in named)
    found = begun(tmp_path, 'effort="3"', 'effort="3"', more=more)
    assert [line.split(":")[0] for line in found.assumed if "transmissions of" in line] == said
    assert {d.command for d in found.robot.drives} == {"position"}
