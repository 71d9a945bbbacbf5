"""Torques may be known of some joints only: a wrist whose currents are empty stands in nobody's way."""

from __future__ import annotations

from pathlib import Path

import measurement_files as samples
import numpy as np
import pandas as pd
import pytest

from ee_dist.measurements.errors import MeasurementError
from ee_dist.measurements.importer import import_file
from ee_dist.measurements.mapping_file import mapping_of
from ee_dist.measurements.report import Report, describe
from ee_dist.recording.records import TrialRecord
from ee_dist.robots.describe import load_robot

JOINTS = samples.JOINTS


def read(folder: Path, torques: tuple[str, ...], empty: str = "", drive: str = "") -> tuple[TrialRecord, Report]:
    """A log of a chain without commands, imported with the torques of some joints; those of ``empty`` were never written."""
    robot, _ = load_robot(samples.robot_file(folder, JOINTS))
    t = np.arange(600) * robot.time_step_s
    frame = {"t": t}
    for k, j in enumerate(JOINTS):
        q = 0.3 * np.sin((3 + k) * t)
        frame |= {
            f"q_{j}": q,
            f"v_{j}": np.gradient(q, t),
            f"tau_{j}": np.cos(t) if j != empty else np.full(600, np.nan),
        }
    pd.DataFrame(frame).to_csv(folder / "log.csv", index=False)
    sensors = {
        s.name: {"column": f"{'q' if s.kind == 'position' else 'v'}_{s.target}", "unit": s.unit} for s in robot.sensors
    }
    columns = {j: {"column": f"tau_{j}", "unit": "N.m", "sure": True, "gaps": "interpolate"} for j in torques}
    mapping = mapping_of(
        {"time": {"column": "t", "unit": "s"}, "sensors": sensors, "torques": columns}, folder / "map.yaml"
    )
    return import_file(folder / "log.csv", mapping, robot)


def test_torques_of_some_joints_are_kept_and_the_others_said_not_to_be_known(tmp_path: Path) -> None:
    record, report = read(tmp_path, JOINTS[1:])
    assert record.log.torques is not None
    assert np.isnan(record.log.torques[:, 0]).all() and np.isfinite(record.log.torques[:, 1:]).all()
    assert np.isnan(record.log.commands).all()
    said = f"torques at {len(JOINTS) - 1} of {len(JOINTS)} joints"
    assert said in describe([report]) and f"those of {JOINTS[0]} are not known" in describe([report])
    assert not [n for n in read(tmp_path, JOINTS)[1].done if "are not known" in n]


def test_an_empty_column_may_be_left_out(tmp_path: Path) -> None:
    with pytest.raises(MeasurementError, match=f"cells are empty: leave out the torque of {JOINTS[0]}, which may stay"):
        read(tmp_path, JOINTS, empty=JOINTS[0])
