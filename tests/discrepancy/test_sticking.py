"""A joint that sticks creeps a little all the same: no balance of forces charges it the friction of one that slides."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
from way_samples import measure, problem, samples, sines

from ee_dist.discrepancy.ways.force_balance.motion import GIVE_RAD, Processing, at_rest, give
from ee_dist.discrepancy.ways.force_balance.problem import ForceBalance
from ee_dist.discrepancy.ways.force_balance.ripple import describe, remains
from ee_dist.effects.catalogue import term
from ee_dist.trials.noise import with_noise

STICKS = (term("coulomb_friction", "elbow", torque_nm=1.0),)


@cache
def creeping(slides_once: bool = False) -> ForceBalance:
    """An arm whose elbow sticks, and creeps by 4 mrad to and fro as its teeth give, which good encoders tell from rest; in one
    more trial, if ``slides_once``, nothing holds it."""
    sample = samples()["arm"]
    sample = replace(sample, robot=with_noise(sample.robot, 3e-6))
    plan = sines(sample.robot, 0.6, 3.0)
    trials = []
    for trial in measure(replace(sample, plan=tuple(c * [1.0, 0.0] for c in plan)), STICKS):
        assert trial.log.joints is not None
        creep = 0.002 * np.sin(3.0 * trial.log.times_s)
        joints = trial.log.joints + np.stack([0.0 * creep, creep], axis=1)
        sensors = trial.log.sensors.copy()
        for c, s in enumerate(sample.robot.sensors):
            if (s.kind, s.target) == ("position", "elbow"):
                sensors[:, c] += creep
        trials.append(replace(trial, log=replace(trial.log, joints=joints, sensors=sensors)))
    if slides_once:
        trials += measure(replace(sample, plan=plan[:1]), ())
    return ForceBalance(trials, sample.robot)


def test_friction_of_a_joint_that_creeps_takes_what_it_must_and_no_more() -> None:
    balance = creeping(slides_once=True)
    assert balance.channels == ("shoulder", "elbow") and not balance.held
    elbow = balance.channel_of == balance.channels.index("elbow")
    sticks = elbow & (balance.trial_of < len(balance.trials) - 1)
    left = balance.raw(balance.residuals([STICKS])[0])
    assert np.sqrt(np.mean(left[sticks] ** 2)) < 0.1, "of a friction of 1 N.m"


def test_a_joint_that_is_held_in_all_trials_is_not_judged_beside_one_that_moves() -> None:
    balance = creeping()
    assert (balance.channels, balance.held, balance.unjudged) == (("shoulder",), ("elbow",), ("elbow",))
    assert balance.notes[0].startswith("elbow hardly moves in any trial: ") and "not judged" in balance.notes[0]
    assert balance.shows("coulomb_friction", "shoulder") and not balance.shows("motor_weak", "elbow")
    # What it carries counts at the joint that moves.
    assert balance.shows("part_mass", balance.robot.parts[-1].name)
    moving = problem("arm", "force_balance")
    assert isinstance(moving, ForceBalance) and moving.held == () and not moving.notes


def test_where_nothing_slides_all_that_is_held_is_judged_and_said_to_tell_little() -> None:
    sample = samples()["arm"]
    fast = tuple(term("coulomb_friction", joint, torque_nm=20.0) for joint in ("shoulder", "elbow"))
    trials = measure(replace(sample, plan=tuple(0.01 * c for c in sines(sample.robot, 0.6, 3.0))), fast)
    balance = ForceBalance(trials, sample.robot)
    assert balance.stuck == balance.channels == ("shoulder", "elbow") and not balance.held
    assert "no more of it can be told" in balance.notes[0]
    said = balance.remarks(fast)
    assert len(said) == 2 and not any("near a reversal" in line for line in said)


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


def test_of_a_drive_that_leaves_nothing_and_passes_no_place_twice_no_number_is_made_up() -> None:
    t = np.linspace(0.0, 1.0, 400)
    once = remains("joint", np.sin(30 * t), t, np.ones_like(t), np.zeros_like(t))
    assert "no two passes are over the same positions" in "".join(describe(once, "N.m", "rad"))
    with np.errstate(all="raise"):
        nothing = remains("joint", 0.0 * t, t, np.ones_like(t), np.zeros_like(t))
    assert "nan" not in "".join(describe(nothing, "N.m", "rad"))
