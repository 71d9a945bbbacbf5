"""The scene of measurements beside predictions, read back, for robots of other kinds."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rerun.chunk import RrdReader
from viewing_samples import contents_of, rows_of

from ee_dist.engines.contract import Rollout
from ee_dist.engines.drivers import Commands
from ee_dist.engines.pybullet.engine import PyBulletEngine
from ee_dist.robots.linear_stage import linear_stage
from ee_dist.robots.model import Robot
from ee_dist.robots.servo_pendulum import servo_pendulum
from ee_dist.trials.log import SensorLog
from ee_dist.viewing.comparison import Rung, write_comparison_rrd

STEP_S = servo_pendulum().time_step_s
ROWS = 400
LADDER = [Rung("starting model", 0.2, 0.19), Rung("+ coulomb friction at servo", 0.05)]


def pair(robot: Robot, seconds: float, amplitude: float) -> tuple[SensorLog, SensorLog]:
    """A log of the robot with dry friction, and one of the robot as modelled."""
    joint = robot.motor_names[0]
    times = np.arange(ROWS) * robot.time_step_s
    commands = Commands(amplitude * np.sin(2 * np.pi * times / seconds)[:, None])
    sticky = robot.map_drive(joint, lambda d: replace(d, coulomb=0.1 * d.torque_limit))
    engine = PyBulletEngine()
    measured, predicted = engine.rollout([Rollout(m, commands, ROWS) for m in (sticky, robot)])
    engine.close()
    return measured, predicted


@pytest.fixture(scope="module")
def pairs() -> list[tuple[str, SensorLog, SensorLog]]:
    robot = servo_pendulum()
    slow, quick = pair(robot, 0.8, 0.5), pair(robot, 0.4, 0.5)
    # A prediction that is shorter than what was measured.
    return [("slow", *slow), ("quick", quick[0], quick[1].head(ROWS // 2))]


@pytest.fixture(scope="module")
def rrd(pairs: list[tuple[str, SensorLog, SensorLog]], tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("comparison") / "pendulum.rrd"
    write_comparison_rrd(servo_pendulum(), pairs, path, LADDER, title="a test")
    return path


def test_residuals_are_measured_minus_predicted(pairs: list[tuple[str, SensorLog, SensorLog]], rrd: Path) -> None:
    times, values = rows_of(rrd, "residuals/position/predicted", "Scalars:scalars")
    flat = np.array([v[0] for v in values])
    (_, m0, p0), (_, m1, p1) = pairs
    assert np.abs(m0.channel("position") - p0.channel("position")).max() > 0.01
    np.testing.assert_array_equal(flat[:ROWS], m0.channel("position") - p0.channel("position"))
    half = ROWS // 2
    np.testing.assert_array_equal(flat[ROWS + 1 : -1], m1.channel("position")[:half] - p1.channel("position"))
    start = (ROWS - 1) * STEP_S + 1.0
    np.testing.assert_allclose(times[ROWS + 1 : -1], start + p1.times_s, atol=1e-9)


def test_channels_are_those_of_the_logs(pairs: list[tuple[str, SensorLog, SensorLog]], rrd: Path) -> None:
    for name, column in (("measured", 1), ("predicted", 2)):
        _, values = rows_of(rrd, f"sensors/speed/{name}", "Scalars:scalars")
        expected = np.concatenate([np.append(p[column].channel("speed"), np.nan) for p in pairs])
        np.testing.assert_array_equal([v[0] for v in values], expected)


def test_the_arm_turns_as_its_position_sensor_says(pairs: list[tuple[str, SensorLog, SensorLog]], rrd: Path) -> None:
    times, turns = rows_of(rrd, "world/measured/arm", "Transform3D:quaternion")
    log = pairs[0][1]
    assert log.joints is None, "the engine was not asked for poses: the sensor is all there is"
    own = times < ROWS * STEP_S
    rows = np.round(times[own] / STEP_S).astype(int)
    angle = 2 * np.arcsin([q[0][1] for q, o in zip(turns, own, strict=True) if o])
    np.testing.assert_allclose(angle, log.channel("position")[rows], atol=1e-6)
    assert np.ptp(angle) > 0.02


def test_the_ladder_is_told_and_drawn(rrd: Path) -> None:
    held = rows_of(rrd, "ladder/held_out", "BarChart:values")[1][0][0]
    assert held["buffer"] == [0.2, 0.05]
    fit = rows_of(rrd, "ladder/fit", "BarChart:values")[1][0][0]
    assert fit["buffer"] == [0.19], "a rung without an error of its fit has no such bar"
    text = rows_of(rrd, "texts/result", "TextDocument:text")[1][0][0]
    assert "| 1 | + coulomb friction at servo | 0.05 |  |" in text


def test_the_text_tells_the_error_of_each_channel(pairs: list[tuple[str, SensorLog, SensorLog]], rrd: Path) -> None:
    rest = [m.channel("speed")[: len(p)] - p.channel("speed") for _, m, p in pairs]
    expected = np.sqrt(np.mean(np.square(np.concatenate(rest))))
    text = rows_of(rrd, "texts/result", "TextDocument:text")[1][0][0]
    line = next(line for line in text.splitlines() if line.startswith("| speed |"))
    assert f"| {expected:.4g} | rad/s |" in line


def test_runs_and_comparisons_do_not_share_a_layout(rrd: Path) -> None:
    reader = RrdReader(rrd)
    names = {s.application_id for s in (*reader.recordings(), *reader.blueprints())}
    assert names == {"ee_dist_comparison"}


def test_equal_comparisons_give_equal_recordings(
    pairs: list[tuple[str, SensorLog, SensorLog]], rrd: Path, tmp_path: Path
) -> None:
    again = tmp_path / "again.rrd"
    write_comparison_rrd(servo_pendulum(), pairs, again, LADDER, title="a test")
    assert contents_of(again) == contents_of(rrd)
    assert contents_of(again, blueprint=True) == contents_of(rrd, blueprint=True)


def test_a_slide_gets_a_rail_and_a_carriage_that_moves(tmp_path: Path) -> None:
    robot = linear_stage()
    write_comparison_rrd(robot, [("only", *pair(robot, 0.4, 0.04))], tmp_path / "stage.rrd")
    _, places = rows_of(tmp_path / "stage.rrd", "world/measured/carriage", "Transform3D:translation")
    assert np.ptp([p[0][0] for p in places]) > 0.005
    _, lengths = rows_of(tmp_path / "stage.rrd", "world/measured/frame/rod_0", "Capsules3D:lengths")
    assert lengths[0][0] == pytest.approx(0.35)


def test_nothing_to_compare_still_gives_the_ladder(tmp_path: Path) -> None:
    write_comparison_rrd(servo_pendulum(), [], tmp_path / "empty.rrd", LADDER)
    assert rows_of(tmp_path / "empty.rrd", "ladder/held_out", "BarChart:values")[1][0][0]["buffer"] == [0.2, 0.05]
