"""Drives that are commanded by torque or by speed, and joints without a motor, on every engine."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from engine_robots import MASS_KG, at, one_joint, run

from ee_dist.engines.contract import Engine, Rollout
from ee_dist.engines.drivers import Commands
from ee_dist.engines.one_joint import OneJointEngine
from ee_dist.robots.instruments import with_motor_torques
from ee_dist.robots.model import Robot
from ee_dist.robots.ranges import command_span, command_unit, unit_at
from ee_dist.trials.excitation import Excitation
from ee_dist.viewing import blueprint

STEP_S = 0.002


def slide(**drive: Any) -> Robot:
    """2 kg on a level slide."""
    robot = one_joint("slide", (1.0, 0.0, 0.0), step_s=STEP_S)
    return robot.map_drive("joint", lambda d: replace(d, torque_limit=50.0, **drive))


@pytest.fixture(params=["pybullet", "mujoco", "one_joint"])
def any_engine(request: pytest.FixtureRequest, engines: dict[str, Engine]) -> Engine:
    return engines[request.param] if request.param in engines else OneJointEngine()


def test_a_torque_command_is_the_force_on_the_slide(any_engine: Engine) -> None:
    log = run(any_engine, slide(command="torque"), 501, commands=np.full((1, 1), 3.0))
    assert log.channel("velocity")[-1] == pytest.approx(3.0 / MASS_KG, rel=1e-3)
    assert log.torques is not None
    assert np.array_equal(np.unique(log.torques), [3.0])


def test_a_torque_command_beyond_the_limit_is_cut_and_knows_no_back_emf(any_engine: Engine) -> None:
    robot = slide(command="torque", speed_limit=1.0)
    log = run(any_engine, robot, 50, at([0.0], [5.0]), np.array([[80.0]]))
    assert log.torques is not None
    assert np.array_equal(np.unique(log.torques), [50.0])


def test_a_motors_current_shows_what_friction_and_a_weak_motor_take_away(any_engine: Engine) -> None:
    rubbing = with_motor_torques(slide(command="torque", coulomb=2.0, viscous=3.0, strength=0.5))
    assert with_motor_torques(rubbing) == rubbing and rubbing.sensors[-1].unit == "N"
    log = run(any_engine, rubbing, 400, commands=np.full((1, 1), 10.0))
    read = log.channel("motor_torque_joint")
    assert read[0] == 0.0, "the step before the first reading had none"
    assert np.array_equal(np.unique(read[1:]), [10.0])
    assert log.torques is not None and log.torques.max() < 0.5 * 10.0 - 2.0 + 1e-9


def test_a_speed_command_is_reached_and_held_against_friction(any_engine: Engine) -> None:
    robot = slide(command="speed", kp=40.0, ki=200.0, coulomb=2.0)
    log = run(any_engine, robot, 1500, commands=np.full((1, 1), 0.4))
    assert log.channel("velocity")[-1] == pytest.approx(0.4, rel=2e-3)


@pytest.mark.parametrize("name", ["mujoco", "one_joint"])
def test_friction_by_load_takes_no_damping_of_a_stiff_controller_for_load(
    name: str, engines: dict[str, Engine]
) -> None:
    engine = engines.get(name) or OneJointEngine()
    # The damping is taken at the end of the step; against the motor is viscous friction alone.
    robot = slide(command="speed", kp=2 * MASS_KG / STEP_S, viscous=4.0, load_friction=0.2)
    log = run(engine, with_motor_torques(robot), 400, at([0.0], [3.0]), np.full((1, 1), 3.0))
    assert log.channel("velocity")[-1] == pytest.approx(3.0, rel=0.02)
    assert log.channel("motor_torque_joint")[-1] == pytest.approx(3.0 * 4.0 / 0.8, rel=0.02)


def test_friction_by_load_does_not_drive_a_stiff_controller(any_engine: Engine) -> None:
    """Close to where an explicit step turns the motion round. PyBullet does not take damping at the end of a step: what that
    would have done passed for a load there, and the joint ran away at 100 m/s."""
    step_s = 0.001
    robot = replace(slide(kp=1e4, kd=1.9 * MASS_KG / step_s, load_friction=0.8), time_step_s=step_s)
    robot = robot.with_drive("joint", torque_limit=1e6)
    swing = 0.3 * np.sin(3.0 * step_s * np.arange(2000))[:, None]
    speed = run(any_engine, robot, 2000, commands=swing).channel("velocity")
    assert 0.5 < np.abs(speed).max() < 0.9


def test_speed_that_costs_more_torque_shows_in_the_motors_current(any_engine: Engine) -> None:
    robot = with_motor_torques(slide(command="speed", kp=40.0, viscous=2.0, speed_limit=10.0))
    # The same back-EMF in all, once the data sheet's own and once in part on top of it.
    alone, on_top = robot.with_drive("joint", speed_limit=5.0), robot.with_drive("joint", back_emf=5.0)
    told, extra = (run(any_engine, r, 300, commands=np.full((1, 1), 2.0)) for r in (alone, on_top))
    assert told.channel("velocity")[-1] > 1.5
    assert extra.channel("motor_torque_joint")[2:] == pytest.approx(told.channel("motor_torque_joint")[2:], rel=0.02)


def test_a_passive_joint_takes_no_command_but_has_its_spring_and_friction(any_engine: Engine) -> None:
    robot = slide(command="none", kp=100.0, spring=20.0, spring_rest=0.3, viscous=8.0)
    log = run(any_engine, robot, 4000, commands=np.full((1, 1), np.nan))
    assert log.channel("position")[-1] == pytest.approx(0.3, rel=1e-2)


def test_strength_delay_and_gain_act_on_torques_too(any_engine: Engine) -> None:
    robot = slide(command="torque", strength=0.5, command_gain=1.2, delay_s=5 * STEP_S)
    log = run(any_engine, robot, 40, commands=np.concatenate([np.zeros((10, 1)), np.full((30, 1), 4.0)]))
    assert log.torques is not None
    assert np.array_equal(np.flatnonzero(log.torques[:, 0]), np.arange(15, 40))
    assert log.torques[-1] == pytest.approx(0.5 * 1.2 * 4.0)


def test_an_elastic_transmission_carries_a_torque_command(any_engine: Engine) -> None:
    push = np.full((1, 1), 3.0)
    plain, soft = (run(any_engine, slide(command="torque", compliance=c), 300, commands=push) for c in (0.0, 1e-3))
    assert soft.channel("velocity")[-1] == pytest.approx(plain.channel("velocity")[-1], rel=0.02)


def test_a_known_force_from_outside_moves_the_slide_and_is_not_the_drives(any_engine: Engine) -> None:
    still = Commands(np.zeros((1, 1)))
    push = np.full((501, 1), 3.0)
    jobs = [
        Rollout(slide(command="torque", coulomb=c), still, 501, pose=True, external=push * share)
        for c, share in ((0.0, 1.0), (2.0, 1.0), (2.0, 0.5))
    ]
    free, rubbing, held = any_engine.rollout(jobs)
    assert free.channel("velocity")[-1] == pytest.approx(3.0 / MASS_KG, rel=1e-3)
    assert rubbing.channel("velocity")[-1] == pytest.approx(1.0 / MASS_KG, rel=0.02)
    assert np.abs(held.channel("position")).max() < 1e-5
    assert free.torques is not None
    assert not free.torques.any()
    assert len({job.key for job in jobs}) == 3


@pytest.mark.parametrize(
    ("command", "kind", "unit", "span"),
    [
        ("position", "hinge", "rad", (-10.0, 10.0)),
        ("speed", "hinge", "rad/s", (-7.0, 7.0)),
        ("torque", "hinge", "N.m", (-50.0, 50.0)),
        ("torque", "slide", "N", (-50.0, 50.0)),
        ("none", "slide", None, (0.0, 0.0)),
    ],
)
def test_the_unit_and_span_of_a_command_follow_from_the_drive(
    command: str, kind: str, unit: str | None, span: tuple[float, float]
) -> None:
    robot = one_joint(kind, (0.0, 1.0, 0.0)).map_drive(
        "joint", lambda d: replace(d, command=command, torque_limit=50.0, speed_limit=7.0)
    )
    if command == "position":
        robot = robot.with_joint("joint", lower=-5.0, upper=5.0)
        span = (-5.0, 5.0)
    assert command_unit(robot, robot.drives[0]) == unit
    assert unit_at(robot, "joint") == (unit or "")
    assert blueprint.command_unit(robot) == ("" if unit is None else f" ({unit})")
    assert command_span(robot, robot.drives[0]) == span
    planned = Excitation("multisine", 1.0, 0.5).commands(robot)
    assert np.abs(planned).max() <= 0.5 * span[1]


def test_a_controllers_velocity_limit_slows_a_goal_and_cuts_a_speed(any_engine: Engine) -> None:
    stiff = {"kp": 4000.0, "kd": 180.0, "command_speed": 0.5}
    limited, free = slide(**stiff), slide(**(stiff | {"command_speed": np.inf}))
    goal = np.full((1, 1), 0.2)
    (log, untouched), (alone,) = (
        any_engine.rollout([Rollout(r, Commands(goal), 600) for r in some]) for some in ((limited, free), (free,))
    )
    assert np.array_equal(untouched.sensors, alone.sensors), "a neighbour's limit changes no bit"
    speed = log.channel("velocity")
    assert np.median(speed[100:180]) == pytest.approx(0.5, rel=0.01)
    assert untouched.channel("velocity").max() > 1.0
    assert log.channel("position")[-1] == pytest.approx(0.2, rel=1e-3)

    led = run(any_engine, slide(command="speed", kp=40.0, command_speed=0.3), 1500, commands=np.full((1, 1), 2.0))
    assert led.channel("velocity")[-1] == pytest.approx(0.3, rel=2e-3)


def test_a_released_drive_sets_out_anew_from_where_its_joint_is(any_engine: Engine) -> None:
    robot = slide(kp=400.0, kd=40.0, command_speed=0.1)
    goal, on = np.full((300, 1), 1.0), np.ones(300)
    on[:150] = 0.0
    rollout = Rollout(robot, Commands(goal), 300, start=at([0.5], [0.0]), enabled=on)
    (log,) = any_engine.rollout([rollout])
    assert log.channel("position")[149] == pytest.approx(0.5, abs=1e-9)
    assert log.channel("position")[-1] < 0.5 + 0.1 * 150 * STEP_S + 1e-3
