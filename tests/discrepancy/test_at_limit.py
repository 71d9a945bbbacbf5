"""Joints that sit at their torque limits in a simulation are told: what their controllers ask for makes no difference there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from account_samples import account
from test_words_of_compare import compared
from way_samples import evaluator_for, measured, problem, problem_by, samples

from ee_dist.discrepancy.accounts.of_improve import improve_account
from ee_dist.discrepancy.at_limit import NAMED, OFTEN, limit_text, often_at_limit
from ee_dist.discrepancy.compare import MOVING_SHARE
from ee_dist.discrepancy.evidence.left import Leftover
from ee_dist.discrepancy.improve import improve
from ee_dist.discrepancy.meters import AtLimit, motions
from ee_dist.effects.catalogue import apply, term
from ee_dist.engines.contract import Rollout
from ee_dist.evaluation.cache import CachedEvaluator

WEAK = (term("torque_limit", "servo", loss=0.9),)
LOW = AtLimit("knee", 0.78, "N.m", 0.741, True)


def pendulum(*assumed: tuple[str, str], way: str = "free_run"):
    return problem_by(way, measured("pendulum"), replace(samples()["pendulum"].robot, assumed=assumed))


@pytest.mark.parametrize("way", ["open_loop", "free_run"])
def test_a_motor_that_cannot_do_what_is_asked_of_it_is_at_its_limit_by_as_many_rows_as_its_controller_says(
    way: str,
) -> None:
    found = pendulum(way=way)
    assert often_at_limit(found, ()) == []
    (told,) = often_at_limit(found, WEAK)
    weak = apply(found.robot, WEAK)
    assert (told.joint, told.unit, told.assumed) == ("servo", "N.m", False)
    assert told.limit == pytest.approx(weak.drives[0].torque_limit)
    at_limit, not_at_rest = 0, 0
    for trial in measured("pendulum"):
        steps = Rollout(weak, trial.driver, len(trial.log), pose=True)
        (log,) = evaluator_for(weak).engine.rollout([steps])  # type: ignore[attr-defined]
        speed = np.abs(np.gradient(log.joints[:, 0], weak.time_step_s))
        at = np.abs(weak.drives[0].kp * (log.commands - log.joints)[:, 0]) >= told.limit
        at_limit += at.sum()
        not_at_rest += (at | (speed > MOVING_SHARE * speed.max())).sum()
    assert told.share == pytest.approx(at_limit / not_at_rest, abs=0.02) and told.share > OFTEN


def test_a_limit_that_the_model_changes_is_not_the_one_that_was_assumed() -> None:
    assumed = ("servo", "torque_limit")
    weak = replace(apply(pendulum().robot, WEAK), assumed=(assumed,))
    (told,) = often_at_limit(problem_by("free_run", measured("pendulum"), weak), ())
    assert told.assumed
    (told,) = often_at_limit(pendulum(assumed), WEAK)
    assert not told.assumed


def test_rows_at_rest_below_the_limit_do_not_count() -> None:
    """A step response is watched for as long as anybody likes."""
    (told,) = often_at_limit(pendulum(), WEAK)
    longer = []
    for trial in measured("pendulum"):
        log, rest = trial.log, 3 * len(trial.log)

        def held(values: np.ndarray | None, rows: int = rest) -> np.ndarray | None:
            return None if values is None else np.concatenate([values, np.repeat(values[-1:], rows, axis=0)])

        names = ("sensors", "joints", "torques", "supply_v", "base_pose", "external")
        still = {n: held(getattr(log, n)) for n in names}
        commands = np.concatenate([log.commands, np.zeros((rest, 1))])
        times = np.arange(len(log) + rest) * samples()["pendulum"].robot.time_step_s
        log = replace(log, times_s=times, commands=commands, **still)
        longer.append(replace(trial, log=log, driver=replace(trial.driver, values=commands)))
    found = problem_by("free_run", tuple(longer), samples()["pendulum"].robot)
    (watched,) = often_at_limit(found, WEAK)
    assert watched.share == pytest.approx(told.share, rel=0.35), "a fourth of it by all rows"


def test_all_joints_are_asked_and_where_nothing_is_simulated_none() -> None:
    assert often_at_limit(problem("pendulum", "force_balance"), WEAK) == []
    joints = samples()["quadruped"].robot.motor_names
    dead = tuple(term("torque_limit", j, loss=0.95) for j in joints)
    told = often_at_limit(problem("quadruped", "open_loop"), dead)
    assert {a.joint for a in told} <= {*joints} and len(told) > NAMED
    assert [a.share for a in told] == sorted((a.share for a in told), reverse=True)


def test_what_is_said_of_them() -> None:
    (line,) = limit_text([LOW])
    assert line == (
        "knee (0.78 N.m) is at its torque limit in 74 % of the simulated rows in which it does not rest: to ask for more "
        "changes nothing there, and the description only assumes that limit."
    )
    stated = [AtLimit(f"hip_{k}", 3.0, "N", 0.4, False) for k in range(4)]
    (line,) = limit_text([LOW, *stated])
    assert "rest, hip_0 (3 N) in 40 %, hip_1 (3 N) in 40 %, and 2 more joints in more than 25 %: to ask" in line
    assert line.endswith("and the description only assumes the limit of knee.")
    assert limit_text(stated[:1])[0].endswith("changes nothing there.") and limit_text([]) == []


def test_a_limit_that_was_only_assumed_is_told_before_any_number_and_none_where_the_model_agrees() -> None:
    (line,) = limit_text([LOW])
    assert compared(9.0, [], at_limit=[LOW]).warnings == (line,)
    stated = replace(LOW, assumed=False)
    account = compared(9.0, [], at_limit=[stated])
    assert account.warnings == () and account.lines[0] == limit_text([stated])[0]
    assert line not in compared(1.0, [], at_limit=[LOW]).words


@pytest.mark.parametrize("way", ["open_loop", "free_run"])
def test_a_motion_that_was_looked_through_for_limits_is_simulated_no_second_time(way: str) -> None:
    robot = samples()["pendulum"].robot
    evaluator = CachedEvaluator(evaluator_for(robot))
    found = problem_by(way, measured("pendulum"), robot, evaluator)
    often_at_limit(found, WEAK)
    before = evaluator.counts.simulated
    moved = motions(found, WEAK)
    assert evaluator.counts.simulated == before
    for log, alone in zip(moved, found.simulated(WEAK), strict=True):
        assert log is not None and alone is not None and log.sensor_names == alone.sensor_names == robot.sensor_names
        assert np.array_equal(log.sensors, alone.sensors) and np.array_equal(log.joints, alone.joints)


def test_a_search_that_leaves_more_than_noise_tells_of_the_described_robot_unless_what_it_found_does() -> None:
    low, left = replace(LOW, joint="servo"), (Leftover("a", "position", 9.0, 9.0, False),)
    (line,) = limit_text([low], "Without what was found, ")
    assert account([], left=left, at_limit=(low,)).warnings == (line,)
    stated = account([], left=left, at_limit=(replace(low, assumed=False),))
    assert stated.warnings == () and stated.lines[0].startswith("Without what was found, servo (0.78 N.m) is at its")
    assert line not in account([], at_limit=(low,)).words, "with what was found nothing is left: the limit is right"
    limit = term("torque_limit", "servo", loss=-1.0)
    assert not any("of the simulated rows" in w for w in account([], left=left, at_limit=(low,), what=limit).words)


def test_improve_tells_of_its_last_model_what_its_effects_do_not_say() -> None:
    found = pendulum()
    low = replace(found.robot, drives=apply(found.robot, WEAK).drives, assumed=(("servo", "torque_limit"),))
    problem_low = problem_by("free_run", measured("pendulum"), low)
    improved = improve(problem_low, [], (), [])
    improved.at_limit = often_at_limit(problem_low, improved.terms)
    (line,) = limit_text(improved.at_limit)
    account_of = improve_account(problem_low, improved)
    assert account_of.warnings == (line,) and "the description only assumes that limit" in line
    improved.terms = (term("torque_limit", "servo", loss=0.5),)
    assert line not in improve_account(problem_low, improved).words
