"""Files that somebody else wrote: bounded before they take memory, refused in one line."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

from ee_dist.effects.model_file import read_model
from ee_dist.measurements.errors import MeasurementError
from ee_dist.measurements.mapping_file import read_mapping
from ee_dist.measurements.readers import read
from ee_dist.measurements.sampling import grid
from ee_dist.robots.describe import load_robot
from ee_dist.robots.model import RobotError
from ee_dist.robots.quadruped import quadruped
from ee_dist.robots.serial import robot_to_dict
from ee_dist.robots.untrusted import LARGEST, UntrustedError, json_of, yaml_of

LAUGHS = "a: &a [x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"{b}: &{b} [*{a}, *{a}, *{a}, *{a}, *{a}, *{a}, *{a}, *{a}, *{a}]\n"
    for a, b in zip("abcdefgh", "bcdefghi", strict=True)
)
DEEP = "[" * 5000 + "]" * 5000
ENTITIES = """<?xml version="1.0"?><!DOCTYPE r [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;">]><robot name="&b;"/>"""


def one_line(error: BaseException) -> str:
    text = str(error)
    assert "\n" not in text and len(text) < 500
    return text


@pytest.mark.parametrize(("content", "said"), [
    (LAUGHS, "stands for more than"), (DEEP, "nested"), ("a: [", "not YAML"), (b"\xff\xfe\x00", "not a text"),
    ("x" * (LARGEST + 1), "such a file may have 4 MiB"), ("a: &a [*a]", "nested deeper"),
])  # fmt: skip
def test_yaml_is_bounded(tmp_path, content, said):
    path = tmp_path / "file.yaml"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(UntrustedError) as caught:
        yaml_of(path)
    assert said in one_line(caught.value)
    for reader in (read_model, lambda p: load_robot(str(p))):
        with pytest.raises(RobotError, match=r"file\.yaml"):
            reader(path)
    with pytest.raises(MeasurementError, match=r"file\.yaml"):
        read_mapping(path)


def test_json_is_bounded():
    for text in (DEEP, "[1", "nan", "{" * 3, json.dumps([0] * 600_000)):
        with pytest.raises(UntrustedError) as caught:
            json_of(text)
        one_line(caught.value)


def test_devices_pipes_and_folders_are_no_files(tmp_path):
    os.mkfifo(tmp_path / "pipe.yaml")
    (tmp_path / "folder.yaml").mkdir()
    (tmp_path / "zero.yaml").symlink_to("/dev/zero")
    for name in ("pipe.yaml", "folder.yaml", "zero.yaml"):
        with pytest.raises(RobotError) as caught:
            read_model(tmp_path / name)
        assert name in one_line(caught.value)
        with pytest.raises(MeasurementError):
            read(tmp_path / name)


def test_a_urdf_declares_no_entities(tmp_path):
    (tmp_path / "r.urdf").write_text(ENTITIES)
    with pytest.raises(RobotError, match="has a document type"):
        load_robot(str(tmp_path / "r.urdf"))
    (tmp_path / "deep.urdf").write_text("<robot name='r'>" + "<a>" * 100_000 + "</a>" * 100_000 + "</robot>")
    with pytest.raises(RobotError, match="more than 200 elements"):
        load_robot(str(tmp_path / "deep.urdf"))


@pytest.mark.parametrize(("where", "name", "value", "said"), [
    ("parts", "mass_kg", 1e300, "mass_kg: 1e+300; expected 0 to"),
    ("parts", "mass_kg", "nan", "mass_kg: nan"),
    ("parts", "mass_kg", -1.0, "mass_kg: -1"),
    ("drives", "kp", -3.0, "kp: -3; expected 0 to"),
    ("drives", "kd", "nan", "kd: nan"),
    ("drives", "delay_s", 1e9, "delay_s: 1e+09"),
    ("sensors", "noise", -1.0, "noise: -1"),
    ("sensors", "noise", "nan", "noise: nan"),
    ("sensors", "dropout", 2.0, "dropout: 2; expected 0 to 1"),
])  # fmt: skip
def test_what_cannot_be_is_not_taken_in_silence(where, name, value, said):
    data = json.loads(json.dumps(robot_to_dict(quadruped())))
    data["robot"][where][0][name] = value
    with pytest.raises(RobotError) as caught:
        load_robot(data)
    assert said in one_line(caught.value)


@pytest.mark.parametrize("step_s", [0.0, 1e-300, float("nan"), -1.0])
def test_an_absurd_rate_takes_no_memory(step_s):
    import numpy as np

    with pytest.raises(MeasurementError, match="check the unit of the time column"):
        grid(np.array([0.0, 10.0]), step_s)
    with pytest.raises(MeasurementError):
        grid(np.array([0.0, 1e300]), 0.01)


def test_a_table_of_more_than_anybody_measured_is_refused(tmp_path: Path, monkeypatch):
    import pandas as pd

    path = tmp_path / "t.parquet"
    pd.DataFrame({"a": range(100)}).to_parquet(path)
    assert len(read(path)) == 1
    monkeypatch.setattr("ee_dist.measurements.readers.options.MOST_BYTES", 50)
    with pytest.raises(MeasurementError, match="cut it into parts"):
        read(path)
