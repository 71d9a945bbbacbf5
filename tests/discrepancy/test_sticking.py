"""A joint that sticks creeps a little all the same: no balance of forces charges it the friction of one that slides."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
from way_samples import measure, problem, samples, sines

from ee_dist.discrepancy.compare import compare
from ee_dist.discrepancy.ways.force_balance.motion import GIVE_RAD, Processing, at_rest, give
from ee_dist.discrepancy.ways.force_balance.problem import ForceBalance
from ee_dist.effects.catalogue import term
from ee_dist.trials.noise import with_noise

STICKS = (term("coulomb_friction", "elbow", torque_nm=1.0),)


@cache
def creeping() -> ForceBalance:
    """An arm whose elbow sticks, and creeps by 4 mrad to and fro as its teeth give, which good encoders tell from rest."""
    sample = samples()["arm"]
    sample = replace(sample, robot=with_noise(sample.robot, 3e-6))
    plan = tuple(c * [1.0, 0.0] for c in sines(sample.robot, 0.6, 3.0))
    trials = []
    for trial in measure(replace(sample, plan=plan), STICKS):
        assert trial.log.joints is not None
        creep = 0.002 * np.sin(3.0 * trial.log.times_s)
        joints = trial.log.joints + np.stack([0.0 * creep, creep], axis=1)
        sensors = trial.log.sensors.copy()
        for c, s in enumerate(sample.robot.sensors):
            if (s.kind, s.target) == ("position", "elbow"):
                sensors[:, c] += creep
        trials.append(replace(trial, log=replace(trial.log, joints=joints, sensors=sensors)))
    return ForceBalance(trials, sample.robot)


def test_friction_of_a_joint_that_creeps_takes_what_it_must_and_no_more() -> None:
    balance = creeping()
    channels = {c.name: c for c in compare(balance, balance.residuals([STICKS])[0]).channels}
    assert channels["elbow"].rmse < 0.1, "of a friction of 1 N.m"


def test_it_is_said_of_a_joint_that_hardly_moves_that_its_friction_cannot_be_told() -> None:
    balance = creeping()
    assert balance.stuck == ("elbow",)
    assert balance.notes[0].startswith("elbow hardly moves in any trial: ")
    said = balance.remarks(STICKS)
    assert said[-1].startswith("elbow: ") and any("near a reversal" in line for line in said)
    moving = problem("arm", "force_balance")
    assert isinstance(moving, ForceBalance) and moving.stuck == () and not moving.notes


def test_what_moves_from_rest_to_rest_slides_if_it_goes_farther_than_teeth_give() -> None:
    robot = samples()["arm"].robot
    limits = give(robot)
    assert limits.tolist() == [GIVE_RAD] * 2
    t = np.arange(0, 3.0, 0.001)
    rise = np.clip((t - 1.0) / 0.5, 0.0, 1.0)
    smooth = rise**2 * (3 - 2 * rise)
    noise = 1e-5 * np.random.default_rng(0).standard_normal((len(t), 2))
    rest = at_rest(smooth[:, None] * [0.5, 2.0] * limits + noise, 0.001, Processing(), limits)
    assert rest[:, 0].all()
    assert not rest[1100:1400, 1].any() and rest[:900, 1].all()


def test_a_joint_of_a_small_range_may_slide_all_of_it() -> None:
    robot = samples()["arm"].robot.with_joint("elbow", lower=-0.02, upper=0.02)
    assert give(robot)[1] < 0.001
