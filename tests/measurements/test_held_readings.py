"""Logs that repeat the last reading until the next one comes: only what was read counts."""

from __future__ import annotations

from pathlib import Path

import measurement_files as samples
import numpy as np
import pandas as pd
import pytest
import small_logs as logs
from hypothesis import given, settings
from hypothesis import strategies as st

from ee_dist.measurements.bunched import pace_of
from ee_dist.measurements.errors import MeasurementError
from ee_dist.measurements.held_readings import held_readings, read_in_turn, written_late
from ee_dist.measurements.importer import import_files
from ee_dist.measurements.mapping_file import read_mapping
from ee_dist.measurements.proposal.files import proposal_for
from ee_dist.measurements.proposal.model import Hints
from ee_dist.measurements.proposal.words import OTHER, POSITION, SPEED, read_name
from ee_dist.measurements.proposal.write import as_yaml
from ee_dist.robots.describe import load_robot
from ee_dist.trials.log import Array

STEP_S = 0.001
T = np.arange(4000) * STEP_S


def motion(t: Array, joints: int = 3) -> Array:
    return np.stack([0.5 * np.sin((1.3 + 0.7 * k) * t + k) for k in range(joints)], axis=1)


def read_at(every: int, jitter: int, seed: int = 0) -> Array:
    """Rows at which sensors are read."""
    rng = np.random.default_rng(seed)
    found = [0]
    while found[-1] < len(T):
        found.append(found[-1] + every + int(rng.integers(-jitter, jitter + 1)))
    return np.array(found[:-1])


def holding(values: Array, rows: Array) -> Array:
    return np.asarray(values[rows[np.searchsorted(rows, np.arange(len(values)), side="right") - 1]])


@given(every=st.integers(2, 20), seed=st.integers(0, 10_000), coarse=st.sampled_from([0.0, 1e-5, 1e-4]))
@settings(max_examples=60, deadline=None)
def test_rows_in_which_something_was_read_are_found(every: int, seed: int, coarse: float) -> None:
    rows = read_at(every, every // 3, seed)
    values = holding(motion(T) + np.random.default_rng(seed).normal(0, 1e-3, (len(T), 3)), rows)
    values = np.round(values / coarse) * coarse if coarse else values
    found = held_readings(values)
    assert found is not None
    # Now and then a reading is the same number again, which nobody can see.
    assert len(np.setxor1d(found, rows)) <= 0.02 * len(rows)


def test_a_robot_at_rest_was_read_as_often_as_in_motion() -> None:
    moving = motion(T)
    moving[1000:3000] = moving[1000]
    rows = held_readings(holding(moving, read_at(10, 3)))
    assert rows is not None
    inside = rows[(rows > 1100) & (rows < 2900)]
    assert np.ptp(np.diff(inside)) == 0 and abs(np.diff(inside)[0] - 10) <= 1


@pytest.mark.parametrize("step", [0.01, 0.003, 0.001])
def test_few_steps_of_an_encoder_are_readings_all_the_same(step: float) -> None:
    coarse = np.round(motion(T) / step) * step
    assert held_readings(coarse) is None
    speeds = np.round(np.gradient(coarse, axis=0) / step) * step
    assert held_readings(np.hstack([coarse[:, :1], speeds[:, :1]])) is None


@given(every=st.sampled_from([2, 3, 5, 8, 15]), seed=st.integers(0, 1000))
@settings(max_examples=30, deadline=None)
def test_a_pace_that_is_kept_tells_of_itself_though_columns_change_apart(every: int, seed: int) -> None:
    """A position of few steps beside a speed with noise: they do not change together, and always at multiples of one step."""
    rng = np.random.default_rng(seed)
    rows = np.arange(0, len(T), every)
    position = np.round(motion(T, 1) / 0.02) * 0.02
    values = holding(np.hstack([position, rng.normal(0, 1, (len(T), 1))]), rows)
    found = held_readings(values)
    assert found is not None and len(np.setxor1d(found, rows)) <= 0.02 * len(rows)


def test_a_constant_speed_over_the_steps_of_an_encoder_is_no_pace() -> None:
    ramp = np.round(np.linspace(0, 40, len(T)))[:, None]
    assert held_readings(ramp) is None


def test_the_pace_of_one_trial_goes_for_another_in_which_little_moves(tmp_path: Path) -> None:
    described = samples.robot_file(tmp_path)
    described.write_text(described.read_text().replace("time_step_s: 0.01", "time_step_s: 0.001"))
    robot, _ = load_robot(described)
    rows = np.arange(0, len(T), 10)
    lively = holding(motion(T, 2), rows)
    # A joint that creeps, over steps of its encoder, says nothing of when it was read.
    creeping = holding(np.round(np.stack([0.02 * T, 0.015 * T], axis=1) / 0.001) * 0.001, rows)
    assert held_readings(creeping) is None and held_readings(lively) is not None
    files = []
    for name, values in (("moves", lively), ("creeps", creeping)):
        (tmp_path / name).mkdir()
        files.append(logs.written(tmp_path / name, logs.frame_of(T, values, motion(T + 0.04, 2))))
    (tmp_path / "mapping.yaml").write_text(as_yaml(proposal_for(files, robot, Hints()), str(described), "both"))
    found = import_files(files, read_mapping(tmp_path / "mapping.yaml"), robot)
    for _, report in found:
        assert any("read every 10 ms" in n for n in report.done), report.done
    # Alone it is taken as it stands.
    ((_, alone),) = import_files(files[1:], read_mapping(tmp_path / "mapping.yaml"), robot)
    assert not any("read every" in n for n in alone.done)


def test_a_torque_that_is_written_a_row_later_is_of_the_same_reading() -> None:
    rows = np.arange(0, len(T), 15)
    slow, late = holding(motion(T, 1), rows)[:, 0], holding(motion(T, 1), rows)
    late = np.roll(late[:, 0], 2)
    assert written_late(slow, rows, T) == 0 and written_late(late, rows, T) == 2
    assert written_late(motion(T, 1)[:, 0], rows, T) is None, "what changes in every row is told, and not read"
    assert written_late(np.zeros(len(T)), rows, T) is None


def in_turn(paces: tuple[int, ...], seed: int = 0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times (T,) of a log with a row whenever one of several sensors is read, each at its own pace (ms) and a little late now and
    then; what it holds of all of them then (T, S), and what they would read (T, S)."""
    rng = np.random.default_rng(seed)
    stamps = [
        np.arange(1 + 3 * k, 12_000, p) + rng.integers(0, 2, len(range(1 + 3 * k, 12_000, p)))
        for k, p in enumerate(paces)
    ]
    at = np.unique(np.concatenate(stamps))
    times_s, true = at * 1e-3, motion(at * 1e-3, len(paces))
    columns = [
        true[np.searchsorted(at, own)[np.clip(np.searchsorted(own, at, side="right") - 1, 0, None)], k]
        for k, own in enumerate(stamps)
    ]
    return times_s, np.stack(columns, axis=1), true


def test_sensors_that_are_read_in_turn_are_known_by_their_own_paces() -> None:
    times_s, held, true = in_turn((33, 35, 12))
    assert held_readings(held) is None, "something changes in nearly every row"
    for k, pace in enumerate((33, 35)):
        rows = read_in_turn(held[:, k], times_s)
        assert rows is not None and np.median(np.diff(times_s[rows])) == pytest.approx(1e-3 * pace, rel=0.1)
        between = np.interp(times_s, times_s[rows], held[rows, k])
        assert np.abs(between - true[:, k])[100:-100].max() < 0.2 * np.abs(held - true)[100:-100, k].max()
    assert read_in_turn(true[:, 0], times_s) is None, "what changes in every row is read in every row"
    assert read_in_turn(np.zeros(len(times_s)), times_s) is None
    empty = np.where(np.r_[True, np.diff(held[:, 0]) != 0], held[:, 0], np.nan)
    assert read_in_turn(empty, times_s) is None
    coarse = 0.05 * np.round(true[:, 0] / 0.05)
    assert read_in_turn(coarse, times_s) is None, "the steps of an encoder come when its joint has moved by one"


@pytest.mark.parametrize("seed", range(3))
def test_what_is_held_does_not_say_that_rows_are_even(seed: int) -> None:
    """Between rows that each come with a sensor of their own most columns stand still, however long that was."""
    times_s, held, _ = in_turn((33, 35, 31), seed)
    assert pace_of(times_s, held) is None


def test_readings_in_turn_go_on_between_one_another(tmp_path: Path) -> None:
    described = samples.robot_file(tmp_path)
    described.write_text(described.read_text().replace("time_step_s: 0.01", "time_step_s: 0.002"))
    robot, _ = load_robot(described)
    times_s, held, true = in_turn((33, 35))
    file = logs.written(tmp_path, logs.frame_of(times_s, held, motion(times_s + 0.04, 2)))
    (tmp_path / "mapping.yaml").write_text(as_yaml(proposal_for([file], robot, Hints()), str(described), file.name))
    ((record, report),) = import_files([file], read_mapping(tmp_path / "mapping.yaml"), robot)
    log = record.log
    assert any("were read every 3" in n for n in report.done)
    assert log.filled is not None and abs(len(log.readings) - 12_000 / 33) < 0.1 * 12_000 / 33
    off = (
        log.sensors[log.readings, :2]
        - np.stack([np.interp(log.times_s + times_s[0], times_s, v) for v in true.T], axis=1)[log.readings]
    )
    assert np.abs(off[5:-5]).max() < 0.3 * np.abs(held - true)[100:-100].max()


def test_rest_noise_and_dead_channels_are_no_seldom_readings() -> None:
    still = np.zeros((len(T), 3))
    assert held_readings(still) is None
    mostly = still.copy()
    mostly[500:800] = motion(T)[500:800]
    assert held_readings(mostly) is None
    assert held_readings(motion(T) + np.random.default_rng(0).normal(0, 1e-4, still.shape)) is None


def test_commands_keep_their_rows_where_sensors_repeat_theirs(tmp_path: Path) -> None:
    """A log at 1 kHz of sensors that are read every 10 ms: between two readings a joint does not stand still."""
    described = samples.robot_file(tmp_path)
    described.write_text(described.read_text().replace("time_step_s: 0.01", "time_step_s: 0.001"))
    robot, _ = load_robot(described)
    true, goals = motion(T, 2), motion(T + 0.04, 2)
    rows = read_at(10, 3)
    file = logs.written(tmp_path, logs.frame_of(T, holding(true, rows), goals))
    (tmp_path / "mapping.yaml").write_text(as_yaml(proposal_for([file], robot, Hints()), str(described), file.name))
    ((record, report),) = import_files([file], read_mapping(tmp_path / "mapping.yaml"), robot)
    log = record.log
    (line,) = [n for n in report.done if "repeat readings" in n]
    assert "read every 10 ms" in line and f"{len(T) - len(rows)} of {len(T)} rows" in line
    assert log.filled is not None and np.array_equal(log.readings, rows)
    assert np.allclose(log.commands, goals[: len(log)], atol=1e-6)
    last = rows[-1]
    assert np.abs(log.sensors[:last, :2] - true[:last]).max() < 1e-3
    assert np.abs(holding(true, rows) - true)[:last].max() > 5e-3


@pytest.mark.parametrize(
    ("name", "kind"),
    [("qDot[0]", SPEED), ("q_dot_1", SPEED), ("theta_dot", SPEED), ("qDDot[2]", OTHER), ("q_ddot", OTHER), ("q_dot_dot", OTHER),
     ("q[0]", POSITION)],
)  # fmt: skip
def test_a_position_with_a_dot_is_a_speed(name: str, kind: str) -> None:
    assert read_name(name).kind == kind


@pytest.mark.parametrize("timed", [False, True])
def test_files_that_do_not_say_what_they_hold_are_to_be_put_side_by_side(tmp_path: Path, timed: bool) -> None:
    """Each would be a table with a clock of its own, and none of them has one."""
    robot, _ = load_robot(samples.robot_file(tmp_path))
    names = {"first": motion(T, 2), "second": motion(T + 1.0, 2)} | ({"time": T[:, None]} if timed else {})
    files = [tmp_path / f"{n}.csv" for n in names]
    for file, values in zip(files, names.values(), strict=True):
        pd.DataFrame(values, columns=[f"{file.stem}{k}" for k in range(values.shape[1])]).to_csv(file, index=False)
    with pytest.raises(MeasurementError, match="put their columns side by side into one file") as found:
        proposal_for(files, robot, Hints())
    assert ("only time.csv says when" if timed else "none says when") in str(found.value)
    assert "4000 rows each" in str(found.value)
