"""Which trial would tell explanations apart: what is predicted of it, within limits, and what counts."""

from __future__ import annotations

from dataclasses import replace
from unittest.mock import Mock

import numpy as np
import pytest

from ee_dist.discrepancy import plan
from ee_dist.discrepancy.plan import ENOUGH, Contender, PlannedTrial, next_trials, parting, predicted, ranked
from ee_dist.discrepancy.search.candidates import candidate
from ee_dist.effects.catalogue import term
from ee_dist.engines.mujoco.engine import MuJoCoEngine
from ee_dist.evaluation.cache import CachedEvaluator
from ee_dist.evaluation.serial import SerialEvaluator
from ee_dist.robots.linear_stage import linear_stage
from ee_dist.robots.quadruped_lab import quadruped_lab
from ee_dist.robots.servo_pendulum import servo_pendulum
from ee_dist.tasks.config import ConfigError
from ee_dist.tasks.plan import Options, motions, rated
from ee_dist.trials.excitation import Excitation
from ee_dist.trials.family import PLANNED, Limits, driven, family, fastest
from ee_dist.trials.noise import with_noise

ROBOT = with_noise(servo_pendulum(), 0.001)
HEAVY = (term("part_mass", "arm", change=0.25),)
LAZY = (term("command_gain", "servo", change=-0.03),)
SMALL, LARGE = (Excitation("sway", 1.0, a, 1) for a in (0.03, 0.4))


@pytest.fixture(scope="module")
def evaluator() -> CachedEvaluator:
    return CachedEvaluator(SerialEvaluator(MuJoCoEngine(1)))


def free(effect: str, target: str, value: float, known: float) -> Contender:
    """An effect whose one value is as well known as a measurement of that information says."""
    chosen = candidate(ROBOT, effect, target)
    u = chosen.shares({chosen.effect.main.name: value})
    return Contender((chosen.term(u),), ((chosen.term(u + 0.01),),), (0.01,), np.array([[known]]))


def test_the_motion_that_tells_them_apart_goes_first_whatever_the_order(evaluator) -> None:
    pair = [Contender(HEAVY), Contender(LAZY)]
    small, large = predicted(ROBOT, pair, (SMALL, LARGE), evaluator)
    assert large.separation > ENOUGH and large.separation > 5 * small.separation
    for trials in ((small, large), (large, small)):
        found = ranked(2, trials)
        assert found.best.excitation == LARGE and found.enough and not found.alike
    assert predicted(ROBOT, pair, (LARGE,), SerialEvaluator(MuJoCoEngine(1))) == [large], (
        "to the last bit, whatever is beside it"
    )
    shown = parting(ROBOT, [HEAVY, LAZY], (0, 1), LARGE, evaluator)
    at = (shown.times_s >= shown.from_s) & (shown.times_s <= shown.to_s)
    gap = np.abs(shown.curves[0] - shown.curves[1])
    assert ROBOT.sensors[shown.channel].name in ("position", "speed")
    assert gap[at].mean() > gap[~at].mean()


def test_what_values_may_still_make_up_for_is_no_difference(evaluator) -> None:
    """Two sizes of one effect are one explanation as long as its size is open, and two once it was measured well."""
    sizes = (0.2, 0.25)

    def apart(known: float) -> float:
        pair = [free("part_mass", "arm", change, known) for change in sizes]
        return predicted(ROBOT, pair, (LARGE,), evaluator)[0].separation

    fixed = predicted(ROBOT, [Contender((term("part_mass", "arm", change=c),)) for c in sizes], (LARGE,), evaluator)[0]
    assert fixed.separation > ENOUGH
    assert apart(0.0) < 0.2 * fixed.separation
    assert apart(1e9) == pytest.approx(fixed.separation, rel=0.05)
    # What the model leaves counts like noise, and windows in which nothing differs say nothing.
    pair = [Contender(HEAVY), Contender(LAZY)]
    plain = predicted(ROBOT, pair, (LARGE,), evaluator)[0].separation
    assert predicted(ROBOT, pair, (LARGE,), evaluator, left=4.0)[0].separation == pytest.approx(plain / 2)
    assert predicted(ROBOT, pair, (LARGE,), evaluator, windows=40)[0].separation <= plain


def test_twins_that_no_motion_separates_decide_nothing(evaluator) -> None:
    twins = [Contender(HEAVY), Contender(HEAVY), Contender(LAZY)]
    found = ranked(3, predicted(ROBOT, twins, (SMALL, LARGE), evaluator))
    assert found.alike == ((0, 1),) and found.enough and found.closest in ((0, 2), (1, 2))
    assert found.best.excitation == LARGE and found.best.separation > ENOUGH
    only = ranked(2, predicted(ROBOT, twins[:2], (SMALL, LARGE), evaluator))
    assert only.best.separation == 0.0 and not only.enough and only.alike == ((0, 1),)


def test_a_next_trial_tells_apart_what_any_does_though_others_are_twins_and_shorter_trials_do_not(
    evaluator, monkeypatch
) -> None:
    short, long = Excitation("sway", 1.8, 0.1, 1), Excitation("sway", 9.6, 0.1, 1)
    # Of three explanations the first two are twins; the short trial separates the others less than is enough, and more a second.
    told = [PlannedTrial(short, 0.0, (0.0, 3.6, 3.6)), PlannedTrial(long, 0.0, (0.0, 7.5, 7.5))]
    monkeypatch.setattr(plan, "predicted", Mock(return_value=told))
    found = next_trials(ROBOT, [HEAVY, HEAVY, LAZY], evaluator)
    assert [t.excitation for t in found] == [long, short]
    assert found[0].separation == 7.5 > ENOUGH


@pytest.mark.parametrize("robot", [servo_pendulum(), linear_stage(), quadruped_lab()], ids=lambda r: r.name)
@pytest.mark.parametrize(
    "limits", [Limits(2.0, 0.4), Limits(2.0, 1.0, 0.2), Limits(2.0, 1.0, speed=1.5), Limits(2.0, 0.7, 0.3, 0.9)]
)
def test_no_trial_goes_beyond_what_was_said(robot, limits) -> None:
    found = family(robot, limits, seed=3)
    assert found == family(robot, limits, seed=3) and found != family(robot, limits, seed=4)
    assert {e.kind for e in found} <= set(PLANNED) and len({e.kind for e in found}) >= 4
    assert {e.fixture for e in found} == ({"floor", "stand"} if robot.free_base else {"floor"})
    for e in found:
        sent = e.commands(robot)
        assert len(sent) == round(2.0 / robot.time_step_s)
        middle = np.array([(robot.joint(j).lower + robot.joint(j).upper) / 2 for j in robot.motor_names])
        half = np.array([(robot.joint(j).upper - robot.joint(j).lower) / 2 for j in robot.motor_names])
        assert (np.abs(sent - middle) <= np.minimum(limits.amplitude * half, limits.excursion) + 1e-9).all()
        if e.kind != "rest":
            assert (fastest(robot, e) <= limits.speed * (1 + 1e-9)).all()


def test_commands_change_no_faster_than_the_description_lets_joints_go() -> None:
    stage, rated_m_s = linear_stage(), 0.05
    positions = replace(stage, joints=tuple(replace(j, top_speed=rated_m_s) for j in stage.joints))
    slow = replace(positions, drives=tuple(replace(d, command="torque") for d in positions.drives))
    found = family(positions, Limits(2.0, 0.5), seed=1)
    assert {e.kind for e in found} >= {"fast_sines", "sway"}
    assert all((fastest(positions, e) <= rated_m_s * (1 + 1e-9)).all() for e in found)
    # A speed or a torque may change as quickly as it likes.
    assert any((fastest(slow, e) > rated_m_s).any() for e in family(slow, Limits(2.0, 0.5), seed=1))
    (said,) = rated(positions)
    assert "0.05 m/s" in said and not rated(slow)


def test_a_robot_that_commands_cannot_drive_has_no_plan() -> None:
    robot = servo_pendulum()
    loose = replace(robot, drives=tuple(replace(d, command="none") for d in robot.drives))
    assert driven(robot) and not driven(loose)
    with pytest.raises(ConfigError, match="no drive that obeys commands"):
        motions(loose, Options(), 0)


def test_a_rest_that_is_too_fast_to_come_to_is_no_trial() -> None:
    """A robot that stands elsewhere than in the middle of its range is led there before it rests."""
    stage = linear_stage()
    aside = replace(stage, joints=tuple(replace(j, start=0.8 * j.upper) for j in stage.joints))
    slow = Limits(2.0, 0.3, speed=0.01)
    assert any(e.kind == "rest" for e in family(stage, slow))
    assert not any(e.kind == "rest" for e in family(aside, slow))
    assert any(e.kind == "rest" for e in family(aside, replace(slow, speed=1e3)))
