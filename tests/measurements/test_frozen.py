"""A logger that writes its last reading again and again while the robot goes on: such rows are told, and are no readings."""

from __future__ import annotations

from pathlib import Path

import measurement_files as samples
import numpy as np
import pandas as pd
import pytest
import small_logs as logs

from ee_dist.measurements.importer import import_file
from ee_dist.measurements.mapping_file import read_mapping
from ee_dist.measurements.proposal.write import as_yaml
from ee_dist.measurements.report import Report
from ee_dist.trials.log import SensorLog

ROWS = {"in the middle": slice(151, 211), "at the end": slice(341, 400), "at the beginning": slice(0, 40)}


def frame(**columns: np.ndarray) -> pd.DataFrame:
    """Of positions, speeds and goals (T, 2)."""
    t = {"time": samples.motion()["t"]}
    return pd.DataFrame(t | {f"{k}_{j}": v[:, n] for k, v in columns.items() for n, j in enumerate(samples.JOINTS)})


def moving(speeds: bool = True) -> pd.DataFrame:
    m = samples.motion()
    return frame(pos=m["q"], goal=m["g"], **({"vel": m["w"]} if speeds else {}))


def stood(log: pd.DataFrame, rows: slice, columns: str) -> pd.DataFrame:
    """One reading of the columns that begin so in all of these rows."""
    out, at = log.copy(), max(rows.start - 1, 0)
    names = [c for c in log if c[0] in columns]
    out.loc[rows.start : rows.stop - 1, names] = log.loc[at, names].to_numpy()
    return out


def read(folder: Path, log: pd.DataFrame) -> tuple[SensorLog, Report]:
    """By the mapping of a record in which nothing is wrong."""
    robot, proposal = logs.proposed(folder, logs.written(folder, moving("vel_elbow" in log)))
    (folder / "mapping.yaml").write_text(as_yaml(proposal, None, "log"))
    record, report = import_file(logs.written(folder, log), read_mapping(folder / "mapping.yaml"), robot)
    return record.log, report


@pytest.mark.parametrize("where", ROWS)
@pytest.mark.parametrize("columns", ["pv", "pvg"])
def test_rows_that_repeat_a_reading_while_it_moves_are_none(tmp_path: Path, where: str, columns: str) -> None:
    rows = ROWS[where]
    log, report = read(tmp_path, stood(moving(), rows, columns))
    count = rows.stop - rows.start
    (line,) = (s for s in (*report.done, *report.suspicious) if "all sensors repeat one reading" in s)
    assert (
        f"for {count} rows from row {rows.start + 2} on, {(count if rows.start else count - 1) / 100:g} s, while "
        in line
    )
    assert "says that it goes at" in line and line.count("rad/s") == 1
    if where == "in the middle":
        assert log.filled is not None and log.filled.sum() == count and log.filled[rows].all()
        assert "nothing there is compared" in line and line in report.suspicious
        assert np.abs(np.diff(log.joints, axis=0)).max() < 0.02, "they go on by lines"
    else:
        assert len(log.times_s) == samples.ROWS - count and log.filled is None
    assert not any(s.startswith(("speeds:", "time:")) for s in report.suspicious)


def test_without_speeds_commands_tell_that_it_moved(tmp_path: Path) -> None:
    _, report = read(tmp_path, stood(moving(speeds=False), ROWS["at the end"], "p"))
    assert any("59 rows" in d and "and commands go on" in d for d in report.done)


def test_a_robot_at_rest_was_read(tmp_path: Path) -> None:
    """It came to rest under commands that stand, or that go on while its speeds are none, with fine and coarse encoders."""
    t = samples.motion()["t"]
    rest, end = t > 2.5, np.minimum(t, 2.5)
    q = np.stack([0.5 * np.cos(np.pi * end / 2.5), 0.4 * np.cos(2 * np.pi * end / 2.5)], axis=1)
    w = np.where(rest[:, None], 0.0, np.gradient(q, t, axis=0))
    other = np.stack([np.sin(2 * t), np.cos(2 * t)], axis=1)
    for goal in (q, np.where(rest[:, None], other, q)):
        for step in (1e-9, 0.05):
            log, report = read(tmp_path, frame(pos=np.round(q / step) * step, vel=w, goal=goal))
            assert not any("one reading" in s for s in (*report.done, *report.suspicious))
            assert len(log.times_s) == len(t)


def test_a_speed_that_is_held_till_the_next_step_of_a_coarse_encoder_is_no_motion(tmp_path: Path) -> None:
    m = samples.motion()
    log = stood(frame(pos=np.round(m["q"] / 0.1) * 0.1, vel=m["w"], goal=m["g"]), ROWS["in the middle"], "pv")
    _, report = read(tmp_path, log)
    assert not any("one reading" in s for s in (*report.done, *report.suspicious))


@pytest.mark.parametrize("pace", [1, 3])
def test_a_joint_that_sticks_and_goes_on_from_there_was_read(tmp_path: Path, pace: int) -> None:
    """Its command is a triangle, and friction holds it where that turns: it came by so many counts a row, and goes on so."""
    count, t = 2 * np.pi / 4096, np.arange(samples.ROWS) / 50
    course = np.cumsum(
        np.concatenate([np.full(100, pace), np.zeros(50), np.full(100, -pace), np.zeros(50), np.full(100, pace)])
    )
    goal = count * pace * np.interp(np.arange(samples.ROWS), [0, 125, 275, 399], [25, 150, 0, 124])
    still = np.zeros(samples.ROWS)
    log = pd.DataFrame(
        {"time": t, "pos_shoulder": count * course, "pos_elbow": still, "goal_shoulder": goal, "goal_elbow": still}
    )
    _, report = read(tmp_path, log.round(6))
    assert not any("one reading" in s for s in (*report.done, *report.suspicious))


def test_without_speeds_a_jump_tells_that_it_moved(tmp_path: Path) -> None:
    log, report = read(tmp_path, stood(moving(speeds=False), ROWS["in the middle"], "p"))
    assert log.filled is not None and log.filled.sum() == 60
    assert any("60 rows" in s and "and commands go on: nothing there is compared" in s for s in report.suspicious)
