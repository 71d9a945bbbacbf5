"""Steps of a simulation against a robot that lives in continuous time, whose drives hold their commands from row to row."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from ee_dist.discrepancy.as_held import taken_in_steps, times_the_noise
from ee_dist.discrepancy.measured_trial import MeasuredTrial
from ee_dist.discrepancy.problem import error
from ee_dist.discrepancy.steps import between_steps, held
from ee_dist.discrepancy.ways.open_loop.prediction import rollout_of
from ee_dist.engines.contract import Engine, Rollout
from ee_dist.engines.drivers import Commands
from ee_dist.engines.mujoco.engine import MuJoCoEngine
from ee_dist.engines.pybullet.engine import PyBulletEngine
from ee_dist.robots.inertia import steady_inertia
from ee_dist.robots.model import Robot
from ee_dist.robots.servo_pendulum import servo_pendulum
from ee_dist.tasks.config import Config, EngineConfig, EvaluatorConfig
from ee_dist.tasks.measurements import Measurements
from ee_dist.tasks.ways import WAYS
from ee_dist.trials.log import SensorLog

STEP_S, FINER = 0.008, 16
ENGINES = {"mujoco": lambda: MuJoCoEngine(1), "pybullet": PyBulletEngine}
CONFIG = Config(engine=EngineConfig("mujoco", 1), evaluator=EvaluatorConfig("serial"))


def coarse(command: str = "position") -> Robot:
    robot = replace(servo_pendulum(), time_step_s=STEP_S)
    drive = robot.drives[0]
    if command == "speed":
        drive = replace(drive, command="speed", kp=0.3, kd=0.0)
    return replace(robot, drives=(drive,))


def motion(seed: int, robot: Robot, seconds: float = 4.0) -> np.ndarray:
    """(T, 1), moving from the first row on."""
    t, rng = np.arange(round(seconds / STEP_S)) * STEP_S, np.random.default_rng(seed)
    size = 0.3 if robot.drives[0].command == "position" else 1.0
    return sum(size * np.sin(2 * np.pi * f * t) for f in rng.uniform(0.3, 2.0, 3))[:, None]


def in_continuous_time(robot: Robot, commands: np.ndarray, engine: Engine) -> SensorLog:
    """What a robot does that holds each command for a row: simulated in steps much finer than rows."""
    fine = replace(robot, time_step_s=STEP_S / FINER)
    sent = Commands(np.repeat(commands, FINER, axis=0))
    (found,) = engine.rollout([Rollout(fine, sent, len(commands) * FINER, pose=True)])
    rows = slice(None, None, FINER)
    assert found.joints is not None
    return replace(
        found,
        times_s=np.arange(len(commands)) * STEP_S,
        sensors=found.sensors[rows].copy(),
        commands=commands.copy(),
        joints=found.joints[rows].copy(),
        base_pose=None,
        torques=None,
    )


def angles(robot: Robot, log: SensorLog) -> np.ndarray:
    return np.asarray(log.sensors[:, [s.kind for s in robot.sensors].index("position")])


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("command", ["position", "speed"])
def test_steps_follow_what_a_robot_does_in_between(engine: str, command: str) -> None:
    runs, robot = ENGINES[engine](), coarse(command)
    log = in_continuous_time(robot, motion(1, robot), runs)
    left = []
    for is_held in (False, True):
        trial = MeasuredTrial("m", log, Commands(log.commands), commands_held=is_held)
        (found,) = runs.rollout([rollout_of(trial, robot)])
        left.append(np.sqrt(np.mean((angles(robot, found) - angles(robot, log)) ** 2)))
    runs.close()
    assert left[1] < 0.15 * left[0], left


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("times", [1.9, 3.0, 20.0])
def test_a_joint_may_be_damped_far_more_than_a_step_of_explicit_damping_holds(engine: str, times: float) -> None:
    """A servo that follows as a filter does: its damping takes all of the joint's speed in a fraction of a step."""
    runs, robot = ENGINES[engine](), coarse()
    stopped = float(steady_inertia(robot)[0]) / STEP_S
    kd = times * stopped
    drive = replace(robot.drives[0], kp=kd / 0.1, kd=kd, torque_limit=1e4, speed_limit=np.inf)
    robot = replace(robot, drives=(drive,))
    log = in_continuous_time(robot, motion(1, robot), runs)
    trial = MeasuredTrial("m", log, Commands(log.commands), commands_held=True)
    (found,) = runs.rollout([rollout_of(trial, robot)])
    runs.close()
    late = np.sqrt(np.mean((angles(robot, log) - log.commands[:, 0]) ** 2))
    assert np.sqrt(np.mean((angles(robot, found) - angles(robot, log)) ** 2)) < 0.03 * late


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("turned", [1.5, 2.5, 6.0])
def test_a_controller_may_be_far_stiffer_than_a_step_resolves(engine: str, turned: float) -> None:
    """An industrial arm that is where it is told to be: its controller would swing the joint ``turned`` radians in a step."""
    runs, robot = ENGINES[engine](), coarse()
    inertia = float(steady_inertia(robot)[0])
    kp = inertia * (turned / STEP_S) ** 2
    # As much damping as leaves it half of each swing.
    drive = replace(robot.drives[0], kp=kp, kd=np.sqrt(kp * inertia), torque_limit=1e6, speed_limit=np.inf)
    robot = replace(robot, drives=(drive,))
    log = in_continuous_time(robot, motion(1, robot), runs)
    trial = MeasuredTrial("m", log, Commands(log.commands), commands_held=True)
    (found,) = runs.rollout([rollout_of(trial, robot)])
    runs.close()
    assert found.finite
    way = np.sqrt(np.mean(np.diff(log.commands[:, 0]) ** 2))
    assert np.sqrt(np.mean((angles(robot, found) - angles(robot, log)) ** 2)) < way


def test_a_held_command_is_met_in_the_middle_and_a_released_drive_stays_released() -> None:
    nan = np.nan
    found = held(np.array([[1.0], [3.0], [nan], [nan], [5.0], [7.0]]))
    np.testing.assert_array_equal(found[:, 0], [1.0, 2.0, nan, nan, 5.0, 6.0])


def test_what_is_made_up_for_goes_with_the_step() -> None:
    robot = coarse()
    more = [
        between_steps(replace(robot, time_step_s=s)).drives[0].rotor_inertia - robot.drives[0].rotor_inertia
        for s in (0.001, 0.002)
    ]
    assert more[0] > 0 and more[1] == pytest.approx(2 * more[0])


def problem_of(log: SensorLog, robot: Robot, whether: bool | None):
    trials = tuple(MeasuredTrial(n, log, Commands(log.commands), commands_held=whether) for n in ("a",))
    return WAYS["open_loop"].make(Measurements(robot, trials, (), (), None, Path()), CONFIG)


def test_the_log_says_whether_commands_were_held() -> None:
    """A robot holds them; a simulation in the same steps does not, and neither is told that its model is off."""
    engine, robot = MuJoCoEngine(1), coarse()
    commands = motion(2, robot)
    (simulated,) = engine.rollout([Rollout(robot, Commands(commands), len(commands), pose=True)])
    for log, is_held in ((in_continuous_time(robot, commands, engine), True), (simulated, False)):
        problem = problem_of(log, robot, None)
        assert [t.commands_held for t in problem.measured] == [is_held]
        other = problem_of(log, robot, not is_held)
        assert error(problem.residuals([()])[0]) < 0.2 * error(other.residuals([()])[0])


@pytest.mark.parametrize("way", ["open_loop", "free_run"])
def test_every_way_that_simulates_takes_it_so(way: str) -> None:
    engine, robot = MuJoCoEngine(1), coarse()
    log = in_continuous_time(robot, motion(3, robot), engine)
    trials = (MeasuredTrial("a", log, Commands(log.commands), commands_held=None),)
    problem = WAYS[way].make(Measurements(robot, trials, (), (), None, Path()), CONFIG)
    assert problem.measured[0].commands_held
    assert problem.simulated(())[0] is not None


def test_each_curve_has_one_voice_in_how_commands_were_read() -> None:
    """Play at an elbow, the largest error by far, fits commands a little better that come too early; base and shoulder do not."""

    def left(base: float, shoulder: float, elbow: float) -> np.ndarray | None:
        r = np.repeat([base, shoulder, elbow], 50)
        problem = SimpleNamespace(
            residuals=lambda _: r[None], trial_of=np.zeros(150, int), channel_of=np.repeat([0, 1, 2], 50),
            channels=("base", "shoulder", "elbow"), floor=np.ones(150),
        )  # fmt: skip
        return times_the_noise(problem)  # type: ignore[arg-type]

    assert not taken_in_steps(left(8.0, 9.0, 36.0), left(1.5, 2.0, 40.0))
    assert taken_in_steps(left(1.5, 2.0, 40.0), left(8.0, 9.0, 36.0))
    np.testing.assert_array_equal(left(0.5, 0.5, 3.0), left(1.0, 1.0, 3.0))  # at the noise nothing is told
    assert left(np.inf, 1.0, 1.0) is None
    assert taken_in_steps(left(1.5, 2.0, 40.0), None) and not taken_in_steps(None, None)


def test_of_a_model_that_is_far_off_nobody_takes_a_robot_for_a_simulation() -> None:
    """One that lags leaves less of commands that come too early. Where only some curves are far off, the others tell."""
    far = np.full(12, 300.0)
    assert not taken_in_steps(far, 2.0 * far)
    some = np.where(np.arange(12) < 4, 300.0, 1.2)
    assert taken_in_steps(some, 2.0 * some)
    assert not taken_in_steps(far, 1.1 * far), "as much under both"
