"""Trials in which some joints were not recorded: the mapping says where these stood, and the report that nobody read it."""

from __future__ import annotations

import re
from pathlib import Path

import measurement_files as samples
import numpy as np
import pandas as pd
import pytest

from ee_dist.measurements.errors import MeasurementError
from ee_dist.measurements.importer import import_files
from ee_dist.measurements.mapping_file import mapping_of, read_mapping
from ee_dist.measurements.report import Report
from ee_dist.robots.describe import load_robot
from ee_dist.trials.log import SensorLog

LEG = ("L_Hip_Joint", "L_Thigh_Joint", "L_Calf_Joint")


def motion(k: int) -> pd.DataFrame:
    t = np.arange(500) / 100 + 0.02
    asked = 0.1 * k + 0.3 * np.sin(2 * t * (1 + 0.2 * k)) ** 2
    return pd.DataFrame({"t_s": t, "cmd_rad": asked, "pos_rad": np.interp(t - 0.04, t, asked)})


def mapped(held: str = "held: 5.0", **columns: str) -> str:
    """A mapping by hand, for tables in which only one joint is; places in degrees."""
    lines = ["time: {column: t_s, unit: s}", "sensors:"]
    for j in LEG:
        lines.append(f"  position_{j}: {{column: {columns.get(j, f'pos_{j}')}, unit: deg, {held}}}")
        lines.append(f"  velocity_{j}: {{speed_of: position_{j}, cutoff_hz: 10}}")
    lines.append("commands:")
    return "\n".join([*lines, *(f"  {j}: {{column: cmd_{j}, unit: deg, {held}}}" for j in LEG)]) + "\n"


def by_hand(folder: Path, text: str) -> list[tuple[SensorLog, Report]]:
    files = []
    for k, joint in enumerate(LEG):
        own = motion(k)
        files.append(folder / f"{'abc'[k]}.csv")
        table = {
            "t_s": own["t_s"],
            f"pos_{joint}": np.degrees(own["pos_rad"]),
            f"cmd_{joint}": np.degrees(own["cmd_rad"]),
        }
        pd.DataFrame(table).to_csv(files[-1], index=False)
    (folder / "map.yaml").write_text(text)
    robot = load_robot(samples.robot_file(folder, LEG))[0]
    return [(r.log, report) for r, report in import_files(files, read_mapping(folder / "map.yaml"), robot)]


def test_a_mapping_says_where_a_joint_stood(tmp_path: Path) -> None:
    first, report = by_hand(tmp_path, mapped())[0]
    assert np.allclose(first.channel(f"position_{LEG[1]}"), np.radians(5)) and np.allclose(
        first.commands[:, 2], np.radians(5)
    )
    (told,) = [d for d in report.done if d.startswith("not recorded in this trial")]
    assert f"{LEG[1]} at 5 deg" in told and LEG[0] not in told and "nothing of it is compared there" in told


def test_a_trial_of_which_nothing_was_recorded_is_refused(tmp_path: Path) -> None:
    by_hand(tmp_path, mapped())
    pd.DataFrame({"t_s": motion(0)["t_s"], "note": 1.0}).to_csv(tmp_path / "empty.csv", index=False)
    files = [tmp_path / "a.csv", tmp_path / "b.csv", tmp_path / "c.csv", tmp_path / "empty.csv"]
    said = r"map\.yaml: sensors: none of their columns is in trial 'empty', or all are empty: leave its file out"
    with pytest.raises(MeasurementError, match=said):
        import_files(files, read_mapping(tmp_path / "map.yaml"), load_robot(tmp_path / "chain.yaml")[0])


def test_without_it_or_with_a_wrong_name_the_column_is_missing(tmp_path: Path) -> None:
    with pytest.raises(MeasurementError, match=f"no column 'pos_{LEG[1]}'"):
        by_hand(tmp_path, mapped("sign: 1"))
    with pytest.raises(MeasurementError, match=f"position_{LEG[0]}: column 'pos_hip' is in no trial"):
        by_hand(tmp_path, mapped(**{LEG[0]: "pos_hip"}))


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ({"one_joint_each": {"a": ""}}, "expected the name of a file"),
        (
            {"one_joint_each": {"a": "a.csv"}, "side_by_side": {"q": "q.csv", "tau": "tau.csv"}},
            "leave one of the two out",
        ),
        ({"sensors": {"a": {"column": "a", "held": "here"}}}, "held: cannot be 'here'; expected a number"),
    ],
)
def test_a_wrong_mapping_is_said(more: dict[str, object], said: str) -> None:
    with pytest.raises(MeasurementError, match=re.escape(said)):
        mapping_of({"sensors": {}} | more, Path("mapping.yaml"))


def test_files_that_the_mapping_does_not_name(tmp_path: Path) -> None:
    files = [tmp_path / f"{joint}.csv" for joint in LEG]
    for k, file in enumerate(files):
        motion(k).to_csv(file, index=False)
    (tmp_path / "m.yaml").write_text("one_joint_each: {knee: knee.csv}\n" + mapped())
    with pytest.raises(MeasurementError, match=r"none of the 3 files is named like knee\.csv"):
        import_files(files, read_mapping(tmp_path / "m.yaml"), load_robot(samples.robot_file(tmp_path, LEG))[0])
