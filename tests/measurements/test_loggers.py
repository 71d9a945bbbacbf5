"""Files as loggers of servos leave them: rows that were skipped, each reading twice, a folder for each run, lists of runs."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from ee_dist.measurements.folders import own_names, recordings_in
from ee_dist.measurements.importer import import_files
from ee_dist.measurements.mapping_file import mapping_of, read_mapping
from ee_dist.measurements.proposal.files import proposal_for
from ee_dist.measurements.proposal.model import Hints, Proposal
from ee_dist.measurements.proposal.write import as_yaml
from ee_dist.robots.servo_pendulum import servo_pendulum

ROBOT = servo_pendulum(time_step_s=0.005)
ROWS = 600
EMPTY_EVERY = 50
TICK = 2 * np.pi / 4096


def telemetry(seed: int = 0) -> pd.DataFrame:
    """A servo's: angles as the logger made them of its counts and the counts, currents, and a row in fifty without readings."""
    t = np.arange(ROWS) * 0.01
    rng = np.random.default_rng(seed)
    sines = [(rng.uniform(0.1, 0.3), w, rng.uniform(0, 6)) for w in (1.3, 2.9, 4.7)]
    goal = sum(a * np.sin(w * t + p) for a, w, p in sines)
    seen = sum(a * np.sin(w * (t - 0.03) + p) for a, w, p in sines)
    count = np.round(seen / TICK) + 2048
    frame = pd.DataFrame(
        {
            "time_s": t,
            "q_cmd_rad": goal,
            "goal_position_tick": np.round(-goal / TICK) + 2048,
            "q_present_rad": (count - 2048) * TICK,
            "present_position_tick": count,
            "present_current_A": 0.1 * np.gradient(seen, t) + 0.01 * rng.standard_normal(ROWS),
        }
    )
    frame.loc[::EMPTY_EVERY, ["q_present_rad", "present_position_tick", "present_current_A"]] = np.nan
    return frame


def proposed(files: list[Path], folder: Path) -> tuple[Proposal, Path]:
    proposal = proposal_for(files, ROBOT, Hints())
    path = folder / "mapping.yaml"
    path.write_text(as_yaml(proposal, "servo_pendulum", "log"))
    return proposal, path


def test_empty_cells_and_counts_beside_angles_need_no_mapping(tmp_path: Path) -> None:
    frame = telemetry()
    frame.to_csv(tmp_path / "log.csv", index=False)
    proposal, path = proposed([tmp_path / "log.csv"], tmp_path)
    assert not proposal.questions
    entries = {c.name: c.entry for c in proposal.choices}
    assert entries["position"] == {"column": "q_present_rad", "unit": "rad", "gaps": "interpolate"}
    assert entries["servo"] == {"column": "q_cmd_rad", "unit": "rad"}
    (why,) = [c.why for c in proposal.choices if c.name == "position"]
    assert f"{ROWS // EMPTY_EVERY} of {ROWS} cells are empty" in why
    ((record, report),) = import_files([tmp_path / "log.csv"], read_mapping(path), ROBOT)
    read = record.log.sensors[record.log.readings, 0]
    assert np.allclose(read[1:], frame["q_present_rad"].interpolate()[1:], atol=1e-9)
    assert any("empty cells filled" in d for d in report.done)


def test_currents_stop_nobody_whose_robot_is_led_by_its_commands(tmp_path: Path) -> None:
    frame = telemetry()
    frame.to_csv(tmp_path / "log.csv", index=False)
    proposal, _ = proposed([tmp_path / "log.csv"], tmp_path)
    assert not [c for c in proposal.choices if c.group == "torques"]
    assert any("present_current_A" in n and "left out" in n and "task.gains" in n for n in proposal.notes)


def test_a_column_that_is_mostly_empty_is_no_channel(tmp_path: Path) -> None:
    frame = telemetry()
    frame.loc[frame.index % 2 == 0, "q_present_rad"] = np.nan
    frame.drop(columns="present_position_tick").to_csv(tmp_path / "log.csv", index=False)
    proposal, _ = proposed([tmp_path / "log.csv"], tmp_path)
    assert any("no columns are called the positions" in q for q in proposal.questions)


@pytest.mark.parametrize("sent", ["often", "once"])
def test_topics_that_are_written_in_turn_into_one_table_come_in(tmp_path: Path, sent: str) -> None:
    """As plotting programs export them: each row has the numbers of one topic. A goal that was sent once holds."""
    frame = telemetry().interpolate().bfill()[["time_s", "q_cmd_rad", "q_present_rad"]]
    commands = np.arange(ROWS) % 2 == 0
    if sent == "once":
        # The state's rows follow one another then, and the mapping is that of a file that tells more.
        commands = np.arange(ROWS) == 5
        frame.loc[5, "q_cmd_rad"] = 0.25
    frame.loc[~commands, "q_cmd_rad"] = np.nan
    frame.loc[commands, "q_present_rad"] = np.nan
    frame.to_csv(tmp_path / "log.csv", index=False)
    if sent == "often":
        proposal, path = proposed([tmp_path / "log.csv"], tmp_path)
        assert not proposal.questions
        entries = {c.name: c.entry for c in proposal.choices}
        assert entries["position"] == {"column": "q_present_rad", "unit": "rad", "gaps": "interpolate"}
        assert entries["servo"] == {"column": "q_cmd_rad", "unit": "rad", "gaps": "interpolate"}
        mapping = read_mapping(path)
    else:
        (tmp_path / "mapping.yaml").write_text(
            "robot: servo_pendulum\ntime: {column: time_s, unit: s}\n"
            "sensors:\n  position: {column: q_present_rad, unit: rad, gaps: interpolate}\n  speed: {speed_of: position}\n"
            "commands: {servo: {column: q_cmd_rad, unit: rad, gaps: interpolate}}\n"
        )
        mapping = read_mapping(tmp_path / "mapping.yaml")
    ((record, report),) = import_files([tmp_path / "log.csv"], mapping, ROBOT)
    if sent == "once":
        assert np.array_equal(np.unique(record.log.commands), [0.25])
        assert any("before the first command" in d for d in report.done)
    else:
        truth = np.interp(record.log.times_s, frame["time_s"], telemetry()["q_present_rad"].interpolate().bfill())
        assert np.abs(record.log.sensors[:, 0] - truth).max() < 0.01


def runs(folder: Path) -> list[str]:
    """A folder of folders: in each the telemetry, the events and a remark on how it was made."""
    names = []
    for k, (kind, number) in enumerate([("sine", 1), ("sine", 2), ("step", 1)]):
        run = folder / kind / f"repeat_{number}"
        run.mkdir(parents=True)
        telemetry(k).to_csv(run / "telemetry.csv", index=False)
        pd.DataFrame({"sequence": range(ROWS), "scheduled_s": np.arange(ROWS) * 0.01}).to_csv(
            run / "events.csv", index=False
        )
        (run / "metadata.json").write_text(json.dumps({"valid": True, "gain": 350}))
        names.append(f"{kind} repeat_{number}")
    return names


def test_a_folder_for_each_run(tmp_path: Path) -> None:
    names = runs(tmp_path / "raw")
    files, notes = recordings_in(tmp_path / "raw")
    assert len(files) == 6 and notes == ["metadata.json and 2 more left out: no rows in it"]
    proposal, path = proposed(files, tmp_path)
    assert not proposal.questions
    found = import_files(files, read_mapping(path), ROBOT)
    assert [r.name for r, _ in found] == names
    assert not np.array_equal(found[0][0].log.sensors, found[1][0].log.sensors)


def test_what_people_wrote_beside_their_tables_is_left_out_and_told(tmp_path: Path) -> None:
    telemetry(0).to_csv(tmp_path / "sine.csv", index=False)
    telemetry(1).to_csv(tmp_path / "step.txt", index=False)
    (tmp_path / "notes.txt").write_text(
        "The elbow was greased.\n\nGains: 350, 20\nThen, on Monday, again, but colder\n"
    )
    files, notes = recordings_in(tmp_path)
    assert [f.name for f in files] == ["sine.csv", "step.txt"]
    assert len(notes) == 1 and notes[0].startswith("notes.txt left out: ")
    (tmp_path / "sine.csv").unlink()
    assert len(recordings_in(tmp_path)[0]) == 2, "where all end so, one that cannot be read is told when it is read"


def test_files_of_one_name_are_told_apart_by_their_folders(tmp_path: Path) -> None:
    names = runs(tmp_path)
    files = sorted(tmp_path.rglob("telemetry.csv"))
    _, path = proposed(files, tmp_path)
    assert [r.name for r, _ in import_files(files, read_mapping(path), ROBOT)] == names
    for given, wanted in (
        (["a/x.csv", "b/y.csv"], ["x", "y"]),
        (["a/1/x.csv", "b/1/x.csv", "b/x.csv"], ["a 1", "b 1", "b"]),
        (["a/x.csv", "b/x.csv", "b/y.csv"], ["a x", "b x", "b y"]),
        (["x.csv", "x.json"], ["x.csv", "x.json"]),
    ):
        assert list(own_names([tmp_path / g for g in given]).values()) == wanted


@pytest.mark.parametrize("short", [False, True])
def test_a_list_of_runs_with_columns(tmp_path: Path, short: bool) -> None:
    """JSON of [{"type": ..., "actions": [...], "readings": [...]}, ...]: each entry is a trial, not a row."""
    lengths = (60, 30, 45) if short else (150, 150, 150)
    entries = []
    for k, n in enumerate(lengths):
        frame = telemetry(k).iloc[1 : n + 1]
        columns = {"actions": frame["q_cmd_rad"], "readings": frame["q_present_rad"]}
        entries.append(
            {"type": "sine", "targets": ["kp"]}
            | {c: [None if np.isnan(x) else x for x in v] for c, v in columns.items()}
        )
    (tmp_path / "set.json").write_text(json.dumps({"config": {"hz": 100}, "data": entries}))
    mapping = mapping_of(
        {
            "time": {"rate_hz": 100},
            "sensors": {
                "position": {"column": "readings", "unit": "rad", "gaps": "interpolate"},
                "speed": {"speed_of": "position"},
            },
            "commands": {"servo": {"column": "actions", "unit": "rad"}},
        },
        Path("map.yaml"),
    )
    found = import_files([tmp_path / "set.json"], mapping, ROBOT)
    assert [r.name for r, _ in found] == ["sine 1", "sine 2", "sine 3"]
    assert [len(r.log.readings) for r, _ in found] == list(lengths)


def test_rows_that_hold_a_list_for_each_quantity_stay_rows(tmp_path: Path) -> None:
    rows = [{"t": 0.01 * k, "q": [0.1 * k] * 6, "g": [0.1] * 6} for k in range(80)]
    (tmp_path / "a.json").write_text(json.dumps({"entries": rows}))
    from ee_dist.measurements.readers import read

    (one,) = read(tmp_path / "a.json")
    assert len(one.tables[0]) == 80
