"""What the data cannot say of drives that were guessed: gains of joints that are only held, and how large all torques are."""

from __future__ import annotations

from dataclasses import replace

import pytest
from way_samples import measure, problem_by, samples

from ee_dist.discrepancy.search.pool import held_still, no_scale, pool_of
from ee_dist.discrepancy.torque_scale import of_masses
from ee_dist.effects.catalogue import term


def test_held_joints_are_those_whose_commands_never_move() -> None:
    sample = samples()["arm"]
    trials = measure(sample, ())
    problem = problem_by("open_loop", trials, sample.robot)
    assert held_still(problem) == frozenset()
    still = []
    for trial in trials:
        commands = trial.log.commands.copy()
        commands[:, 0] = 0.2
        still.append(replace(trial, log=replace(trial.log, commands=commands)))
    assert held_still(problem_by("open_loop", tuple(still), sample.robot)) == {sample.robot.motor_names[0]}
    # Where another trial moves it, it is not only held.
    assert held_still(problem_by("open_loop", (still[0], *trials[1:]), sample.robot)) == frozenset()


@pytest.mark.parametrize(
    ("assumed", "torques", "none"), [(True, False, True), (False, False, False), (True, True, False)]
)
def test_nothing_but_masses_may_say_how_large_torques_are(assumed: bool, torques: bool, none: bool) -> None:
    robot = samples()["arm"].robot
    marks = tuple((j, f) for j in robot.motor_names for f in ("kp", "rotor_inertia")) if assumed else ()
    extra = (replace(robot.sensors[0], name="torque", kind="torque"),) if torques else ()
    robot = replace(robot, assumed=marks, sensors=(*robot.sensors, *extra))
    looked_for = ("position_gain@all_joints", "coulomb_friction@all_joints", "part_mass@all_parts")
    assert no_scale(robot, looked_for) is none
    assert not no_scale(robot, looked_for[1:]), "gains are believed where they are not looked for"
    trials = measure(replace(samples()["arm"], robot=replace(robot, assumed=())), ())
    there = {c.name for c in pool_of(problem_by("open_loop", trials, robot))}
    assert ("part_mass@all_parts" in there) is not none


def test_a_model_that_says_how_strong_all_motors_are_speaks_of_torques_by_its_masses() -> None:
    robot = samples()["arm"].robot
    robot = replace(robot, sensors=tuple(s for s in robot.sensors if "torque" not in s.kind))
    first, second = (term("position_gain", j, factor=1.2) for j in robot.motor_names)
    friction = term("coulomb_friction", "all_joints", torque_nm=0.1)
    assert of_masses(robot, (first, second, friction))
    assert of_masses(robot, (term("position_gain", "all_joints", factor=1.2),))
    assert not of_masses(robot, (first, friction)), "the other controller says it"
    measured = replace(robot, sensors=(*robot.sensors, replace(robot.sensors[0], name="torque", kind="torque")))
    assert not of_masses(measured, (first, second))
    led = replace(robot, drives=tuple(replace(d, command="torque") for d in robot.drives))
    assert not of_masses(led, (first, second)) and of_masses(led, (term("command_gain", "all_joints", change=0.2),))
