"""What an MJCF says in ways that are easily overlooked, held against MuJoCo's own compilation."""

from __future__ import annotations

from pathlib import Path

import mujoco
import pytest

from ee_dist.engines.mujoco.mjcf import read_mjcf
from ee_dist.engines.mujoco.model import Model
from ee_dist.robots.describe import load_robot
from ee_dist.robots.model import Robot, RobotError

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
    assert sum(p.mass_kg for p in robot.parts[1:]) == pytest.approx(theirs.body_mass.sum())
    assert built(robot).dof_M0 == pytest.approx(theirs.dof_M0)


def test_a_lost_mesh_is_an_error_where_its_mass_would_move(tmp_path: Path) -> None:
    mesh = '<asset><mesh name="m" file="nowhere.stl"/></asset>'
    file = written(tmp_path, f'<body><geom type="mesh" mesh="m"/><body><joint/>{POLE}</body></body>', mesh)
    assert read_mjcf(file).parts[-1].mass_kg == 1.0
    file = written(tmp_path, f'<body><joint/>{POLE}<body><geom type="mesh" mesh="m"/></body></body>', mesh)
    with pytest.raises(RobotError, match=r"no mesh .*nowhere.stl, and no <inertial>"):
        read_mjcf(file)
