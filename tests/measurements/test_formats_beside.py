"""A folder with files of several formats: none is read twice, and what is no recording stops nothing."""

from __future__ import annotations

from pathlib import Path

import measurement_files as samples
import numpy as np
import small_logs as logs

from ee_dist.measurements.folders import recordings_in
from ee_dist.measurements.importer import import_files
from ee_dist.measurements.mapping_file import read_mapping
from ee_dist.measurements.proposal.kinds import proposal_of_kinds
from ee_dist.measurements.proposal.model import Hints
from ee_dist.measurements.proposal.write import as_yaml
from ee_dist.robots.describe import load_robot

M = samples.motion()
FRAME = logs.frame_of(M["t"], M["q"], M["g"])


def test_the_same_rows_under_two_suffixes_are_read_once(tmp_path: Path) -> None:
    for k in (1, 2):
        FRAME.to_csv(tmp_path / f"run{k}.csv", index=False)
        FRAME.round(6).to_csv(tmp_path / f"run{k}.txt", index=False, sep="\t")
    files, notes = recordings_in(tmp_path)
    assert [f.name for f in files] == ["run1.csv", "run2.csv"]
    assert notes == ["run1.txt and 1 more left out: the same rows as in run1.csv, read once"]


def test_other_rows_under_two_suffixes_are_two_recordings(tmp_path: Path) -> None:
    FRAME.to_csv(tmp_path / "run.csv", index=False)
    (FRAME * [1, -1, 1, 1, 1]).to_csv(tmp_path / "run.txt", index=False, sep="\t")
    assert [f.name for f in recordings_in(tmp_path)[0]] == ["run.csv", "run.txt"]


def test_archives_beside_tables_that_say_all_are_left_out(tmp_path: Path) -> None:
    folder = tmp_path / "logs"
    folder.mkdir()
    for k in (1, 2):
        FRAME.to_csv(folder / f"run{k}.csv", index=False)
        np.savez(folder / f"run{k}.npz", t=M["t"], depth=np.random.default_rng(k).random((len(M["t"]), 30)))
    np.savez(folder / "about.npz", gains=np.eye(3))
    robot, _ = load_robot(samples.robot_file(tmp_path))
    files, _ = recordings_in(folder)
    proposal, own = proposal_of_kinds(files, robot, Hints())
    assert not proposal.questions and [f.name for f in own] == ["run1.csv", "run2.csv"]
    assert "about.npz and 2 more left out: the files of format csv say all that is asked for" in proposal.notes
    (tmp_path / "mapping.yaml").write_text(as_yaml(proposal, str(tmp_path / "chain.yaml"), "run1.csv"))
    mapping = read_mapping(tmp_path / "mapping.yaml")
    assert recordings_in(folder, mapping.reading.kind)[0] == own
    assert len(import_files(own, mapping, robot)) == 2


def test_where_no_format_says_all_the_question_is_that_of_all_files(tmp_path: Path) -> None:
    FRAME[["time"]].to_csv(tmp_path / "run.csv", index=False)
    np.savez(tmp_path / "about.npz", gains=np.eye(3))
    robot, _ = load_robot(samples.robot_file(tmp_path))
    files, _ = recordings_in(tmp_path)
    proposal, own = proposal_of_kinds(files, robot, Hints())
    assert proposal.questions and own == files
