"""A trial in which nothing moves beside others that move: what the mapping says of units is not doubted by it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import measurement_files as samples
import numpy as np
import pytest
import small_logs as logs

from ee_dist.measurements.errors import MeasurementError
from ee_dist.measurements.importer import import_files
from ee_dist.measurements.mapping_file import mapping_of
from ee_dist.measurements.proposal.files import proposal_for
from ee_dist.measurements.proposal.model import UNKNOWN, Hints
from ee_dist.measurements.report import Report
from ee_dist.robots.describe import load_robot


def imported(folder: Path, sizes: dict[str, float]) -> list[Report]:
    """Trials whose motions are so many times as large, in degrees."""
    robot, _ = load_robot(samples.robot_file(folder, samples.JOINTS))
    m, files = samples.motion(), []
    for name, size in sizes.items():
        files.append(folder / f"{name}.csv")
        table = logs.frame_of(m["t"], *(np.degrees(size * m[k]) for k in ("q", "g")), "{joint}_{what}")
        table.to_csv(files[-1], index=False)
    joints = samples.JOINTS
    sensors: dict[str, Any] = {f"position_{j}": {"column": f"{j}_pos", "unit": "deg"} for j in joints}
    sensors |= {f"velocity_{j}": {"speed_of": f"position_{j}", "cutoff_hz": 20} for j in joints}
    told = {j: {"column": f"{j}_goal", "unit": "deg"} for j in joints}
    raw = {"time": {"column": "time", "unit": "s"}, "sensors": sensors, "commands": told}
    return [report for _, report in import_files(files, mapping_of(raw, Path("map.yaml")), robot)]


def test_it_is_imported_with_the_others_in_whatever_order(tmp_path: Path) -> None:
    assert [r.trial for r in imported(tmp_path, {"a": 0.02, "b": 1.0, "c": 0.02})] == ["a", "b", "c"]


def test_where_no_trial_moves_the_unit_is_doubted_and_the_trial_named(tmp_path: Path) -> None:
    with pytest.raises(MeasurementError, match=r"map\.yaml: trial 'a': position_.* moves by .* if it is in 'deg'"):
        imported(tmp_path, {"a": 0.02, "b": 0.02})
    with pytest.raises(MeasurementError, match=r"map\.yaml: position_"):
        imported(tmp_path, {"a": 0.02})


@pytest.mark.parametrize(("rows_s", "sure"), [(0.55, True), (1.5, False)])
def test_seconds_that_a_name_states_are_seconds_up_to_one_a_row(tmp_path: Path, rows_s: float, sure: bool) -> None:
    m = samples.motion()
    table = logs.frame_of(rows_s * np.arange(len(m["t"])), m["q"], m["g"]).rename(columns={"time": "time_s"})
    robot, _ = load_robot(samples.robot_file(tmp_path, samples.JOINTS))
    proposal = proposal_for([logs.written(tmp_path, table)], robot, Hints())
    (time,) = [c for c in proposal.choices if c.group == "time"]
    assert (time.sure != UNKNOWN) == sure
