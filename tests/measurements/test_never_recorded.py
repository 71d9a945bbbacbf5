"""What was never recorded is left out, held or marked, and never counts as measured."""

from __future__ import annotations

from pathlib import Path

import measurement_files as samples
import numpy as np
import pytest
import small_logs as logs

from ee_dist.measurements.errors import MeasurementError
from ee_dist.measurements.importer import import_files
from ee_dist.measurements.mapping_file import mapping_of
from ee_dist.measurements.proposal.files import proposal_for
from ee_dist.measurements.proposal.model import Hints
from ee_dist.measurements.sampling import carried, filled
from ee_dist.robots.describe import load_robot

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


def test_a_speed_that_reads_one_number_while_its_joint_moves_is_none(tmp_path: Path) -> None:
    """Compared, it would be most of what a model seems to get wrong; of a joint that rests it is the truth."""
    moved = wave(T - 0.05)
    frame = logs.frame_of(T, moved, wave(T))
    frame["shoulder_vel_rad_s"], frame["elbow_vel_rad_s"] = np.gradient(moved[:, 0], T), 0.0
    _, proposal = logs.proposed(tmp_path, logs.written(tmp_path, frame))
    (dead,) = (c for c in proposal.choices if c.name == "velocity_elbow")
    assert "speed_of" in dead.entry and dead.why.startswith(
        "elbow_vel_rad_s reads 0 in every row while the joint moves"
    )
    (good,) = (c for c in proposal.choices if c.name == "velocity_shoulder")
    assert good.entry["column"] == "shoulder_vel_rad_s"
    log, _ = logs.imported(tmp_path, tmp_path / "log.csv")
    truth = np.gradient(moved[:, 1], T)
    assert np.corrcoef(log.channel("velocity_elbow")[50:-50], truth[50:-50])[0, 1] > 0.99

    moved[:, 1] = 0.2
    still = logs.frame_of(T, moved, wave(T))
    still["shoulder_vel_rad_s"], still["elbow_vel_rad_s"] = np.gradient(moved[:, 0], T), 0.0
    _, proposal = logs.proposed(tmp_path, logs.written(tmp_path, still))
    (rests,) = (c for c in proposal.choices if c.name == "velocity_elbow")
    assert rests.entry["column"] == "elbow_vel_rad_s"


def test_goals_of_positions_in_the_log_of_drives_described_to_obey_torques_are_told(tmp_path: Path) -> None:
    """A description with motors of torque, as MJCF files have them, and a log of a robot that was led by positions."""
    described = samples.robot_file(tmp_path)
    text = described.read_text().replace("kp: 20", "command: torque, torque_limit: 5")
    described.write_text(text)
    robot, _ = load_robot(described)
    proposal = proposal_for([logs.written(tmp_path, logs.frame_of(T, wave(T - 0.05), wave(T)))], robot, Hints())
    (asked,) = (q for q in proposal.questions if q.startswith("commands"))
    assert "no columns look like torques" in asked and "the positions follow" in asked and "by 50 ms" in asked
    assert "'command: position' with kp and kd" in asked


def test_what_may_be_the_command_of_a_torque_drive_is_asked_about(tmp_path: Path) -> None:
    """As where positions are looked for: of columns that say nothing it may be any."""
    described = samples.robot_file(tmp_path)
    described.write_text(described.read_text().replace("kp: 20", "command: torque, torque_limit: 5"))
    robot, _ = load_robot(described)
    table = logs.frame_of(
        T, wave(T - 0.05), np.cos(3.0 * T[:, None] + np.arange(2)), "{joint}_{what}", what=("pos", "push")
    )
    proposal = proposal_for([logs.written(tmp_path, table)], robot, Hints())
    (asked,) = (q for q in proposal.questions if q.startswith("commands"))
    assert ": is it shoulder_push, elbow_push? write" in asked


@pytest.mark.parametrize(
    ("rate_hz", "said"), [(40.0, "rows are readings of the sensors"), (80.0, "lie in gaps between")]
)
def test_the_report_counts_no_more_readings_than_there_are(tmp_path: Path, rate_hz: float, said: str) -> None:
    """Of 80 readings a second on a grid of 100 rows not all rows are readings, and those in a gap are none at all."""
    t = np.arange(int(10 * rate_hz)) / rate_hz
    t = np.concatenate([t, t[-1] + 0.5 + t])
    frame = logs.frame_of(t, wave(t - 0.05), wave(t))
    _, report = logs.imported(tmp_path, logs.written(tmp_path, frame))
    (line,) = (d for d in report.done if "rows are readings" in d or "lie in gaps" in d)
    assert said in line and (said.startswith("lie") or int(line.split()[0]) <= len(t))


def test_joints_that_were_told_something_and_not_read_are_named(tmp_path: Path) -> None:
    """Commands name all joints; the one whose cells are empty was taken for one that the columns call otherwise."""
    joints = ("hip_joint", "knee_joint", "ankle_joint")
    goals = np.stack([0.3 * np.sin((2 + k) * T) for k in range(3)], axis=1)
    frame = logs.frame_of(T, goals, goals, "{what}_{joint}_rad", joints)
    frame[["pos_knee_joint_rad", "pos_ankle_joint_rad"]] = np.nan
    _, proposal = logs.proposed(tmp_path, logs.written(tmp_path, frame), joints)
    (question,) = proposal.questions
    assert "the columns name hip_joint alone; of knee_joint, ankle_joint nothing was recorded" in question
