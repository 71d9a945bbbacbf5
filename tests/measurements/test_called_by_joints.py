"""Columns that are called as the joints are, and nothing else, are the positions; beside them are the targets of these."""

from __future__ import annotations

from pathlib import Path

import measurement_files as samples
import numpy as np
import pandas as pd
import pytest

from ee_dist.measurements.proposal.files import proposal_for
from ee_dist.measurements.proposal.model import Hints
from ee_dist.measurements.proposal.write import rows
from ee_dist.robots.describe import load_robot


@pytest.mark.parametrize("joints", [("shoulder", "elbow"), ("theta", "alpha"), ("hip_joint", "knee_joint")])
@pytest.mark.parametrize("asked", ["target_{}", "{}_goal", "cmd_{}"])
def test_columns_called_by_the_joints_alone_are_their_positions(
    tmp_path: Path, joints: tuple[str, ...], asked: str
) -> None:
    m = samples.motion()
    robot, _ = load_robot(samples.robot_file(tmp_path, joints))
    frame = pd.DataFrame({"t": m["t"]} | {asked.format(j): m["g"][:, k] for k, j in enumerate(joints)})
    frame = frame.assign(**{j: m["q"][:, k] for k, j in enumerate(joints)}, gain=5.0)
    frame.to_csv(tmp_path / "run.csv", index=False)
    proposal = proposal_for([tmp_path / "run.csv"], robot, Hints())
    assert not proposal.questions, proposal.questions
    found = {channel: columns for channel, columns, *_ in rows(proposal)}
    assert found[", ".join(f"position_{j}" for j in joints)] == ", ".join(joints)
    assert found[f"command of {', '.join(joints)}"] == ", ".join(asked.format(j) for j in joints)


@pytest.mark.parametrize(("name", "known"), [("torques", False), ("joint_velocities", False), ("run_7", True)])
def test_what_a_file_is_called_goes_before(tmp_path: Path, name: str, known: bool) -> None:
    m = samples.motion()
    robot, _ = load_robot(samples.robot_file(tmp_path))
    frame = pd.DataFrame({"t": m["t"]} | {j: m["q"][:, k] for k, j in enumerate(samples.JOINTS)})
    frame.to_csv(tmp_path / f"{name}.csv", index=False)
    proposal = proposal_for([tmp_path / f"{name}.csv"], robot, Hints())
    assert any(q.startswith("no columns can be told to be the positions") for q in proposal.questions) != known


@pytest.mark.parametrize("several", [False, True])
@pytest.mark.parametrize("order", [None, samples.JOINTS])
def test_columns_without_names_that_are_no_runs_of_all_joints_are_named_by_number(
    tmp_path: Path, order: tuple[str, ...] | None, several: bool
) -> None:
    """A counter beside them: the order of the joints, which is asked for of others, cannot tell them, and that is said."""
    m = samples.motion()
    table = np.column_stack([m["t"], np.arange(samples.ROWS) * 8007 % 65536, m["q"], m["w"], m["g"]])
    files = [tmp_path / f"run{k}.txt" for k in range(1 + several)]
    for file in files:
        np.savetxt(file, table)
    robot, _ = load_robot(samples.robot_file(tmp_path))
    (question,) = (q for q in proposal_for(files, robot, Hints(joints=order)).questions if q.startswith("positions"))
    assert "the order of the joints (task.joints) tells them only where they come in runs of all 2 joints" in question
    assert ": 7 beside the time are no multiple of 2; write which is which into the mapping" in question
    assert "such as 'position_shoulder: {column: \"3\", unit: rad}'" in question
    np.savetxt(files[0], np.delete(table, 1, axis=1))
    assert not any("no multiple" in q for q in proposal_for(files[:1], robot, Hints(joints=samples.JOINTS)).questions)
