"""A robot with a joint that turns and a joint that slides: radians and metres are never added up as they are."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from way_samples import Sample, evaluator_for, measure, sines, two_joint_arm

from ee_dist.discrepancy.compare import compare
from ee_dist.discrepancy.problem import error
from ee_dist.discrepancy.ways.free_run.problem import FreeRun
from ee_dist.discrepancy.words import phrase
from ee_dist.effects.catalogue import CATALOGUE, term
from ee_dist.robots.model import Robot

NOISE = {"shoulder": 4e-3, "elbow": 4e-4}
"""Of the readings, rad and m."""
HIDDEN = (term("coulomb_friction", "shoulder", torque_nm=0.3),)


def turning_and_sliding() -> Robot:
    robot = two_joint_arm()
    robot = robot.with_joint("elbow", kind="slide", lower=-0.2, upper=0.2).with_drive(
        "elbow", kp=400.0, kd=30.0, torque_limit=60.0
    )
    sensors = (
        replace(s, unit="m" if s.target == "elbow" else "rad", noise=NOISE[s.target])
        for s in robot.sensors
        if s.kind == "position"
    )
    return replace(robot, sensors=tuple(sensors))


@cache
def free() -> FreeRun:
    robot = turning_and_sliding()
    commands = sines(robot, 0.6, 2.0)
    plan = tuple(c * [1.0, 0.1] for c in commands)
    trials = measure(Sample(robot, plan, HIDDEN, ("free_run",)), HIDDEN)
    return FreeRun(trials, robot, evaluator_for(robot))


def test_each_unit_is_counted_by_its_own_noise() -> None:
    problem = free()
    means = np.array([NOISE[s.target] for s in problem.robot.sensors]) * np.sqrt(2 / np.pi)
    np.testing.assert_allclose(problem.noise, means, rtol=0.25)
    true = problem.residuals([HIDDEN])[0]
    for channel in range(2):
        # The truth leaves the noise of each, and not a twentieth of it at one and all at the other.
        assert error(true[problem.channel_of == channel]) == pytest.approx(1.0, rel=0.25)


def test_each_is_told_in_its_own_unit() -> None:
    problem = free()
    residual = problem.residuals([()])[0]
    raw = np.abs(problem.raw(residual))
    own = {c.name: c for c in compare(problem, residual).channels}
    assert [own[n].unit for n in problem.channels] == ["rad", "m"]
    said = problem.remarks(())
    turn, slide = (1e3 * raw[problem.channel_of == c].mean() for c in range(2))
    assert said[0] == f"Mean absolute position error: {turn:.3g} mrad and {slide:.3g} mm."
    assert " mrad and " in said[1]
    assert problem.told(error(residual)) == f"{error(residual) ** 2:.3g} times the noise"
    assert " rad, " in problem.error_definition and problem.error_definition.endswith(" m)")


def test_a_joint_at_rest_does_not_decide() -> None:
    """Its encoder reads the same all the time: that is a step it does not leave, and no noise of zero."""
    problem = free()
    still = [replace(t, log=replace(t.log, sensors=t.log.sensors * [1.0, 0.0])) for t in problem.measured]
    resting = FreeRun(still, problem.robot, problem.evaluator)
    assert resting.noise[0] == problem.noise[0]
    assert resting.noise[1] == pytest.approx(0.4 * 2.0**-20)


def test_values_of_two_units_are_no_range() -> None:
    robot = turning_and_sliding()
    slow = [term("command_acceleration", j, reluctance_s2_rad=v) for j, v in (("shoulder", 0.04), ("elbow", 17.0))]
    text = phrase(tuple(slow), robot)
    assert "shoulder" in text and "0.04 s^2/rad" in text and "17 s^2/m" in text and " to " not in text
    alike = [term("coulomb_friction", "shoulder", torque_nm=v) for v in (0.1, 0.2, 0.3)]
    assert "0.1 to 0.3 N.m" in phrase((*alike, slow[1]), robot)
    assert not CATALOGUE["command_acceleration"].shared(robot), "what has two units is not shared"
