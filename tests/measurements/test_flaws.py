"""A column with one flaw is named with its row, and does not vanish."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import small_logs as logs
from measurement_files import motion


def frame() -> pd.DataFrame:
    m = motion()
    return logs.frame_of(m["t"], m["q"], m["g"]).astype(object)


@pytest.mark.parametrize(
    ("column", "row", "value", "message"),
    [
        ("time", 70, "x", "row 72, column 'time': 'x' is not a number"),
        ("elbow_pos_rad", 30, "-", "row 32, column 'elbow_pos_rad': '-' is not a number"),
        ("elbow_goal_rad", 30, "-", "row 32, column 'elbow_goal_rad': '-' is not a number"),
    ],
)
def test_the_row_is_asked_about_first(tmp_path: Path, column: str, row: int, value: object, message: str) -> None:
    table = frame()
    table.loc[row, column] = value
    table["rising"] = np.linspace(0, 1, len(table)) ** 2
    _, proposal = logs.proposed(tmp_path, logs.written(tmp_path, table))
    assert message in proposal.questions[0]
    assert "mend it or drop the row" in proposal.questions[0]


def test_a_flaw_in_what_is_not_needed_is_a_note(tmp_path: Path) -> None:
    table = frame()
    table["shoulder_vel_rad_s"], table["elbow_vel_rad_s"] = motion()["w"].T
    table = table.astype(object)
    table.loc[30, "elbow_vel_rad_s"] = "-"
    table["mode_name"] = "auto"
    _, proposal = logs.proposed(tmp_path, logs.written(tmp_path, table))
    assert not proposal.questions
    assert len([n for n in proposal.notes if "'elbow_vel_rad_s': '-' is not a number" in n]) == 1


def test_columns_without_a_number_are_left_out_and_told(tmp_path: Path) -> None:
    table = frame()
    table["shoulder_effort"], table["elbow_effort"], table["stamp"] = np.nan, np.nan, np.nan
    _, proposal = logs.proposed(tmp_path, logs.written(tmp_path, table))
    assert not proposal.questions
    assert proposal.notes == ["left out, for no cell holds a number: shoulder_effort, elbow_effort, stamp"]
    logs.imported(tmp_path, tmp_path / "log.csv")
    # Nor is an empty time a flaw of a log without one.
    _, proposal = logs.proposed(tmp_path, logs.written(tmp_path, table.drop(columns="time")))
    assert proposal.questions == ["no column rises like a time; say task.rate_hz=ROWS_A_SECOND"]


@pytest.mark.parametrize("zone", ["Z", "+02:00", ""])
def test_dates_are_times(tmp_path: Path, zone: str) -> None:
    table, m = frame(), motion()
    table["time"] = [f"2026-03-01T12:00:{s:09.6f}{zone}" for s in m["t"]]
    log, report = logs.imported(tmp_path, logs.written(tmp_path, table))
    assert np.allclose(log.commands, m["g"])
    assert not report.resampled


def test_rows_that_bear_the_time_of_the_row_before(tmp_path: Path) -> None:
    """A logger that stamps a few rows twice: of these the last counts, it is said, and nothing else moves."""
    table, m = frame(), motion()
    again = np.arange(20, len(table) - 1, 40)
    twice = pd.concat([table, table.iloc[again]]).sort_index(kind="stable")
    assert len(again) > 2
    log, report = logs.imported(tmp_path, logs.written(tmp_path, twice))
    assert np.allclose(log.commands, m["g"])
    assert any(f"{len(again)} rows of {len(twice)} bear the time of the row before" in line for line in report.done)


def test_a_clock_that_stands_still_is_no_clock(tmp_path: Path) -> None:
    table = frame()
    table["time"] = np.floor(np.asarray(table["time"], float) / 0.04) * 0.04
    _, proposal = logs.proposed(tmp_path, logs.written(tmp_path, table))
    assert proposal.questions
