"""What a report says about channels that look wrong, and that it keeps quiet about good ones."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import small_logs as logs
from scipy import signal

from ee_dist.measurements.commanded import beyond_the_drive, disobeying, far_from_commands, torques_beside_commands
from ee_dist.measurements.need import held_beyond
from ee_dist.measurements.report import Report, describe
from ee_dist.measurements.signals import Relation
from ee_dist.measurements.speeds_beside import exchanged_suspicions, speed_suspicion
from ee_dist.measurements.suspicious import (
    clock_suspicion,
    command_suspicion,
    repeat_suspicion,
    spike_suspicion,
    suspicions,
    time_suspicion,
    torque_suspicion,
    torques_suspicion,
    unit_suspicion,
    unlike_suspicion,
)
from ee_dist.measurements.taking import power_suspicion, takers, taking, work_taken
from ee_dist.robots.describe import load_robot
from ee_dist.robots.inverse_dynamics import joint_torques
from ee_dist.robots.model import CONTINUOUS_RAD
from ee_dist.robots.servo_pendulum import servo_pendulum
from ee_dist.trials.log import SensorLog

ARM = Path(__file__).parents[2] / "docs" / "examples" / "arm.yaml"
T = np.arange(2000) * 0.01
WAVE = np.sin(2 * T)


def test_good_signals_raise_no_suspicion() -> None:
    rng = np.random.default_rng(0)
    for good in (WAVE, WAVE + 0.01 * rng.standard_normal(len(T)), np.round(WAVE, 2), np.repeat([0.0, 1.0], 1000)):
        assert suspicions("x", good) == []
    assert time_suspicion(0.01, 20, "s") is None
    assert unit_suspicion("x", WAVE, -1.5, 1.5, "rad") is None
    assert speed_suspicion("w", 2 * np.cos(2 * T), WAVE, 0.01) is None
    assert command_suspicion("j", WAVE, np.sin(2 * T - 0.3), 0.01) is None


def test_a_goal_that_is_elsewhere_for_one_row_is_told() -> None:
    odd = WAVE.copy()
    odd[[344, 900]] = 3.1
    said = spike_suspicion("command", odd)
    assert said is not None and "at 2 of 2000 rows (row 344: 3.1 between" in said
    steps = np.sign(np.sin(T)) * (1 + np.arange(len(T)) // 400)
    rng = np.random.default_rng(1)
    for good in (WAVE, steps, rng.standard_normal(2000), np.repeat(rng.standard_normal(40), 50), np.zeros(2000)):
        assert spike_suspicion("command", good) is None


@pytest.mark.parametrize(
    ("values", "word"),
    [
        (np.full(100, 3.0), "stuck at 3"),
        (np.r_[WAVE[:500], np.full(1500, WAVE[499])], "does not change for 1501 rows"),
        (np.clip(WAVE, -0.8, 0.8), "clipped"),
        (np.round(300 * WAVE) % 65536, "signed_bits: 16"),
        (np.round(100 * WAVE) % 256, "signed_bits: 8"),
        ((3 * WAVE + np.pi + T) % (2 * np.pi), "unwrap: true"),
    ],
)
def test_bad_signals_are_named(values: np.ndarray, word: str) -> None:
    assert any(word in s for s in suspicions("x", values))


def test_a_command_that_is_held_at_its_goal_to_the_end_is_a_step_and_a_sensor_stuck(tmp_path: Path) -> None:
    step = np.repeat([0.0, 1.0], [300, 1700])
    assert suspicions("command of j", step, asked=True) == []
    assert suspicions("command of j", np.repeat([0.0, 1.0, 0.0], [300, 1500, 200]), asked=True), "not to the end"
    assert "stuck at 1" in suspicions("command of j", np.ones(2000), asked=True)[0]
    assert "does not change for 1700 rows" in suspicions("position", step)[0]
    follows = signal.lfilter([0.05], [1, -0.95], step) + 1e-3 * WAVE
    stands = np.r_[WAVE[:500], np.full(1500, WAVE[499])]
    frame = logs.frame_of(T, np.stack([follows, stands], axis=1), np.stack([step, WAVE], axis=1))
    _, report = logs.imported(tmp_path, logs.written(tmp_path, frame))
    still = [s.partition(" (")[0] for s in report.suspicious if "does not change" in s]
    assert still and all(s.endswith("elbow") and not s.startswith("command") for s in still), report.suspicious


@pytest.mark.parametrize("way_s", [0.05, 0.5])
def test_goals_that_rest_where_they_go_are_not_clipped(tmp_path: Path, way_s: float) -> None:
    """Goals in steps, or at an even speed, now here and now there, and four times as far as they ever go. The joint stays where
    its reading ends, which is told."""
    to = np.array([0.9, -0.4, 0.9, 0.3, -0.9, 0.9, -0.2, -0.9, 0.9, 0.0])
    goal = np.interp(
        T[:1000], np.c_[np.arange(10), np.arange(10) + way_s + 1e-6].ravel(), np.c_[np.r_[0, to[:-1]], to].ravel()
    )
    follows = signal.lfilter([0.1], [1, -0.9], goal)
    positions = np.stack([follows, np.clip(WAVE[:1000], -0.8, 0.8)], axis=1)
    frame = logs.frame_of(T[:1000], positions, np.stack([goal, WAVE[:1000]], axis=1))
    _, report = logs.imported(tmp_path, logs.written(tmp_path, frame))
    assert [s.split(" (")[0] for s in report.suspicious if "clipped" in s] == ["position_elbow", "position_elbow"]


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("stays", [0.5, 0.497])
def test_a_joint_that_dwells_where_its_command_ends_is_not_clipped(tmp_path: Path, sign: int, stays: float) -> None:
    """Its encoder is coarse, so that all readings there are one, though its command turns slowly; the elbow's are cut off
    while its command goes on."""
    times = [0, 2, 4, 4.5, 5.5, 6, 8, 10, 12, 14]
    goal = sign * np.interp(T[:1400], times, [0, 0.5, stays, -0.2, -0.2, 0.5, stays, 0, 0.5, 0.5])
    follows = np.round(signal.lfilter([0.1], [1, -0.9], goal) / 0.01) * 0.01
    other = np.clip(np.sin(T[:1400]), -0.8, 0.8)
    positions = np.stack([follows, other], axis=1)
    assert any("clipped" in s for s in suspicions("x", follows)), "by itself it may be"
    frame = logs.frame_of(T[:1400], positions, np.stack([goal, np.sin(T[:1400])], axis=1))
    _, report = logs.imported(tmp_path, logs.written(tmp_path, frame))
    assert {s.split(" (")[0] for s in report.suspicious if "clipped" in s} == {"position_elbow"}


def test_units_and_signs() -> None:
    assert "ms" in str(time_suspicion(5.0, 30000, "s"))
    assert time_suspicion(0.55, 5.0, "s") is None, "nobody keeps 5 ms of a motion"
    assert "deg" in str(unit_suspicion("x", 57 * WAVE, -1.5, 1.5, "rad"))
    assert "swapped sign" in str(speed_suspicion("w", -2 * np.cos(2 * T), WAVE, 0.01))
    assert "another unit" in str(speed_suspicion("w", 114 * np.cos(2 * T), WAVE, 0.01))
    assert "swapped sign" in str(command_suspicion("j", -WAVE, WAVE, 0.01))


@pytest.mark.parametrize(
    ("factor", "certain"), [(180 / np.pi, True), (np.pi / 180, True), (1000.0, True), (8.0, False)]
)
def test_commands_in_another_unit_than_the_positions(factor: float, certain: bool) -> None:
    note, stops = command_suspicion("j", factor * WAVE, np.sin(2 * T - 0.3), 0.01) or ("", None)
    assert f"{factor:.3g} times its positions" in note
    assert stops is certain


def test_a_joint_beyond_the_bandwidth_of_its_drive_is_no_swapped_sign_nor_another_unit() -> None:
    """A chirp from 2 to 5 Hz through a drive that answers to 1.5: up to half a period late, and a sixth as far."""
    phase = 2 * np.pi * (2 * T + 3 * T**2 / 40)
    commands = np.sin(phase)
    answer = signal.lti([], [-9.4 + 2j, -9.4 - 2j], 9.4**2 + 4)
    positions = signal.lsim(answer, commands, T)[1]
    assert np.corrcoef(commands, positions)[0, 1] < -0.5 and np.ptp(positions) < 1.0
    assert command_suspicion("j", commands, positions, 0.01) is None
    assert "swapped sign" in str(command_suspicion("j", WAVE, -0.2 * WAVE, 0.01)), "slow, and the other way round"


def test_a_soft_drive_is_in_the_same_unit() -> None:
    assert command_suspicion("j", WAVE, 0.4 * np.sin(2 * T - 0.3), 0.01) is None


@pytest.mark.parametrize(
    ("correlation", "slope", "word", "certain"),
    [
        (0.99, 1000.0, "say unit: mN.m", True),
        (0.99, 0.001, "another unit than N.m", True),
        (0.99, 50.0, "50 times what the motion needs", False),
        (-0.95, -1.1, "sign: -1", False),
        (-0.87, -0.48, "that of the joint's position", False),
    ],
)
def test_torques_that_cannot_be(correlation: float, slope: float, word: str, certain: bool) -> None:
    note, stops = torque_suspicion("torque of j", Relation(correlation, slope), "N.m") or ("", None)
    assert word in note
    assert stops is certain


@pytest.mark.parametrize(("correlation", "slope"), [(0.95, 1.2), (0.95, 4.0), (0.3, 900.0), (-0.9, -6.0), (0.0, 0.0)])
def test_a_model_that_is_off_makes_no_torque_suspicious(correlation: float, slope: float) -> None:
    assert torque_suspicion("torque of j", Relation(correlation, slope), "N.m") is None


def test_torques_of_which_several_run_against_the_motion_are_likely_all_reversed() -> None:
    several = [Relation(r, r) for r in (-0.95, -0.6, -0.9, 0.1)]
    note = torques_suspicion(["a", "b", "c", "d"], several)
    assert note is not None and "those of b too" in note
    assert torques_suspicion(["a", "b", "c", "d"], [*several[:3], Relation(0.9, 1.0)]) is None, "one is as it should be"
    assert torques_suspicion(["a", "b"], [Relation(-0.9, -1.0), Relation(-0.4, -1.0)]) is None, "one is told by itself"


def moving(rows: int = 300) -> np.ndarray:
    t = np.arange(rows) * 0.01
    return np.stack([np.sin(3 * t), np.cos(2 * t), 0.3 * np.sin(5 * t)], axis=1)


def test_rows_that_were_written_before_anything_new_was_read_are_told() -> None:
    readings = moving()
    stale = np.arange(5, 295, 8)
    readings[stale] = readings[stale - 1]
    note = repeat_suspicion(readings)
    assert note is not None and note.startswith("12 % of the rows repeat the row before in all 3 columns")


def test_rest_steps_and_a_slower_rate_are_no_stale_rows() -> None:
    assert repeat_suspicion(moving()) is None
    resting = np.concatenate([moving(), np.repeat(moving()[-1:], 300, axis=0)])
    assert repeat_suspicion(resting) is None
    assert repeat_suspicion(np.repeat(moving(), 2, axis=0)) is None
    assert repeat_suspicion(np.round(moving() / 0.2) * 0.2) is None
    one = moving()
    one[5:295:8, 0] = one[4:294:8, 0]
    assert repeat_suspicion(one) is None, "of the others new readings came"
    assert repeat_suspicion(moving()[:, :1]) is None


def test_a_robot_that_stands_or_creeps_repeats_its_readings() -> None:
    """Between the steps of its encoder nothing changes now and then, and beside what it does at other times it does not move."""
    t = np.arange(600) * 0.01
    way = np.where(t < 2, np.sin(np.pi * t / 2) ** 2, 0) + 1.3e-4 * np.maximum(t - 2, 0) / 0.01
    readings = np.stack([np.round(way / 1e-4) * 1e-4, 0.2 * way], axis=1)
    readings[200:, 1] = np.round(readings[200:, 1] / 2e-5) * 2e-5
    stale = np.arange(205, 595, 5)
    readings[stale] = readings[stale - 1]
    assert repeat_suspicion(readings) is not None
    assert repeat_suspicion(readings, readings[:, :1]) is None
    quick = moving()
    quick[5:295:8] = quick[4:294:8]
    assert repeat_suspicion(quick, quick[:, :1]) is not None


def test_what_rounding_left_of_a_range_is_nothing() -> None:
    report = Report(
        "a.csv", "a", ranges={"q": (-1.4e-16, 1.2, "rad"), "w": (-1e-13, 2e-13, "rad/s"), "z": (0.0, 0.0, "m")}
    )
    lines = describe([report]).splitlines()
    assert lines[2:] == ["  q: 0 to 1.2 rad", "  w: -1e-13 to 2e-13 rad/s", "  z: 0 to 0 m"]


def test_a_joint_without_an_end_reaches_as_far_as_it_likes() -> None:
    t = np.linspace(0, 20, 2000)
    assert unit_suspicion("p", 180 * t, -math.inf, math.inf, "rad", "rad") is None
    assert unit_suspicion("p", 180 * t, -6.3, 6.3, "rad", "rad") is not None


@pytest.mark.parametrize("seed", range(4))
def test_a_drive_that_takes_work_out_of_what_goes_to_and_fro_is_told_without_a_model(seed: int) -> None:
    """Of inertia, weight and friction none can give work to a joint that comes back; a torque of the other sign does."""
    rng, t = np.random.default_rng(seed), np.arange(0, 20, 0.01)
    position = 0.3 + 0.5 * np.sin(1.7 * t) + 0.2 * np.sin(3.1 * t + seed)
    speed = np.gradient(position, t)
    torque = (
        0.2 * np.gradient(speed, t) + 3.0 * np.cos(position) + 1.0 * np.sign(speed) + 0.3 * rng.standard_normal(len(t))
    )
    position = position + 1e-4 * rng.standard_normal(len(t))
    assert work_taken(torque, position, 0.01) is None
    friction = torque - 3.0 * np.cos(position)
    taken = work_taken(-friction, position, 0.01)
    assert taken is not None and taken.taken_j > taken.given_j >= 0
    assert "swapped sign" in power_suspicion("torque of j", taken)
    assert work_taken(-friction[:150], position[:150], 0.01) is None, "it does not come back"


def test_a_joint_that_others_lead_may_hold_back_all_the_way() -> None:
    """An arm without any friction: what its elbow takes out of the motion its shoulder puts in."""
    arm, _ = load_robot(ARM)
    rng, t = np.random.default_rng(27), np.arange(0, 20, 0.01)[:, None]
    size, phase, middle = rng.uniform(0.3, 1.2, 3), rng.uniform(0, 6.28, 3), rng.uniform(-1, 1, 3)
    q, w = middle + size * np.sin(2 * t + phase), 2 * size * np.cos(2 * t + phase)
    torque = joint_torques(arm, q, w, -4 * size * np.sin(2 * t + phase))
    assert work_taken(torque[:, 2], q[:, 2], 0.01) is not None, "by itself it looks as if it gave none"
    assert takers(arm, torque, q, 0.01) == {}
    rubbed = 3.0 * np.abs(torque[:, 2]).max() * np.sign(w[:, 2])
    assert list(takers(arm, torque - rubbed[:, None] * [0, 0, 1], q, 0.01)) == ["elbow"]


def test_a_log_whose_torque_takes_work_is_told_when_it_is_compared() -> None:
    t = np.arange(0, 20, 0.01)
    position = 0.5 * np.sin(1.7 * t) + 0.2 * np.sin(3.1 * t)
    torque = 0.2 * np.gradient(np.gradient(position, t), t) + np.sign(np.gradient(position, t))
    robot = servo_pendulum()

    def log(sign: float, **more: object) -> SensorLog:
        nothing = np.zeros((len(t), len(robot.sensors)))
        names, motors = robot.sensor_names, robot.motor_names
        return SensorLog(t, nothing, position[:, None], names, tuple(s.unit for s in robot.sensors), motors,
                         joints=position[:, None], torques=sign * torque[:, None], **more)  # type: ignore[arg-type]  # fmt: skip

    assert taking(robot, [("a", log(1.0))]) == []
    (line,) = taking(robot, [("a", log(1.0)), ("b", log(-1.0))])
    assert "during b" in line and robot.motor_names[0] in line
    assert taking(robot, [("b", log(-1.0, external=np.zeros((len(t), 1))))]) == [], "what pushes may give work"
    assert taking(replace(robot, free_base=True), [("b", log(-1.0))]) == []


def test_speeds_of_another_joint_are_told() -> None:
    t = np.arange(0, 10, 0.01)
    position = np.stack([np.sin(1.3 * t), 0.8 * np.sin(2.9 * t + 1), 0.5 * np.cos(4.1 * t)], axis=1)
    speed = np.gradient(position, 0.01, axis=0) + 0.01 * np.random.default_rng(0).standard_normal(position.shape)
    names, joints = ["v_a", "v_b", "v_c"], ["a", "b", "c"]
    assert exchanged_suspicions(names, joints, speed, position, 0.01) == []
    lines = exchanged_suspicions(names, joints, speed[:, [1, 0, 2]], position, 0.01)
    assert [line.split(":")[0] for line in lines] == ["v_a", "v_b"]
    assert "position of b, not of a" in lines[0]


def test_torques_that_go_with_the_motion_nowhere_are_told() -> None:
    far, near = Relation(0.2, 1.0), Relation(0.8, 1.0)
    assert unlike_suspicion(["a", "b"], [far, near]) is None
    assert unlike_suspicion(["a"], [far]) is None, "one joint alone may be all friction"
    assert "base" in (unlike_suspicion(["a", "b"], [far, far]) or "")


def test_a_command_that_no_drive_can_give_is_told() -> None:
    robot = servo_pendulum()
    (drive,) = robot.drives
    told = replace(robot, drives=(replace(drive, command="torque"),))
    commands = np.full((50, 1), np.nan)
    assert list(beyond_the_drive(told, commands)) == []
    commands[10:] = 2.0 * drive.torque_limit
    assert list(beyond_the_drive(told, commands)) == []
    commands[20] = -40.0 * drive.torque_limit
    (line,) = beyond_the_drive(told, commands)
    assert "40 times" in line and "volts" in line
    assert list(beyond_the_drive(robot, commands)) == [], "a position is none"


def test_a_joint_that_is_nowhere_near_its_command_is_told() -> None:
    """The command that was logged is not what the joint obeys: it was led by its speed, and its position ran away."""
    robot = servo_pendulum()
    asked, near, away = (v[:, None] for v in (0.4 * WAVE, 0.4 * np.sin(2 * T - 0.3) - 0.2, 0.4 * WAVE + 3.0))
    soft = robot.map_drive("servo", lambda d: replace(d, kp=0.1 * d.torque_limit))
    assert list(far_from_commands(soft, asked, {"servo": away[:, 0]})) == [], "a load may hold it there"
    assert list(far_from_commands(robot, asked, {"servo": near[:, 0]})) == []
    (line,) = far_from_commands(robot, asked, {"servo": away[:, 0]})
    assert "lies 3 rad from it" in line and "led by speeds or torques" in line
    assert list(far_from_commands(robot, asked, {"servo": 0.0 * away[:, 0] + 3.0})) == [], "one at rest says nothing"
    endless = replace(
        robot, joints=tuple(replace(j, lower=-CONTINUOUS_RAD, upper=CONTINUOUS_RAD) for j in robot.joints)
    )
    assert list(far_from_commands(endless, asked, {"servo": away[:, 0]})) == [line], "one that turns without end too"
    told = robot.map_drive("servo", lambda d: replace(d, command="torque"))
    assert list(far_from_commands(told, asked, {"servo": away[:, 0]})) == [], "a torque is no position"
    assert list(far_from_commands(robot, np.full_like(asked, math.nan), {"servo": away[:, 0]})) == []


@pytest.mark.parametrize(
    ("late_s", "sign", "said"),
    [(0.0, 1, None), (0.02, 1, None), (0.4, 1, "follows 400 ms later"), (-0.3, 1, "comes 300 ms before it"),
     (0.0, -1, "runs against it"), (1.2, 1, "follows 1200 ms later")],
)  # fmt: skip
def test_torques_that_come_late_early_or_the_other_way_round_are_told(
    late_s: float, sign: int, said: str | None
) -> None:
    robot = servo_pendulum().map_drive("servo", lambda d: replace(d, command="torque"))
    rng = np.random.default_rng(0)
    # Nothing that repeats itself: there a lag is any of many.
    told = np.cumsum(rng.normal(size=len(T)))
    told -= np.linspace(told[0], told[-1], len(T))
    seen = sign * np.roll(told, round(late_s / 0.01)) + 0.2 * rng.normal(size=len(T))
    lines = list(torques_beside_commands(robot, told[:, None], seen[:, None], 0.01))
    assert (lines == []) if said is None else (len(lines) == 1 and said in lines[0]), lines
    assert list(torques_beside_commands(robot, told[:, None], told[:, None], 0.01)) == [], "the same column twice"
    assert list(torques_beside_commands(servo_pendulum(), told[:, None], -told[:, None], 0.01)) == []


def test_what_a_log_says_of_commands_is_said_again_when_it_is_compared() -> None:
    robot = servo_pendulum().map_drive("servo", lambda d: replace(d, command="torque"))
    rng = np.random.default_rng(1)
    told = np.cumsum(rng.normal(size=(len(T), 1)), axis=0)
    sensors, units = np.zeros((len(T), len(robot.sensors))), tuple(s.unit for s in robot.sensors)
    log = SensorLog(T, sensors, told, robot.sensor_names, units, robot.motor_names, torques=-told)
    right = replace(log, torques=told + 0.1 * rng.normal(size=told.shape))
    (line,) = disobeying(robot, [("a", log), ("b", right), ("c", log)])
    assert line.startswith("During a, c: command of servo: the torque that was measured runs against it")
    assert disobeying(robot, [("b", right)]) == [] and disobeying(robot, [("b", replace(log, torques=None))]) == []


def test_a_drive_that_held_more_than_its_limit_is_told() -> None:
    """A URDF's effort that nobody meant: the joint was led to where the load asks for twice as much, and stayed there."""
    robot = servo_pendulum()
    kinds = [s.kind for s in robot.sensors]
    at = np.where((T % 4) < 2, 1.2, -0.3)[:, None]
    sensors = np.zeros((len(T), len(kinds)))
    sensors[:, kinds.index("position")] = at[:, 0]
    units = tuple(s.unit for s in robot.sensors)
    log = SensorLog(T, sensors, at, robot.sensor_names, units, robot.motor_names, joints=at)
    needs = float(np.abs(joint_torques(robot, at, 0 * at, 0 * at)).max())
    weak = robot.map_drive("servo", lambda d: replace(d, torque_limit=0.5 * needs))
    assert held_beyond([robot], [("a", log)]) == []
    (line,) = held_beyond([weak, robot, weak], [("a", log), ("b", log), ("c", log)])
    assert f"takes {needs:.3g} N.m by the model, during a, c" in line and f"limit is {0.5 * needs:.3g}" in line
    led = weak.map_drive("servo", lambda d: replace(d, command="torque"))
    assert held_beyond([led], [("a", log)]) == [], "who swings a pendulum up holds it nowhere"
    assert held_beyond([weak], [("a", replace(log, joints=None))]) == []


@pytest.mark.parametrize(
    ("other", "told"),
    [(1.97, "1.97 times as long"), (1970.0, "1.97 times"), (0.5e9, "0.5 times"), (1.0, None), (1e3, None), (60, None)],
)
def test_a_clock_that_lasts_otherwise_than_another_in_any_unit_is_told(other: float, told: str | None) -> None:
    said = clock_suspicion("timestamp", 3.154, {"real_time": 3.154 * other})
    assert (said is None) if told is None else (told in said and "'real_time' of the same rows" in said)
