"""The strength of all motors in the place of a mass, from wherever the values of a model are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from assumed_samples import guessed
from hypothesis import given, settings
from hypothesis import strategies as st
from way_samples import evaluator_for, measured, problem

from ee_dist.discrepancy.examine import Current
from ee_dist.discrepancy.search.candidates import candidate
from ee_dist.discrepancy.search.fitted import Model
from ee_dist.discrepancy.search.pool import pool_of
from ee_dist.discrepancy.torque_scale import STRENGTH, other_scale, torques_compared, without_masses
from ee_dist.discrepancy.ways.open_loop.problem import OpenLoop
from ee_dist.effects.catalogue import apply, find
from ee_dist.engines.contract import Rollout
from ee_dist.engines.drivers import Commands
from ee_dist.engines.mujoco.engine import MuJoCoEngine
from ee_dist.robots.servo_pendulum import servo_pendulum

EFFECTS = ("part_mass", "coulomb_friction", "viscous_friction", "rotor_inertia", "torque_limit", "command_delay")


def model_of_arm() -> Model:
    robot = problem("arm", "open_loop").robot
    return Model(tuple(candidate(robot, e, t) for e in EFFECTS for t in find(e).targets(robot)))


@settings(max_examples=25, deadline=None)
@given(st.lists(st.sampled_from([-1.0, -0.4, 0.0, 0.3, 1.0]), min_size=40, max_size=40))
def test_it_begins_within_the_ranges_of_all_effects(shares: list[float]) -> None:
    """A mass of a tenth of what it is makes all others ten times as heavy, which none may be."""
    of_arm = problem("arm", "open_loop")
    model = model_of_arm()
    u = np.clip(np.array(shares)[: len(model.lower)], model.lower, model.upper)
    for other, start in other_scale(of_arm, Current(model.parts, u), 0, pool_of(of_arm)):
        assert other.parts[-1].effect.name == STRENGTH, "of several motors"
        assert np.all((start >= other.lower) & (start <= other.upper))


def test_masses_far_off_are_there_to_be_scaled() -> None:
    """What the property above is about happens."""
    of_arm, model = problem("arm", "open_loop"), model_of_arm()
    u = np.where(model.lower < 0, -1.0, 0.5)
    found = list(other_scale(of_arm, Current(model.parts, u), 0, pool_of(of_arm)))
    assert len(found) == len(find("part_mass").targets(of_arm.robot)) > 1


def test_torques_that_were_measured_say_how_large_they_are() -> None:
    """Masses that had to stand in for a spring would be nearer to the description if all torques were twice as large."""
    by_forces, model = problem("arm", "force_balance"), model_of_arm()
    u = np.where(model.lower < 0, -1.0, 0.5)
    assert not list(other_scale(by_forces, Current(model.parts, u), 0, pool_of(by_forces)))
    assert torques_compared(by_forces) and not torques_compared(problem("arm", "open_loop"))


def test_gains_that_were_guessed_at_say_it_themselves() -> None:
    """Half the gain at twice the strength is the same controller, and no mass is known any better."""
    known = problem("arm", "open_loop").robot
    model, trials = model_of_arm(), measured("arm")
    u = np.where(model.lower < 0, -1.0, 0.5)
    for robot, some in ((known, True), (guessed(known), False)):
        of_arm = OpenLoop(trials, robot, evaluator_for(robot))
        assert bool(list(other_scale(of_arm, Current(model.parts, u), 0, pool_of(of_arm)))) == some


@settings(max_examples=10, deadline=None)
@given(st.lists(st.floats(0.05, 0.3), min_size=6, max_size=6), st.sampled_from([0, 1]))
def test_without_a_mass_all_that_goes_with_torques_is_scaled_and_the_motion_is_the_same(
    shares: list[float], strong: int
) -> None:
    """Of one body led by torques: its mass, its rotor, both frictions and what a command stands for."""
    pendulum = servo_pendulum()
    (servo,), arm = pendulum.motor_names, pendulum.parts[1].name
    robot = pendulum.map_drive(servo, lambda d: replace(d, command="torque", kp=0.0, kd=0.0, speed_limit=np.inf))
    names = ("part_mass", "rotor_inertia", ("command_gain", STRENGTH)[strong], "coulomb_friction", "viscous_friction")
    model = Model(tuple(candidate(robot, n, arm if n == "part_mass" else servo) for n in (*names, "command_delay")))
    u = np.array(shares)
    scaled = without_masses(robot, model, u, [0])
    assert scaled is not None and without_masses(robot, model, u, [0, 1]) is None
    left = Model(model.parts[1:])
    engine, told = MuJoCoEngine(1), Commands(0.3 * np.sin(np.arange(200) / 15.0)[:, None])
    with_mass, without = engine.rollout(
        [Rollout(apply(robot, m.hypothesis(v)), told, 200) for m, v in ((model, u), (left, scaled))]
    )
    assert np.ptp(with_mass.sensors) > 0.01
    assert np.allclose(with_mass.sensors, without.sensors, rtol=0, atol=1e-6)
