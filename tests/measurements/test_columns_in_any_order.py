"""Files beside one another whose columns stand in another order, or of which one has fewer, are trials of one kind."""

from __future__ import annotations

from pathlib import Path

import measurement_files as samples
import pandas as pd
import pytest
import small_logs as logs

from ee_dist.measurements.importer import import_files
from ee_dist.measurements.mapping_file import read_mapping
from ee_dist.measurements.proposal.files import proposal_for
from ee_dist.measurements.proposal.model import Hints
from ee_dist.measurements.proposal.write import as_yaml
from ee_dist.robots.describe import load_robot


def turned(frame: pd.DataFrame) -> pd.DataFrame:
    return frame[list(frame.columns)[::-1]]


def with_more(frame: pd.DataFrame) -> pd.DataFrame:
    return turned(frame).assign(counter_error=0.0)


@pytest.mark.parametrize("change", [turned, with_more])
def test_each_file_is_a_trial(tmp_path: Path, change) -> None:  # type: ignore[no-untyped-def]
    found = samples.motion()
    frame = logs.frame_of(found["t"], found["q"], found["g"])
    frame.to_csv(tmp_path / "a.csv", index=False)
    change(frame).to_csv(tmp_path / "b.csv", index=False)
    files = [tmp_path / "a.csv", tmp_path / "b.csv"]
    robot, _ = load_robot(samples.robot_file(tmp_path))
    proposal = proposal_for(files, robot, Hints())
    assert not proposal.questions and "tables" not in proposal.head
    (tmp_path / "mapping.yaml").write_text(as_yaml(proposal, "chain.yaml", "a.csv"))
    assert len(import_files(files, read_mapping(tmp_path / "mapping.yaml"), robot)) == 2
