"""Columns of one log whose scales differ, encoders that begin anew, and speeds that were asked for too late."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import small_logs as logs

from ee_dist.measurements.errors import MeasurementError
from ee_dist.measurements.importer import import_file
from ee_dist.measurements.mapping_file import mapping_of
from ee_dist.measurements.speeds_beside import scales_suspicion
from ee_dist.measurements.suspicious import rolled_over
from ee_dist.robots.servo_pendulum import servo_pendulum

T = np.arange(0, 20, 0.02)
SPEEDS = np.stack([3 * np.sin(1.1 * T), 4 * np.sin(0.9 * T + 1), 2 * np.sin(1.3 * T + 2)], axis=1)
TURNED = np.cumsum(SPEEDS, axis=0) * 0.02
JOINTS = ("a", "b", "c")


def test_scales_that_differ_from_joint_to_joint_are_told_with_the_joints() -> None:
    said = scales_suspicion(JOINTS, SPEEDS * [1.0, 0.5, 0.6], TURNED, 0.02)
    assert said is not None and said.startswith(
        "speeds are, of the change of the positions, 0.5 times at b; 0.6 times at c; as much at a"
    )
    assert scales_suspicion(JOINTS, SPEEDS, TURNED, 0.02) is None
    noise = np.random.default_rng(0).standard_normal(SPEEDS.shape)
    assert scales_suspicion(JOINTS, SPEEDS + 0.5 * noise, TURNED + 0.01 * noise[::-1], 0.02) is None, (
        "noise is no scale"
    )


def wrapped(round_: float) -> np.ndarray:
    """Where an encoder says that a shaft is that turns on and on, to and fro."""
    went = 11.0 * np.cumsum(np.where(T < 12, 1.0, -1.0)) * 0.02
    return (went + round_ / 2) % round_ - round_ / 2


def test_an_encoder_that_begins_anew_is_told_with_its_round() -> None:
    said = rolled_over("position (q)", wrapped(25.0))
    assert said is not None and "set 'rolls_over: 25'" in said and "jumps by 24.78 at 8 rows" in said
    assert rolled_over("q", wrapped(25.0), 1e-4) is None, "a joint that stands, and trembles by a milliradian"
    assert rolled_over("q", wrapped(25.0), 0.01) == said.replace("position (q)", "q")
    assert rolled_over("q", 12.0 * np.sign(np.sin(T))) is None, "a square wave"
    assert rolled_over("q", TURNED[:, 0]) is None and rolled_over("q", np.zeros(50)) is None
    once = np.where(T < 10, 0.0, 5.0)
    assert rolled_over("q", once) is None, "nothing moves beside the jump"


def imported(folder: Path, rolls_over: float, torque: float = 0.0) -> tuple[np.ndarray, list[str]]:
    """The position, and what looked suspicious; ``torque``: that of the motor, to and fro, N.m."""
    table = {"t": T, "q": wrapped(25.0), "u": wrapped(25.0), "motor": torque * np.sin(T)}
    pd.DataFrame(table).to_csv(folder / "log.csv", index=False)
    mapping = {
        "robot": {"robot": "servo_pendulum"}, "format": "csv", "time": {"column": "t", "unit": "s"}, "rate_hz": 50,
        "sensors": {"position": {"column": "q", "unit": "mrad", "rolls_over": rolls_over, "sure": True},
                    "speed": {"speed_of": "position", "cutoff_hz": 10}},
        "commands": {"servo": {"column": "u", "unit": "mrad", "sure": True}},
    }  # fmt: skip
    if torque:
        mapping["torques"] = {"servo": {"column": "motor", "unit": "N.m"}}
    record, report = import_file(folder / "log.csv", mapping_of(mapping, folder / "map.yaml"), servo_pendulum())
    return record.log.channel("position"), report.suspicious


def test_a_speed_does_not_begin_anew(tmp_path: Path) -> None:
    table = {"t": T, "q": np.sin(T), "w": wrapped(25.0) / 100, "u": np.sin(T + 0.1)}
    pd.DataFrame(table).to_csv(tmp_path / "log.csv", index=False)
    mapping = {
        "robot": {"robot": "servo_pendulum"}, "format": "csv", "time": {"column": "t", "unit": "s"}, "rate_hz": 50,
        "sensors": {"position": {"column": "q", "unit": "rad"}, "speed": {"column": "w", "unit": "rad/s"}},
        "commands": {"servo": {"column": "u", "unit": "rad"}},
    }  # fmt: skip
    _, report = import_file(tmp_path / "log.csv", mapping_of(mapping, tmp_path / "map.yaml"), servo_pendulum())
    assert not any("rolls_over" in s for s in report.suspicious)


@pytest.mark.parametrize(("times", "said"), [(300.0, True), (2.0, False)])
def test_a_torque_that_no_drive_gives_is_told(tmp_path: Path, times: float, said: bool) -> None:
    most = servo_pendulum().drives[0].torque_limit
    _, suspicious = imported(tmp_path, 25.0, times * most)
    assert any("where its drive gives" in line and "another unit?" in line for line in suspicious) == said


def test_a_round_is_undone_in_the_numbers_of_its_column(tmp_path: Path) -> None:
    went = 11.0 * np.cumsum(np.where(T < 12, 1.0, -1.0)) * 0.02
    assert imported(tmp_path, 25.0)[0] == pytest.approx(1e-3 * went, abs=1e-9)
    assert np.ptp(imported(tmp_path, 0.0)[0]) < 0.0251
    with pytest.raises(MeasurementError, match="rolls_over: expected the numbers of one round, not -25"):
        imported(tmp_path, -25.0)


@pytest.mark.parametrize("late", [0, 12])
def test_speeds_that_were_asked_for_after_they_were_driven_are_asked_about(tmp_path: Path, late: int) -> None:
    t = np.arange(0, 20, 0.02)
    asked = 3 * np.sin(1.1 * t) + 2 * np.sin(2.7 * t)
    driven = np.interp(t - 0.04, t, asked)
    table = {"time_s": t, "servo_position_rad": np.cumsum(driven) * 0.02, "servo_velocity_rad_s": driven}
    table["servo_velocity_cmd_rad_s"] = np.roll(asked, late)
    pd.DataFrame(table).to_csv(tmp_path / "log.csv", index=False)
    _, found = logs.proposed(
        tmp_path,
        tmp_path / "log.csv",
        ("servo",),
        described=lambda text: text.replace("servo: {kp: 20, speed_limit: 8}", "servo: {command: speed, kp: 20}"),
    )
    said = [q for q in found.questions if "as no command should" in q]
    assert bool(said) == bool(late), found.questions
    assert all("it follows the speeds by" in q and "of another clock" in q for q in said)


def test_without_a_mapping_a_round_is_found_and_speeds_beside_it(tmp_path: Path) -> None:
    went = 11.0 * np.cumsum(np.where(T < 12, 1.0, -1.0) + 0.3 * np.sin(2 * T)) * 0.02
    speed = np.gradient(went, T)
    table = {
        "time_s": T,
        "servo_position": (went + 12.5) % 25.0 - 12.5,
        "servo_velocity": speed,
        "servo_goal_rad": went,
    }
    pd.DataFrame(table).to_csv(tmp_path / "log.csv", index=False)
    _, found = logs.proposed(
        tmp_path, tmp_path / "log.csv", ("servo",), change=lambda text: text.replace("revolute", "continuous")
    )
    entries = {c.name: c for c in found.choices if c.group == "sensors"}
    assert (
        entries["position_servo"].entry["rolls_over"] == 25.0
        and "begins anew after 25" in entries["position_servo"].why
    )
    assert entries["velocity_servo"].entry["column"] == "servo_velocity"
