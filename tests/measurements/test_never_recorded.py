"""What was never recorded is left out, held or marked, and never counts as measured."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import small_logs as logs

from ee_dist.measurements.errors import MeasurementError
from ee_dist.measurements.importer import import_files
from ee_dist.measurements.mapping_file import mapping_of
from ee_dist.measurements.sampling import carried, filled

T = np.arange(1000) / 100
COMMANDS = ["shoulder_goal_rad", "elbow_goal_rad"]


def wave(t: np.ndarray) -> np.ndarray:
    return np.stack([0.5 * np.sin(1.7 * t) + 0.2 * np.sin(4.1 * t), 0.4 * np.cos(2.3 * t)], axis=1)


def test_rows_before_the_first_command_are_left_out(tmp_path: Path) -> None:
    frame = logs.frame_of(T, wave(T - 0.05), wave(T))
    frame.loc[:149, COMMANDS] = np.nan
    log, report = logs.imported(tmp_path, logs.written(tmp_path, frame))
    assert np.allclose(log.commands, wave(T)[150:])
    assert np.allclose(log.sensors[:, :2], wave(T - 0.05)[150:])
    assert any(d.startswith("150 rows left out that are before the first command") for d in report.done)


def commands_at(tmp_path: Path, known: np.ndarray, goals: np.ndarray) -> np.ndarray:
    """What is imported of commands that stand in the ``known`` rows alone, by a mapping."""
    frame = logs.frame_of(T, wave(T - 0.05), goals)
    frame.loc[~known, COMMANDS] = np.nan
    file = logs.written(tmp_path, frame)
    robot, _ = logs.proposed(tmp_path, file)
    data = {
        "time": {"column": "time", "unit": "s"},
        "sensors": {f"position_{j}": {"column": f"{j}_pos_rad", "unit": "rad"} for j in ("shoulder", "elbow")}
        | {f"velocity_{j}": {"speed_of": f"position_{j}", "cutoff_hz": 20} for j in ("shoulder", "elbow")},
        "commands": {
            j: {"column": f"{j}_goal_rad", "unit": "rad", "gaps": "interpolate"} for j in ("shoulder", "elbow")
        },
    }
    ((record, _),) = import_files([file], mapping_of(data, tmp_path / "map.yaml"), robot)
    return record.log.commands


def test_a_command_holds_until_the_next(tmp_path: Path) -> None:
    goals = 0.3 * np.sign(np.sin(2.5 * T[:, None] + np.array([0.1, 1.0])))
    found = commands_at(tmp_path, np.arange(1000) % 10 == 0, goals)
    assert np.array_equal(found, np.repeat(goals[::10], 10, axis=0)), "a step is no ramp that begins before it was sent"


def test_commands_that_begin_when_the_log_ends(tmp_path: Path) -> None:
    with pytest.raises(MeasurementError, match="its first command comes when"):
        commands_at(tmp_path, np.arange(1000) == 999, wave(T))


def test_the_last_value_is_carried_forward() -> None:
    assert carried(np.array([np.nan, 1.0, np.nan, np.nan, 2.0, np.nan])).tolist() == [1, 1, 1, 1, 2, 2]


def test_a_straight_line_over_a_gap_is_not_measured(tmp_path: Path) -> None:
    frame = logs.frame_of(T, wave(T - 0.05), wave(T)).drop(index=range(400, 600))
    log, _ = logs.imported(tmp_path, logs.written(tmp_path, frame))
    assert log.filled is not None
    assert np.flatnonzero(log.filled).tolist() == list(range(400, 600))


def test_without_gaps_every_row_is_measured() -> None:
    at_s = np.arange(500) * 0.01
    assert filled(at_s, at_s + 1e-3 * np.sin(np.arange(500))) is None
    bursts = np.sort(np.concatenate([at_s[::2], at_s[::2] + 1e-4]))
    assert filled(at_s, bursts) is None, "messages that come two at a time are no gap"
