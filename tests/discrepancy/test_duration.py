"""A drive that takes a set time to each new goal is told from one that goes no faster, and a window begins on its way."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from way_samples import Sample, evaluator_for, measure, problem_by, samples

from ee_dist.discrepancy.assumed import assumed_drives, puts_right
from ee_dist.discrepancy.examine import Effort
from ee_dist.discrepancy.explain import Explanation, explain
from ee_dist.discrepancy.lags import with_lags
from ee_dist.discrepancy.past import Past
from ee_dist.discrepancy.problem import error
from ee_dist.discrepancy.search.candidates import candidates
from ee_dist.discrepancy.search.fitted import Model
from ee_dist.discrepancy.search.pool import pool_of
from ee_dist.discrepancy.search.search import Search
from ee_dist.discrepancy.ways.free_run.problem import FreeRun
from ee_dist.effects.catalogue import Hypothesis, apply, term
from ee_dist.trials.log import Array

QUICK = Effort(first=10, second=4, final=3, starts=1)
TAKEN_S, SLOW_S_RAD = 0.5, 0.45
LOOKED_FOR = ("position_gain", "speed_gain", "command_duration")
TIMED: Hypothesis = (term("command_duration", "all_joints", duration_s=TAKEN_S),)
SLOW: Hypothesis = (term("command_speed", "all_joints", slowness_s_rad=SLOW_S_RAD),)


def goals(step_s: float, seconds: float, seed: int) -> Array:
    """(T, 2) goals that change every 0.5 to 1 s, each joint's in moments of its own; rad."""
    rng, rows = np.random.default_rng(seed), round(seconds / step_s)
    out = np.zeros((rows, 2))
    for k in range(2):
        at = 50
        while at < rows:
            out[at:, k] = rng.uniform(-0.8, 0.8)
            at += round(rng.uniform(0.5, 1.0) / step_s)
    return out


@cache
def explained(hidden: Hypothesis) -> Explanation:
    """The arm by its description, which has neither."""
    arm = samples()["arm"].robot
    plan = tuple(goals(arm.time_step_s, 6.0, k) for k in (1, 2))
    problem = problem_by("open_loop", measure(Sample(arm, plan, hidden, ()), hidden), arm)
    return explain(problem, pool_of(problem), effort=QUICK)


def test_a_set_time_to_each_goal_is_named_with_its_value() -> None:
    found = explained(TIMED)
    assert found.best is not None
    assert [t.name for t in found.best.terms] == ["command_duration@all_joints"]
    assert dict(found.best.terms[0].values)["duration_s"] == pytest.approx(TAKEN_S, rel=0.02)


def test_a_limit_of_speed_is_not_named_so() -> None:
    found = explained(SLOW)
    assert found.best is not None
    assert [t.name for t in found.best.terms] == ["command_speed@all_joints"]
    assert dict(found.best.terms[0].values)["slowness_s_rad"] == pytest.approx(SLOW_S_RAD, rel=0.02)


def test_a_goal_goes_on_from_window_to_window() -> None:
    robot = samples()["pendulum"].robot
    timed = (term("command_duration", robot.motor_names[0], duration_s=0.4),)
    steps = goals(robot.time_step_s, 3.0, 3)[:, :1]
    trials = measure(Sample(robot, (steps,), timed, ()), timed)
    problem = FreeRun(trials, robot, evaluator_for(robot), windows_s=0.5)
    right = error(problem.residuals([timed])[0])
    assert right < 1.5 * problem.noise_floor()[0]
    assert error(problem.residuals([()])[0]) > 10 * right


def test_the_past_knows_where_a_goal_is_and_how_long_it_takes() -> None:
    robot = samples()["pendulum"].robot
    model = apply(robot, [term("command_duration", robot.motor_names[0], duration_s=0.4)])
    commands = np.where(np.arange(80) < 20, 0.0, 0.8)[:, None]
    released = np.where(np.arange(80) < 40, 0.0, 1.0)
    joints = np.zeros((80, 1))
    assert Past(commands, None, joints, 0.01, 40).goals(model)[:, 0] == pytest.approx([0.4, 0.0, 0.2, 0.8])
    assert Past(commands, None, joints, 0.01, 70).goals(model)[:, 0] == pytest.approx([0.8, 0.0, 0.0, 0.8])
    assert Past(commands, released, joints, 0.01, 51).goals(model)[0, 0] == pytest.approx(12 * 0.8 / 40)


@pytest.mark.parametrize("takes", [True, False])
def test_guessed_drives_that_take_a_set_time_are_no_soft_ones(takes: bool) -> None:
    """Of gains that were guessed at soft ones come as late; those that are soft are told no time."""
    arm = samples()["arm"].robot
    hidden = TIMED if takes else (term("position_gain", "all_joints", factor=0.4),)
    trials = measure(Sample(arm, (goals(arm.time_step_s, 4.0, 1),), hidden, ()), hidden)
    guess = tuple(replace(d, kp=d.kp / 2, kd=d.kd / 2) for d in arm.drives)
    described = replace(arm, drives=guess, assumed=tuple((d.joint, f) for d in guess for f in ("kp", "kd")))
    problem = problem_by("open_loop", trials, with_lags(described, trials))
    proposal, u = assumed_drives(Search(problem), candidates(problem.robot, only=LOOKED_FOR)) or pytest.fail(
        "nothing was proposed"
    )
    found = {t.effect: dict(t.values) for t in Model(proposal.parts).hypothesis(u)}
    assert ("command_duration" in found) == takes
    assert found["position_gain"]["factor"] == pytest.approx(2.0 if takes else 0.8, rel=0.15)
    if takes:
        assert found["command_duration"]["duration_s"] == pytest.approx(TAKEN_S, rel=0.03)
        assert all(puts_right(problem.robot, c) for c in proposal.parts)
