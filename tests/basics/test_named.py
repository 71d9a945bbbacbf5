"""A name of a file, or a pattern of several."""

from __future__ import annotations

from pathlib import Path

import pytest

from ee_dist.basics.files import named
from ee_dist.measurements.errors import MeasurementError
from ee_dist.tasks.config import ConfigError
from ee_dist.tasks.import_ import files_of as imported
from ee_dist.tasks.measurements import files_of as recordings


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name in ("sine_2.csv", "sine_1.csv", "other.csv", "a.mcap", "b.mcap"):
        (tmp_path / name).write_text("x")
    return tmp_path


def test_a_pattern_is_all_that_match_by_name(folder: Path) -> None:
    assert [f.name for f in named(folder / "sine_*.csv")] == ["sine_1.csv", "sine_2.csv"]
    assert named(folder / "other.csv") == [folder / "other.csv"]
    assert named(folder / "none_*.csv") == [folder / "none_*.csv"]


def test_a_file_whose_name_looks_like_a_pattern_is_that_file(folder: Path) -> None:
    odd = folder / "sine_*.csv"
    odd.write_text("x")
    assert named(odd) == [odd]


def test_import_and_comparing_take_patterns(folder: Path) -> None:
    assert [f.name for f in imported(str(folder / "sine_*.csv"))[0]] == ["sine_1.csv", "sine_2.csv"]
    assert [f.name for f in recordings(str(folder / "*.mcap"))] == ["a.mcap", "b.mcap"]
    with pytest.raises(MeasurementError, match="the same file twice"):
        imported([str(folder / "sine_*.csv"), str(folder / "sine_1.csv")])
    with pytest.raises(ConfigError, match="no such file"):
        recordings(str(folder / "c*.mcap"))
