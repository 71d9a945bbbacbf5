"""What is PyBullet's own: robots share worlds, and worlds are few."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from engine_robots import at, calm_commands, loose_drive, one_joint, run

from ee_dist.engines.contract import Engine, Rollout
from ee_dist.engines.drivers import Commands
from ee_dist.engines.pybullet import engine as pybullet_engine
from ee_dist.engines.pybullet.engine import POOL, WORLDS, PyBulletEngine
from ee_dist.engines.pybullet.world import World
from ee_dist.robots.model import CONTINUOUS_RAD, Joint, Part, Robot, Sensor, Wiring
from ee_dist.robots.quadruped import quadruped


@pytest.fixture
def open_worlds(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """How many worlds are open, after each that was opened."""
    counts: list[int] = []
    now = 0

    class Counted(World):
        def __init__(self, robot: Robot, size: int) -> None:
            nonlocal now
            super().__init__(robot, size)
            now += 1
            counts.append(now)

        def close(self) -> None:
            nonlocal now
            super().close()
            now -= 1

    monkeypatch.setattr(pybullet_engine, "World", Counted)
    return counts


def floors(count: int) -> list[Robot]:
    """Robots of which no two can share a world."""
    return [quadruped().with_world(compliance_m_n=1e-5 * k) for k in range(count)]


def test_many_unlike_robots_open_few_worlds_and_move_as_each_does_alone(open_worlds: list[int]) -> None:
    steps, engine = 5, PyBulletEngine()
    driver = Commands(calm_commands(0, steps))
    asked = [Rollout(r, driver, steps) for r in floors(2 * WORLDS + POOL + 3)]
    together = engine.rollout(asked)
    assert len(open_worlds) == len(asked)
    assert max(open_worlds) <= WORLDS + POOL
    for k in (0, WORLDS, len(asked) - 1):
        alone = engine.rollout([asked[k]])[0]
        assert together[k].sensors.tobytes() == alone.sensors.tobytes()
    engine.close()


def test_like_robots_share_worlds_and_find_them_again(open_worlds: list[int]) -> None:
    steps, engine = 5, PyBulletEngine()
    asked = [Rollout(quadruped(), Commands(calm_commands(k, steps)), steps) for k in range(21)]
    first = engine.rollout(asked)
    assert len(open_worlds) == 4  # of 8, 8, 4 and 1
    again = engine.rollout(asked)
    assert len(open_worlds) == 4
    assert all(np.array_equal(a.sensors, b.sensors) for a, b in zip(first, again, strict=True))
    engine.close()


def two_arms(order: tuple[str, ...]) -> Robot:
    """A post with two arms of two parts each, unlike each other, whose parts are listed in this order."""
    masses = {"left": 1.0, "right": 0.8, "left_fore": 0.5, "right_fore": 0.2}
    below = (0.0, 0.0, -0.1)
    inertia = (0.01, 0.01, 0.002, 0.0, 0.0, 0.0)
    parts = (Part("post", 1.0, (0.0,) * 3, inertia), *(Part(n, masses[n], below, inertia) for n in order))
    joints = tuple(
        Joint(
            f"to_{n}",
            "hinge",
            n.removesuffix("_fore") if "fore" in n else "post",
            n,
            (0.0, 0.0, -0.2),
            (0.0, 1.0, 0.0),
            -9,
            9,
        )
        for n in masses
    )
    drives = tuple(replace(loose_drive(j.name), offset_torque=0.1 * (k + 1)) for k, j in enumerate(joints))
    sensors = tuple(Sensor(j.name, "position", j.name) for j in joints)
    robot = one_joint("hinge", (0.0, 1.0, 0.0))
    return replace(robot, parts=parts, joints=joints, drives=drives, sensors=sensors, wiring=Wiring(tuple(range(4))))


LEVELS, BRANCHES = ("left", "right", "left_fore", "right_fore"), ("left", "left_fore", "right", "right_fore")


@pytest.mark.parametrize("order", [LEVELS, BRANCHES, LEVELS[::-1], BRANCHES[::-1]])
def test_a_robot_moves_alike_in_whatever_order_its_parts_are_listed(
    engines: dict[str, Engine], order: tuple[str, ...]
) -> None:
    robot = two_arms(order)
    bullet, mujoco = (run(engines[name], robot, 200).sensors for name in ("pybullet", "mujoco"))
    assert np.ptp(bullet, axis=0).min() > 0.05
    assert bullet == pytest.approx(mujoco, abs=1e-3)


def test_parts_that_are_listed_branch_by_branch_keep_their_order() -> None:
    for robot in (two_arms(BRANCHES), quadruped()):
        world = World(robot, 1)
        assert world.order == [q.name for q in robot.parts[1:]]
        world.close()


def test_a_joint_without_stops_turns_as_fast_as_it_is_driven(engines: dict[str, Engine]) -> None:
    wheel = one_joint("hinge", (0.0, 0.0, 1.0)).with_joint("joint", lower=-CONTINUOUS_RAD, upper=CONTINUOUS_RAD)
    wheel = wheel.with_drive("joint", offset_torque=0.4)
    for engine in engines.values():
        speed = run(engine, wheel, 501, at([0.0], [150.0])).channel("velocity")
        assert speed[[0, -1]] == pytest.approx([150.0, 150.0 + 0.4 / 0.008], rel=1e-3)
