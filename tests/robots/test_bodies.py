"""Parts that are fixed to one another are one body: to a balance of forces, and to a search."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ee_dist.effects.catalogue import apply, find, term
from ee_dist.engines.contract import Rollout
from ee_dist.engines.drivers import Commands
from ee_dist.engines.mujoco.engine import MuJoCoEngine
from ee_dist.robots.bodies import bodies_of, heaviest
from ee_dist.robots.describe import load_robot
from ee_dist.robots.inverse_dynamics import joint_torques, parameters, regressor, rotors
from ee_dist.robots.model import Joint, Part, Robot

ARM = Path(__file__).parents[2] / "docs" / "examples" / "arm.yaml"
TURN = (0.5, -0.5, 0.5, 0.5)


def with_more(robot: Robot) -> Robot:
    """The arm with a camera and its lens on the forearm, a sleeve between column and shoulder, and a box on the table."""
    inertia = (2e-3, 3e-3, 4e-3, 1e-4, -2e-4, 3e-4)
    parts = {name: Part(name, mass, (0.02, -0.01, 0.03), inertia) for name, mass in
             (("camera", 0.3), ("lens", 0.1), ("sleeve", 0.2), ("box", 5.0))}  # fmt: skip
    shoulder = robot.joint("shoulder")

    def fixed(child: str, parent: str) -> Joint:
        return Joint(f"to_{child}", "fixed", parent, child, (0.03, 0.05, -0.02), (0.0, 0.0, 1.0), 0.0, 0.0, TURN)

    joints = [replace(j, parent="sleeve") if j is shoulder else j for j in robot.joints]
    joints += [fixed("camera", "forearm"), fixed("lens", "camera"), fixed("box", "table")]
    joints.insert(1, fixed("sleeve", shoulder.parent))
    return replace(robot, parts=(*robot.parts, *parts.values()), joints=tuple(joints))


@pytest.fixture
def arm() -> Robot:
    return with_more(load_robot(ARM)[0])


def test_what_joints_move_as_one(arm: Robot) -> None:
    found = bodies_of(arm)
    assert {j: [m.part for m in members] for j, members in found.members.items()} == {
        "turn": ["column", "sleeve"],
        "shoulder": ["upper_arm"],
        "elbow": ["forearm", "camera", "lens"],
    }
    assert "box" not in found.carrier and [j.name for j in found.moving] == ["turn", "shoulder", "elbow"]
    assert [j.name for j in found.order if j.kind == "fixed"] == ["to_sleeve"], "the others lead to no joint"
    assert heaviest(arm) == {"column", "upper_arm", "camera"}
    assert parameters(arm).shape == (30,) and parameters(arm, ["elbow"]).shape == (10,)
    np.testing.assert_array_equal(parameters(arm, ["turn"]), parameters(arm))


def test_torques_are_those_that_move_it_so(arm: Robot) -> None:
    """By a regressor, and as MuJoCo has it, which knows each part."""
    rng = np.random.default_rng(3)
    q, w, a = rng.standard_normal((3, 40, 3))
    linear = regressor(arm, q, w, a) @ parameters(arm) + rotors(arm) * a
    np.testing.assert_allclose(joint_torques(arm, q, w, a), linear, rtol=1e-9, atol=1e-9)
    robot = replace(arm, time_step_s=0.0005, sensors=(), drives=tuple(replace(d, viscous=0.0) for d in arm.drives))
    t = np.arange(2000)[:, None] * robot.time_step_s
    commands = np.array([0.5, 0.4, 0.6]) * np.sin(np.array([3.0, 4.0, 5.0]) * t)
    log = MuJoCoEngine(threads=1).rollout([Rollout(robot, Commands(commands), len(t), pose=True)])[0]
    assert log.joints is not None and log.torques is not None
    speed = np.gradient(log.joints, robot.time_step_s, axis=0)
    needed = joint_torques(robot, log.joints, speed, np.gradient(speed, robot.time_step_s, axis=0))
    assert np.abs(needed - log.torques)[200:-10].max() < 0.02 * np.abs(log.torques).max()


def test_only_the_heaviest_of_what_is_fixed_together_is_proposed(arm: Robot) -> None:
    assert set(find("part_mass").proposed(arm)) == {"column", "upper_arm", "camera"}
    assert "lens" in find("part_mass").targets(arm), "who names it may ask for it"
    heavy = apply(arm, (term("part_mass", "lens", change=1.0),))
    assert parameters(heavy)[20] == pytest.approx(parameters(arm)[20] + 0.1)
    assert set(find("part_lost").proposed(arm)) == set(find("part_lost").targets(arm))
