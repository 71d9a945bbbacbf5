"""What windows take for as good is told apart by runs of the whole record."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from way_samples import evaluator_for, samples

from ee_dist.discrepancy.measured_trial import MeasuredTrial
from ee_dist.discrepancy.problem import Problem, Through
from ee_dist.discrepancy.run_through import AS_GOOD, MANY, STRAYS, that_hold_run_through
from ee_dist.discrepancy.ways.free_run.problem import FreeRun
from ee_dist.discrepancy.ways.free_run.windows import RESTART_S
from ee_dist.effects.catalogue import Hypothesis, apply, term
from ee_dist.engines.contract import Rollout
from ee_dist.engines.drivers import Commands
from ee_dist.engines.mujoco.engine import MuJoCoEngine
from ee_dist.evaluation.serial import SerialEvaluator
from ee_dist.robots.model import Robot
from ee_dist.trials.log import SensorLog


def guessed(robot: Robot) -> Robot:
    joint = robot.drives[0].joint
    return replace(robot, assumed=tuple((joint, field) for field in ("kp", "kd", "torque_limit", "rotor_inertia")))


def slow_goals() -> FreeRun:
    """A pendulum whose goals gather speed slowly, led through a wide sine by controllers that the description guesses at: it
    comes a third of a second late."""
    robot = samples()["pendulum"].robot
    joint = robot.drives[0].joint
    true = apply(robot, [term("command_acceleration", joint, reluctance_s2_rad=0.25)])
    trials = []
    for k, pace in enumerate((0.30, 0.37)):
        t = np.arange(0.0, 8.0, robot.time_step_s)
        sent = Commands((1.2 * np.sin(2 * np.pi * pace * t) * np.minimum(t, 1.0))[:, None])
        (log,) = evaluator_for(true).engine.rollout([Rollout(true, sent, len(t), seed=k, pose=True)])  # type: ignore[attr-defined]
        assert isinstance(log, SensorLog)
        trials.append(MeasuredTrial(f"sine {k}", log, sent))
    engine = SerialEvaluator(MuJoCoEngine(1), 256)
    return FreeRun(tuple(trials), guessed(robot), engine, windows_s=RESTART_S)


def test_a_soft_controller_that_mimics_slow_goals_from_window_to_window_strays() -> None:
    problem = slow_goals()
    joint = problem.robot.drives[0].joint
    slow = (term("command_acceleration", joint, reluctance_s2_rad=0.25),)
    soft = (term("viscous_friction", joint, damping_nm_s_rad=1.0),)
    as_it_is, true, mimic = problem.run_through([(), slow, soft]) or pytest.fail("it goes by windows")
    assert true.size < 0.02 * as_it_is.size
    assert STRAYS * true.size < mimic.size
    assert true.told.endswith(" mrad")


class Windows:
    """Of a way that goes by windows only what is asked: how far off models are that run through, by their number of terms."""

    def __init__(self, off: list[float] | None) -> None:
        self.off = off

    def run_through(self, models: list[Hypothesis]) -> list[Through] | None:
        return None if self.off is None else [Through(v, f"{v:g} mrad") for v, _ in zip(self.off, models, strict=True)]


class Stand:
    """A judged explanation with what is asked of one."""

    def __init__(self, name: str, held: float, numbers: int = 1) -> None:
        self.name, self.held, self.why_not, self.hypothesis = name, np.array([held]), "", ()
        self.proposal = SimpleNamespace(size=numbers)

    @property
    def earned(self) -> bool:
        return not self.why_not


@pytest.mark.parametrize(
    ("off", "held", "lost"),
    [
        ([400.0, 117.0, 20.0], [14.0, 18.0], ["soft"]),
        ([400.0, 20.0 * STRAYS - 1, 20.0], [14.0, 18.0], []),  # a moment longer at rest
        ([400.0, 117.0, 20.0], [14.0, 14.0 * AS_GOOD + 1], []),  # windows speak against it
        ([400.0, 117.0, 20.0], [18.0, 14.0], []),  # it goes behind as it is
        ([40.0, 117.0, 90.0], [14.0, 18.0], ["soft"]),  # the model as it is is nearer
    ],
)
def test_what_strays_goes_behind(
    monkeypatch: pytest.MonkeyPatch, off: list[float], held: list[float], lost: list[str]
) -> None:
    monkeypatch.setattr(
        "ee_dist.discrepancy.run_through.ranked", lambda found: sorted(found, key=lambda j: not j.earned)
    )
    judged = [Stand(name, h, n) for name, h, n in zip(("soft", "late"), held, (MANY, 1), strict=True)]
    found = that_hold_run_through(Windows(off), (), (), judged)  # type: ignore[arg-type]
    assert [j.name for j in found if not j.earned] == lost
    assert all("run through" in j.why_not and "mrad" in j.why_not for j in found if not j.earned)


@pytest.mark.parametrize(("numbers", "earned"), [(1, True), (MANY - 1, True), (MANY, False)])
def test_many_numbers_must_do_as_well_run_through_as_the_model_without_them(
    monkeypatch: pytest.MonkeyPatch, numbers: int, earned: bool
) -> None:
    monkeypatch.setattr("ee_dist.discrepancy.run_through.ranked", list)
    (j,) = that_hold_run_through(Windows([20.0, 27.0]), (), (), [Stand("guesses", 12.0, numbers)])  # type: ignore[arg-type, list-item]
    assert j.earned is earned
    assert earned or "off by 27 mrad, the model without it by 20 mrad" in j.why_not


def test_ways_without_windows_say_nothing_of_it() -> None:
    judged = [Stand("soft", 1.0, MANY), Stand("late", 2.0)]
    assert that_hold_run_through(Windows(None), (), (), judged) == judged  # type: ignore[arg-type]
    assert Problem.run_through(Windows(None), []) is None  # type: ignore[arg-type]
    whole = slow_goals()
    assert FreeRun(whole.measured, whole.robot, evaluator_for(whole.robot)).run_through([()]) is None


@pytest.mark.parametrize(("lag_s", "window"), [(0.0, 0.5), (0.24, 0.5), (0.38, 1.5)])
def test_windows_are_long_beside_what_a_joint_lags_by(lag_s: float, window: float) -> None:
    """Of a joint that comes late a short window shows nothing of what it was told."""
    problem = slow_goals()
    robot = replace(problem.robot, joints=tuple(replace(j, lag_s=lag_s) for j in problem.robot.joints))
    searched = FreeRun(problem.measured, robot, evaluator_for(robot)).searched
    assert isinstance(searched, FreeRun) and searched.windows_s == window
