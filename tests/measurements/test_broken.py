"""Broken input: one clear line each, with the place and what would be right."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from ee_dist.measurements.errors import MeasurementError
from ee_dist.measurements.importer import import_file
from ee_dist.measurements.mapping_file import mapping_of, read_mapping
from ee_dist.robots.linear_stage import linear_stage
from ee_dist.robots.servo_pendulum import servo_pendulum

STAGE = linear_stage()
GOOD = {
    "time": {"column": "t", "unit": "s"},
    "sensors": {"position": {"column": "position_m", "unit": "m"}},
    "commands": {"carriage": {"column": "r", "unit": "m"}},
}


def table() -> pd.DataFrame:
    t = np.arange(100) * 0.001
    return pd.DataFrame({"t": t, "position_m": 0.1 * np.sin(20 * t), "r": 0.1 * np.sin(20 * t)}).astype(object)


def put(column: str, row: int, value: object) -> Callable[[pd.DataFrame], pd.DataFrame]:
    def change(frame: pd.DataFrame) -> pd.DataFrame:
        frame.loc[row, column] = value
        return frame

    return change


def cut(rows: int) -> Callable[[pd.DataFrame], pd.DataFrame]:
    return lambda frame: frame.iloc[:rows]


@pytest.mark.parametrize("kind", ["csv", "parquet", "json"])
@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda f: f.rename(columns={"position_m": "position_mm"}), "no column 'position_m'; did you mean position_mm"),
        (put("position_m", 41, "oops"), r"row (42|43), column 'position_m': 'oops' is not a number"),
        (put("position_m", 41, None), r"row (42|43), column 'position_m' is (empty|nan)"),
        (
            lambda f: f.assign(position_m=np.nan),
            r"column 'position_m' is empty from end to end; take it out of the mapping",
        ),
        (put("t", 41, 0.0), r"row (42|43), column 't': time runs backwards \(0.04 s, then 0 s\)"),
        (lambda f: f.assign(t=f["t"].round(1)), r"row (2|3), column 't': time stands still .*, and in \d+ rows more"),
        (cut(0), "no rows in it"),
        (cut(1), "one row only"),
    ],
)
def test_broken_tables(tmp_path: Path, kind: str, change: Callable[[pd.DataFrame], pd.DataFrame], message: str) -> None:
    frame, file = change(table()), tmp_path / f"a.{kind}"
    if kind == "csv":
        frame.to_csv(file, index=False)
    elif kind == "parquet":
        if "oops" in frame.to_numpy().ravel().tolist():
            frame = frame.astype(str)
        else:
            frame = frame.astype(float)
        frame.to_parquet(file)
    else:
        file.write_text(json.dumps({"entries": [dict(r) for _, r in frame.iterrows()]}))
    with pytest.raises(MeasurementError, match=message) as caught:
        import_file(file, mapping_of(GOOD, Path("map.yaml")), STAGE)
    assert "\n" not in str(caught.value)
    assert file.name in str(caught.value)


@pytest.mark.parametrize("name", ["a.csv", "a.parquet", "a.json"])
def test_empty_and_absent_files(tmp_path: Path, name: str) -> None:
    mapping = mapping_of(GOOD, Path("map.yaml"))
    with pytest.raises(MeasurementError, match="no such file"):
        import_file(tmp_path / name, mapping, STAGE)
    (tmp_path / name).write_bytes(b"")
    with pytest.raises(MeasurementError, match="the file is empty"):
        import_file(tmp_path / name, mapping, STAGE)


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.json", b"{", "not JSON"),
        ("a.json", b"[1, 2]", "no list named 'entries'"),
        ("a.json", b'{"rows": []}', "no list named 'entries'"),
        ("a.parquet", b"PAR0not parquet at all", "not a Parquet file"),
        ("a.csv", b"\xff\xfe\x00\x01binary", "not a text file"),
        ("a.xlsx", b"x", "unknown format '.xlsx'; expected .csv, "),
    ],
)
def test_files_of_another_kind(tmp_path: Path, name: str, content: bytes, message: str) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(MeasurementError, match=message):
        import_file(tmp_path / name, mapping_of(GOOD, Path("map.yaml")), STAGE)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"sensors": {"position": {"column": "position_m", "unit": "deg"}}},
            "unit 'deg' is a unit of angle; expected one of length",
        ),
        ({"sensors": {"position": {"column": "position_m", "unit": "metre"}}}, "no unit 'metre'"),
        ({"time": {"column": "t", "unit": "m"}}, "unit 'm' is a unit of length; expected one of time"),
        (
            {"sensors": {"positoin": {"column": "position_m", "unit": "m"}}},
            "linear_stage has no 'positoin'; did you mean position",
        ),
        (
            {"commands": {"carrige": {"column": "r", "unit": "m"}}},
            "commands: linear_stage has no 'carrige'; did you mean carriage",
        ),
        ({"sensors": {"position": {"column": "position_m", "unt": "m"}}}, "unknown key 'unt'; did you mean unit"),
        ({"sensors": {"position": {"unit": "m"}}}, "missing key 'column'"),
        ({"sensors": {"position": {"column": "position_m", "scale": "two"}}}, "scale: cannot be 'two'"),
        ({"sensors": {"position": {"column": "position_m", "sign": 0}}}, "sign: expected 1 or -1"),
        ({"sensor": {}}, "unknown key 'sensor'; did you mean sensors"),
        ({"rate_hz": -1}, "rate_hz: expected a positive number"),
        ({"commands": {}}, "no column for joint 'carriage'"),
        ({"sensors": {}, "commands": {"carriage": "r"}}, "no column for 'position'"),
    ],
)
def test_wrong_mappings(tmp_path: Path, changes: dict[str, object], message: str) -> None:
    table().to_csv(tmp_path / "a.csv", index=False)
    with pytest.raises(MeasurementError, match=message) as caught:
        import_file(tmp_path / "a.csv", mapping_of(GOOD | changes, Path("map.yaml")), STAGE)
    assert "\n" not in str(caught.value)


def test_a_mapping_of_another_robot(tmp_path: Path) -> None:
    other = GOOD | {"sensors": {"angle": {"column": "position_m", "unit": "rad"}}}
    with pytest.raises(MeasurementError, match="is for another robot: none of its names"):
        import_file(tmp_path / "a.csv", mapping_of(other, Path("map.yaml")), servo_pendulum())


def test_mapping_files(tmp_path: Path) -> None:
    with pytest.raises(MeasurementError, match="no such file"):
        read_mapping(tmp_path / "map.yaml")
    (tmp_path / "map.yaml").write_text("time: [")
    with pytest.raises(MeasurementError, match="not YAML"):
        read_mapping(tmp_path / "map.yaml")
    (tmp_path / "map.yaml").write_text("robot: linear_stage")
    with pytest.raises(MeasurementError, match="missing key 'sensors'"):
        read_mapping(tmp_path / "map.yaml")
