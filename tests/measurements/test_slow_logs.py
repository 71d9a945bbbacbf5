"""Logs of a few rows a second: their time, and commands that are late or of other joints."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import small_logs as logs

SLOW = np.arange(60) / 5
COMMANDS = ("shoulder_goal_rad", "elbow_goal_rad")


def gait(t: np.ndarray) -> np.ndarray:
    return np.stack([0.4 + 0.1 * np.sin(2.1 * t), -1.0 + 0.25 * np.sin(2.1 * t + 1.0)], axis=1)


def frame(late_s: float = 0.0) -> pd.DataFrame:
    noise = 0.002 * np.random.default_rng(0).standard_normal((len(SLOW), 2))
    return logs.frame_of(SLOW, gait(SLOW - 0.15) + noise, gait(SLOW - late_s))


def time_of(folder: Path, table: pd.DataFrame) -> tuple[str, str, str]:
    """Column, unit and how sure; nothing else may be asked."""
    _, found = logs.proposed(folder, logs.written(folder, table))
    assert not [q for q in found.questions if not q.startswith("time")]
    (choice,) = [c for c in found.choices if c.group == "time"]
    return choice.column, str((choice.entry or {}).get("unit")), choice.sure


def test_a_date_is_in_seconds_however_far_its_rows_are_apart(tmp_path: Path) -> None:
    begin = datetime(2026, 1, 4, 11, 32, 20, 79000, tzinfo=UTC)
    table = frame().assign(time=[(begin + timedelta(seconds=1.004 * s)).isoformat() for s in SLOW])
    assert time_of(tmp_path, table) == ("time", "s", "sure")


@pytest.mark.parametrize("scale", [1.0, 1.004], ids=["5 Hz", "a little slower"])
def test_a_record_lasts_seconds_and_not_milliseconds(tmp_path: Path, scale: float) -> None:
    assert time_of(tmp_path, frame().assign(time=scale * SLOW)) == ("time", "s", "likely")
    stated = frame().drop(columns="time").assign(timestamp=scale * SLOW, timestamp_ms=1000 * scale * SLOW)
    assert time_of(tmp_path, stated) == ("timestamp_ms", "ms", "sure"), "the clock that says its unit"


def test_one_that_may_be_either_is_asked_about(tmp_path: Path) -> None:
    t = 0.3 * np.arange(4000)
    table = logs.frame_of(t, gait(t - 0.15), gait(t))
    column, _, sure = time_of(tmp_path, table)
    assert (column, sure) == ("time", "unknown")


def test_commands_half_a_period_late_have_no_sign_turned(tmp_path: Path) -> None:
    _, found = logs.proposed(tmp_path, logs.written(tmp_path, frame(late_s=np.pi / 2.1)))
    (question,) = found.questions
    assert "the positions of shoulder, elbow run against these" in question and "late or early" in question
    assert "put that right" in question
    _, found = logs.proposed(tmp_path, logs.written(tmp_path, frame()))
    assert not found.questions
    reversed_one = frame().assign(elbow_goal_rad=lambda f: -f["elbow_goal_rad"])
    _, found = logs.proposed(tmp_path, logs.written(tmp_path, reversed_one))
    assert not found.questions and [
        c.entry["sign"] for c in found.choices if c.group == "commands" and "sign" in c.entry
    ] == [-1]


def test_a_joint_that_hardly_moves_has_the_unit_of_the_others(tmp_path: Path) -> None:
    joints = ("base", "shoulder", "elbow")
    q, g = (np.c_[0.004 * np.cos(31.0 * SLOW), gait(t)] for t in (SLOW - 0.15, SLOW))
    table = logs.frame_of(
        SLOW, q, np.degrees(g) + 0.3 * np.random.default_rng(1).standard_normal(g.shape), "{joint}_{what}", joints
    )
    _, found = logs.proposed(tmp_path, logs.written(tmp_path, table), joints)
    assert [c.entry["unit"] for c in found.choices if c.group == "commands"] == ["deg", "deg", "deg"]


@pytest.mark.parametrize(("every", "said"), [(1, True), (4, False)])
def test_commands_that_were_kept_seldom_are_said_to_look_like_a_delay(tmp_path: Path, every: int, said: bool) -> None:
    table = frame()
    for c in COMMANDS:
        table[c] = np.repeat(table[c].to_numpy()[::every], every)
    table["timestamp_ms"] = 1000 * table.pop("time")
    _, report = logs.imported(tmp_path, logs.written(tmp_path, table))
    line = [d for d in report.done if "half a row (100 ms) of what looks like delay is none" in d]
    assert bool(line) == said


def test_exchanged_joints_that_move_against_one_another_have_no_sign_turned(tmp_path: Path) -> None:
    """Each runs against what it is told itself, and lies where the other is told to be."""
    q, g = (np.stack([0.8 + w, -0.7 - w], axis=1) for w in (0.3 * np.sin(2.1 * (SLOW - s)) for s in (0.02, 0.0)))
    _, found = logs.proposed(tmp_path, logs.written(tmp_path, logs.frame_of(SLOW, q[:, ::-1], g)))
    (question,) = found.questions
    assert "the positions of shoulder, elbow are exchanged" in question and "put that right" in question
    _, found = logs.proposed(tmp_path, logs.written(tmp_path, logs.frame_of(SLOW, q, g)))
    assert not found.questions
