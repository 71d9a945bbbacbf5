"""A folder whose first file has a few rows: what its columns are is told by one that has more."""

from __future__ import annotations

from pathlib import Path

import measurement_files as samples
import pytest
import small_logs as logs

from ee_dist.measurements.proposal.files import proposal_for
from ee_dist.measurements.proposal.model import FEWEST_ROWS, Hints, Proposal
from ee_dist.robots.describe import load_robot


def proposed(folder: Path, rows: list[int]) -> Proposal:
    """What is proposed for files of so many rows of a motion."""
    m = samples.motion()
    files = []
    for k, count in enumerate(rows):
        file = folder / f"run{k}.csv"
        logs.frame_of(m["t"][:count], m["q"][:count], m["g"][:count]).to_csv(file, index=False)
        files.append(file)
    robot, _ = load_robot(samples.robot_file(folder, samples.JOINTS))
    return proposal_for(files, robot, Hints())


@pytest.mark.parametrize("few", [2, 10, FEWEST_ROWS - 1])
def test_a_file_with_enough_rows_is_looked_at_and_the_others_are_named(tmp_path: Path, few: int) -> None:
    proposal = proposed(tmp_path, [few, few, samples.ROWS, samples.ROWS])
    assert not proposal.questions
    (note,) = [n for n in proposal.notes if "too few rows" in n]
    assert "looked at run2.csv" in note and f"(run0.csv: {few} rows; run1.csv: {few} rows)" in note
    assert {c.column for c in proposal.choices if c.group == "commands"} == {f"{j}_goal_rad" for j in samples.JOINTS}


def test_where_the_first_has_enough_rows_nothing_is_said(tmp_path: Path) -> None:
    assert not any("too few rows" in n for n in proposed(tmp_path, [FEWEST_ROWS, 10]).notes)


def test_where_none_has_enough_that_is_what_is_asked(tmp_path: Path) -> None:
    (question, *_) = proposed(tmp_path, [10, 12]).questions
    assert question.startswith("10 rows are too few to tell what columns are (at least 21)")
