"""Logs in which one joint each was moved and read, as those of a system identification are."""

from __future__ import annotations

from pathlib import Path

import measurement_files as samples
import numpy as np
import pandas as pd
import pytest

from ee_dist.measurements.importer import import_files
from ee_dist.measurements.mapping_file import read_mapping
from ee_dist.measurements.proposal.files import proposal_for
from ee_dist.measurements.proposal.model import Hints, Proposal
from ee_dist.measurements.proposal.write import as_yaml
from ee_dist.measurements.report import Report
from ee_dist.robots.describe import load_robot
from ee_dist.trials.log import SensorLog

LEG = ("L_Hip_Joint", "L_Thigh_Joint", "L_Calf_Joint")
ROWS = 500


def motion(k: int, late_s: float = 0.0) -> pd.DataFrame:
    """What one joint was told, and did 40 ms later, from a place of its own on."""
    t = np.arange(ROWS) / 100 + 0.02
    asked = 0.1 * k + 0.3 * np.sin(2 * t * (1 + 0.2 * k)) ** 2
    return pd.DataFrame({"t_s": t + late_s, "cmd_rad": asked, "pos_rad": np.interp(t - 0.04, t, asked)})


def written(folder: Path, name: str = "joint{k}_{joint}.csv", late_s: float = 0.0037) -> list[Path]:
    """A file for each joint; the times of each are ``late_s`` later than those of the one before."""
    files = [folder / name.format(k=2 * k, joint=joint) for k, joint in enumerate(LEG)]
    for k, file in enumerate(files):
        motion(k, k * late_s).to_csv(file, index=False)
    return files


def proposed(folder: Path, files: list[Path], joints: tuple[str, ...] = LEG) -> Proposal:
    return proposal_for(files, load_robot(samples.robot_file(folder, joints))[0], Hints())


def imported(folder: Path, files: list[Path]) -> list[tuple[SensorLog, Report]]:
    proposal = proposed(folder, files)
    assert not proposal.questions, proposal.questions
    (folder / "mapping.yaml").write_text(as_yaml(proposal, str(folder / "chain.yaml"), "them"))
    robot = load_robot(folder / "chain.yaml")[0]
    return [(r.log, report) for r, report in import_files(files, read_mapping(folder / "mapping.yaml"), robot)]


@pytest.mark.parametrize("name", ["joint{k}_{joint}.csv", "{joint}.csv"])
def test_each_is_a_trial_of_the_joint_that_its_name_holds(tmp_path: Path, name: str) -> None:
    found = imported(tmp_path, written(tmp_path, name))
    assert len(found) == len(LEG)
    for k, (log, report) in enumerate(found):
        moves = [np.ptp(log.channel(f"position_{joint}")) > 0 for joint in LEG]
        assert moves == [j == k for j in range(len(LEG))]
        assert [np.ptp(c) > 0 for c in log.commands.T] == moves
        rest = [j for j in range(len(LEG)) if j != k]
        for j in rest:  # where their own recordings begin
            own = motion(j)
            assert np.allclose(log.commands[:, j], own["cmd_rad"][0])
            lag = np.median(own["pos_rad"] - own["cmd_rad"])
            assert np.allclose(log.channel(f"position_{LEG[j]}"), own["cmd_rad"][0] + lag, atol=1e-6)
        (told,) = [d for d in report.done if d.startswith("not recorded in this trial")]
        assert (
            all(LEG[j] in told for j in rest)
            and f"{LEG[k]} at" not in told
            and "nothing of it is compared there" in told
        )
        assert not report.suspicious


def test_it_is_told_as_an_assumption(tmp_path: Path) -> None:
    proposal = proposed(tmp_path, written(tmp_path))
    apart, held = proposal.notes[:2]
    assert "recordings one after another" in apart and "'side_by_side' for 'one_joint_each'" in apart
    assert "an assumption" in held and f"{LEG[1]} at" in held
    (why,) = {c.why for c in proposal.choices if c.name == f"position_{LEG[0]}"}
    assert "recorded in 1 of 3 trials, held in the others" in why


def test_columns_may_name_the_joint_too(tmp_path: Path) -> None:
    files = written(tmp_path)
    for file, joint in zip(files, LEG, strict=True):
        pd.read_csv(file).rename(columns={"pos_rad": f"pos_{joint}_rad", "cmd_rad": f"{joint}_cmd_rad"}).to_csv(
            file, index=False
        )
    found = imported(tmp_path, files)
    assert [[j for j in LEG if np.ptp(log.channel(f"position_{j}")) > 0] for log, _ in found] == [[j] for j in LEG]


def test_files_with_the_same_times_are_one_recording(tmp_path: Path) -> None:
    proposal = proposed(tmp_path, files := written(tmp_path, late_s=0.0))
    assert "one recording in which all joints go at once" in proposal.notes[0]
    ((log, _),) = imported(tmp_path, files)
    assert all(np.ptp(c) > 0 for c in log.commands.T)


@pytest.mark.parametrize(("late_s", "trials"), [(0.0, 3), (0.0037, 1)])
def test_the_mapping_says_the_other_by_one_word(tmp_path: Path, late_s: float, trials: int) -> None:
    files = written(tmp_path, late_s=late_s)
    text = as_yaml(proposed(tmp_path, files), str(tmp_path / "chain.yaml"), "them")
    if late_s:
        text = text.replace("\none_joint_each:", "\nside_by_side:")
    else:
        text = text.replace("\nside_by_side:", "\none_joint_each:").replace("unit: rad}", "unit: rad, held: 0.1}")
    (tmp_path / "mapping.yaml").write_text(text)
    found = import_files(files, read_mapping(tmp_path / "mapping.yaml"), load_robot(tmp_path / "chain.yaml")[0])
    assert len(found) == trials


def test_of_files_without_times_nothing_tells_and_that_is_said(tmp_path: Path) -> None:
    files = written(tmp_path, "{joint}.csv")
    for file in files:
        pd.read_csv(file).drop(columns="t_s").to_csv(file, index=False)
    robot = load_robot(samples.robot_file(tmp_path, LEG))[0]
    proposal = proposal_for(files, robot, Hints(rate_hz=100))
    assert "no times, so that nothing tells" in proposal.notes[0] and "side_by_side" in proposal.head
    # Of different lengths they cannot be one.
    motion(0)[["cmd_rad", "pos_rad"]][:-40].to_csv(files[0], index=False)
    assert "one_joint_each" in proposal_for(files, robot, Hints(rate_hz=100)).head


def test_several_recordings_of_a_joint(tmp_path: Path) -> None:
    files = [*written(tmp_path, "slow_{joint}.csv"), *written(tmp_path, "{joint}_quick.csv")][:-1]
    found = imported(tmp_path, files)
    assert len(found) == len(files)
    moving = [[j for j in LEG if np.ptp(log.channel(f"position_{j}")) > 0] for log, _ in found]
    assert moving == [[j] for j in (*LEG, *LEG[:-1])]


def test_what_another_joint_is_in_is_no_file_of_one(tmp_path: Path) -> None:
    files = written(tmp_path)
    for file in files:
        pd.read_csv(file).assign(calf_current=1.0).to_csv(file, index=False)
    assert "one_joint_each" not in proposed(tmp_path, files).head


def test_a_joint_that_no_file_holds_is_asked_for(tmp_path: Path) -> None:
    (question,) = proposed(tmp_path, written(tmp_path)[:1]).questions
    assert f"the columns name {LEG[0]} alone" in question and "fixed_joints" in question


def with_empty_cells(folder: Path) -> list[Path]:
    """A table of all joints for each motion, in which the joints that were not read have no numbers."""
    files = []
    for k, joint in enumerate(LEG):
        own = motion(k)
        table = {"t_s": own["t_s"]} | {f"cmd_{j}_rad": np.full(ROWS, 0.1 * i) for i, j in enumerate(LEG)}
        table |= {f"pos_{j}_rad": np.full(ROWS, np.nan) for j in LEG}
        table |= {f"cmd_{joint}_rad": own["cmd_rad"], f"pos_{joint}_rad": own["pos_rad"]}
        files.append(folder / f"motion_{'abc'[k]}.csv")
        pd.DataFrame(table).to_csv(files[-1], index=False)
    return files


def test_columns_that_are_empty_in_a_trial_were_not_recorded_there(tmp_path: Path) -> None:
    files = with_empty_cells(tmp_path)
    for k, (log, report) in enumerate(imported(tmp_path, files)):
        assert [np.ptp(log.channel(f"position_{j}")) > 0 for j in LEG] == [j == k for j in range(len(LEG))]
        assert any(d.startswith("not recorded in this trial") for d in report.done)


def test_a_proposal_speaks_for_all_trials(tmp_path: Path) -> None:
    files = with_empty_cells(tmp_path)
    for file in files:
        table = pd.read_csv(file)
        table.fillna(dict.fromkeys(table.columns, 0.1)).to_csv(file, index=False)
    why = {c.name: c.why for c in proposed(tmp_path, files).choices if c.group == "commands"}
    assert why[LEG[1]].endswith("moves in 1 of 3 trials") and "moves in" not in why[LEG[0]]
    assert {c.why[-25:] for c in proposed(tmp_path, files[:1]).choices if c.name == LEG[1]} == {
        "does not move in this file"[-25:]
    }
