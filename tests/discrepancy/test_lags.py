"""How long a delay is worth trying: by how much readings were seen to follow commands."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ee_dist.discrepancy.lags import told_anew_s, with_lags
from ee_dist.discrepancy.measured_trial import MeasuredTrial
from ee_dist.discrepancy.search.candidates import candidate
from ee_dist.effects.scales import longest_delay
from ee_dist.robots.quadruped import quadruped
from ee_dist.robots.servo_pendulum import servo_pendulum
from ee_dist.trials.log import SensorLog

ROBOT = servo_pendulum()
STEP_S = 0.01
LAGS = (("slow", 0.3), ("quick", 0.12), ("at rest", 0.0))
POSITION = next(k for k, s in enumerate(ROBOT.sensors) if s.kind == "position")


def trial(name: str, late_s: float, seed: int, sign: float = 1.0) -> MeasuredTrial:
    """A motion that does not repeat itself, and readings that follow it; nothing else is read."""
    rng = np.random.default_rng(seed)
    times = np.arange(1500) * STEP_S
    swings = [(rng.uniform(0.2, 1.5), rng.uniform(0, 6.0)) for _ in range(6)]

    def at(t: np.ndarray) -> np.ndarray:
        return sum((np.sin(2 * np.pi * f * t + p) for f, p in swings), np.zeros(len(t)))

    sensors = np.zeros((len(times), len(ROBOT.sensors)))
    sensors[:, POSITION] = sign * at(times - late_s) + 1e-3 * rng.standard_normal(len(times))
    units = tuple(s.unit for s in ROBOT.sensors)
    log = SensorLog(times, sensors, at(times)[:, None], ROBOT.sensor_names, units, ROBOT.motor_names)
    return MeasuredTrial(name, log)


def test_a_lag_that_logs_show_sets_the_range_of_delays():
    robot = with_lags(ROBOT, [trial("a", 0.24, 1), trial("b", 0.24, 2)])
    assert robot.joint("servo").lag_s == pytest.approx(0.24, abs=STEP_S)
    assert longest_delay(robot) == pytest.approx(0.3, abs=2 * STEP_S)
    assert candidate(robot, "command_delay", "servo").bounds[0][1] == longest_delay(robot)


def test_the_usual_trial_decides():
    robot = with_lags(ROBOT, [trial("a", 0.05, 1), trial("b", 0.06, 2), trial("c", 0.4, 3)])
    assert robot.joint("servo").lag_s == pytest.approx(0.06, abs=STEP_S)
    assert longest_delay(robot) == longest_delay(ROBOT), "no less is looked for than without"


def test_what_follows_nothing_changes_nothing():
    still = trial("a", 0.1, 1)
    resting = replace(still, log=replace(still.log, commands=np.zeros_like(still.log.commands)))
    unknown = replace(still, log=replace(still.log, commands=np.full_like(still.log.commands, np.nan)))
    other = replace(still, log=replace(still.log, commands=trial("b", 0.0, 9).log.commands))
    for one in (resting, unknown, other):
        assert with_lags(ROBOT, [one]) is ROBOT
    assert with_lags(ROBOT, [trial("a", -0.1, 1)]) is ROBOT, "a command that comes after the motion is no delay"
    torque = replace(ROBOT, drives=tuple(replace(d, command="torque") for d in ROBOT.drives))
    assert with_lags(torque, [trial("a", 0.1, 1)]) is torque


def test_a_motor_that_is_mounted_the_other_way_round_lags_too():
    assert with_lags(ROBOT, [trial("a", 0.2, 1, sign=-1.0)]).joint("servo").lag_s == pytest.approx(0.2, abs=STEP_S)


def test_what_one_joint_lags_more_is_its_own():
    arm = replace(ROBOT, joints=tuple(replace(j, name=n, lag_s=lag) for j in ROBOT.joints[:1] for n, lag in LAGS))
    assert longest_delay(arm) == pytest.approx(1.25 * 0.12)


def test_what_most_joints_wait_for_is_no_sluggishness_of_theirs() -> None:
    """Of an arm that is led over a network one joint seems to be early."""
    arm = quadruped()
    lags = [0.69, *(0.9 for _ in arm.joints[1:])]
    waiting = replace(arm, joints=tuple(replace(j, lag_s=s) for j, s in zip(arm.joints, lags, strict=True)))
    assert longest_delay(waiting) == pytest.approx(1.05 * 0.9)
    quick = replace(arm, joints=tuple(replace(j, lag_s=s / 3) for j, s in zip(arm.joints, lags, strict=True)))
    assert longest_delay(quick) == pytest.approx(1.25 * 0.23)


def test_a_speed_and_a_torque_come_late_too():
    """Of a drive that obeys speeds its speed follows, of one that obeys torques what its motor gives."""
    speed = next(k for k, s in enumerate(ROBOT.sensors) if s.kind == "velocity")
    seen = trial("a", 0.4, 1)
    moved = seen.log.sensors[:, [POSITION]]
    by_speed = ROBOT.map_drive("servo", lambda d: replace(d, command="speed"))
    sensors = np.zeros_like(seen.log.sensors)
    sensors[:, [speed]] = moved
    read = replace(seen, log=replace(seen.log, sensors=sensors))
    assert with_lags(by_speed, [read]).joint("servo").lag_s == pytest.approx(0.4, abs=STEP_S)
    by_torque = ROBOT.map_drive("servo", lambda d: replace(d, command="torque"))
    given = replace(seen, log=replace(seen.log, sensors=np.zeros_like(sensors), torques=moved))
    assert with_lags(by_torque, [given]).joint("servo").lag_s == pytest.approx(0.4, abs=STEP_S)
    # A torque that was only commanded, and written down twice, says nothing; nor one that was not read at all.
    for torques in (seen.log.commands, None):
        twice = replace(seen, log=replace(seen.log, sensors=np.zeros_like(sensors), torques=torques))
        assert with_lags(by_torque, [twice]) is by_torque


def test_how_often_goals_change_is_seen_in_commands():
    streamed = trial("slow", 0.3, 1)
    assert told_anew_s([streamed], [0]) == pytest.approx(STEP_S)
    rows = np.repeat(np.arange(15.0), 100)
    standing = replace(streamed, log=replace(streamed.log, commands=rows[:, None]))
    assert told_anew_s([standing], [0]) == pytest.approx(1.0)
    still = replace(streamed, log=replace(streamed.log, commands=0.0 * rows[:, None]))
    assert told_anew_s([still], [0]) == 0.0
