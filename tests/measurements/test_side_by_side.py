"""Logs of which each file holds one quantity, or one joint: together they are a trial, and the same as one file of all."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import measurement_files as samples
import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ee_dist.measurements.errors import MeasurementError
from ee_dist.measurements.folders import recordings_in
from ee_dist.measurements.importer import import_files
from ee_dist.measurements.mapping_file import mapping_of, read_mapping
from ee_dist.measurements.proposal.files import proposal_for
from ee_dist.measurements.proposal.layouts import put_together
from ee_dist.measurements.proposal.model import Hints
from ee_dist.measurements.proposal.write import as_yaml
from ee_dist.measurements.readers import read
from ee_dist.measurements.side_by_side import side_by_side
from ee_dist.robots.describe import load_robot
from ee_dist.trials.log import SensorLog

JOINTS = samples.JOINTS
Motion = dict[str, np.ndarray]
Write = Callable[[Path, Motion], None]


def table(file: Path, values: np.ndarray, names: list[str] | None) -> None:
    pd.DataFrame(values, columns=names).to_csv(file, index=False, header=names is not None)


def without_names(folder: Path, m: Motion) -> None:
    for stem, values in (("q", m["q"]), ("q_des", m["g"]), ("t", m["t"][:, None])):
        table(folder / f"{stem}.csv", values, None)


def arrays(folder: Path, m: Motion) -> None:
    for stem, values in (("q", m["q"]), ("cmd", m["g"]), ("time", m["t"])):
        np.save(folder / f"{stem}.npy", values)


def by_quantity(folder: Path, m: Motion) -> None:
    for stem, values in (("positions", m["q"]), ("commands", m["g"])):
        table(folder / f"{stem}.csv", np.c_[m["t"], values], ["time", *JOINTS])


def with_a_common_word(folder: Path, m: Motion) -> None:
    """As a laboratory published them: one more file of the speeds, and accelerations of another length."""
    speeds = np.gradient(m["q"], m["t"], axis=0)
    quantities = {"Q": m["q"], "Qref": m["g"], "TimeStamp": m["t"][:, None], "DotQ": speeds, "DotQ_NF": 1.01 * speeds}
    for name, values in (quantities | {"DDotQ": speeds[1:]}).items():
        table(folder / f"data{name}.csv", values, None)


def in_camel_case(folder: Path, m: Motion) -> None:
    """As a program for a Kinova arm writes them, the settings of the motion in each name, and where its hand was to be."""
    named = {"desiredJointPosition": m["g"], "jointPosition": m["q"], "simulationTime": m["t"][:, None]}
    for name, values in (named | {"desiredEndEffectorPosition": m["g"][:, :1] + 0.3}).items():
        table(folder / f"Fair_R0.05_T3.0_1_{name}.csv", values, None)


def by_joint(folder: Path, m: Motion) -> None:
    for k, joint in enumerate(JOINTS):
        values = np.stack([m["t"], m["q"][:, k], m["g"][:, k]], axis=1)
        table(folder / f"{joint}.csv", values, ["time", "position", "goal"])


def by_number(folder: Path, m: Motion) -> None:
    for k in range(len(JOINTS)):
        values = np.stack([m["t"], m["q"][:, k], m["g"][:, k]], axis=1)
        table(folder / f"motor_{k + 1}.csv", values, ["time", "position_rad", "goal_rad"])


def in_turn(folder: Path, m: Motion) -> None:
    for run, part in (("run1", slice(0, 300)), ("run2", slice(300, None))):
        own = {"q": m["q"][part], "g": m["g"][part], "t": m["t"][part]}
        for stem, values in (("pos", own["q"]), ("goal", own["g"])):
            table(folder / f"{run}_{stem}.csv", np.c_[own["t"], values], ["time", *JOINTS])


LAYOUTS: tuple[Write, ...] = (without_names, arrays, by_quantity, in_camel_case, by_joint, by_number)


def taken_in(folder: Path, files: list[Path]) -> list[SensorLog]:
    robot, _ = load_robot(samples.robot_file(folder))
    proposal = proposal_for(files, robot, Hints())
    assert not proposal.questions, proposal.questions
    (folder / "mapping.yaml").write_text(as_yaml(proposal, str(folder / "chain.yaml"), "them"))
    return [r.log for r, _ in import_files(files, read_mapping(folder / "mapping.yaml"), robot)]


@pytest.mark.parametrize("write", LAYOUTS)
def test_they_are_the_trial_that_one_file_would_be(tmp_path: Path, write: Write) -> None:
    m = samples.motion()
    apart, one = tmp_path / "apart", tmp_path / "one"
    apart.mkdir()
    one.mkdir()
    write(apart, m)
    names = ["time", *(f"{j}_pos" for j in JOINTS), *(f"{j}_goal" for j in JOINTS)]
    table(one / "log.csv", np.c_[m["t"], m["q"], m["g"]], names)
    (found,) = taken_in(tmp_path, recordings_in(apart)[0])
    (wanted,) = taken_in(one, [one / "log.csv"])
    assert np.allclose(found.sensors, wanted.sensors, atol=1e-9) and np.allclose(
        found.commands, wanted.commands, atol=1e-9
    )


def test_a_folder_for_each_trial_or_a_name_for_each(tmp_path: Path) -> None:
    m = samples.motion()
    for run in ("a", "b"):
        (tmp_path / "logs" / run).mkdir(parents=True)
        by_quantity(tmp_path / "logs" / run, m)
    assert len(taken_in(tmp_path, recordings_in(tmp_path / "logs")[0])) == 2
    (tmp_path / "flat").mkdir()
    in_turn(tmp_path / "flat", m)
    files = recordings_in(tmp_path / "flat")[0]
    first, second = taken_in(tmp_path, files)
    assert abs(len(first) - 300) < 5 and abs(len(second) - (len(m["t"]) - 300)) < 5


def test_a_word_that_all_of_them_begin_with_says_nothing(tmp_path: Path) -> None:
    """dataQ is q; what is there twice, or of other rows and nothing that a model asks for, is left out and named."""
    m = samples.motion()
    with_a_common_word(tmp_path, m)
    files = recordings_in(tmp_path)[0]
    robot, _ = load_robot(samples.robot_file(tmp_path))
    (note,) = [n for n in proposal_for(files, robot, Hints()).notes if "left out, since" in n]
    assert "dataDDotQ.csv" in note and "dataDotQ_NF.csv" in note and "dataDotQ.csv" not in note
    (log,) = taken_in(tmp_path, files)
    plain = tmp_path / "plain"
    plain.mkdir()
    without_names(plain, m)
    (wanted,) = taken_in(plain, recordings_in(plain)[0])
    assert np.allclose(log.commands, wanted.commands, atol=1e-9)
    for joint in JOINTS:
        assert np.allclose(log.channel(f"position_{joint}"), wanted.channel(f"position_{joint}"), atol=1e-9)


def test_what_lies_beside_them_and_says_nothing_of_itself_is_left_out(tmp_path: Path) -> None:
    m = samples.motion()
    by_quantity(tmp_path, m)
    table(tmp_path / "calibration.csv", np.arange(6.0).reshape(3, 2), ["a", "b"])
    robot, _ = load_robot(samples.robot_file(tmp_path))
    proposal = proposal_for(recordings_in(tmp_path)[0], robot, Hints())
    assert not proposal.questions and any("left out" in n and "calibration.csv" in n for n in proposal.notes)
    assert len(taken_in(tmp_path, recordings_in(tmp_path)[0])) == 1


def test_full_logs_that_are_called_after_what_was_done_are_trials(tmp_path: Path) -> None:
    m = samples.motion()
    names = ["time", *(f"{j}_pos" for j in JOINTS), *(f"{j}_goal" for j in JOINTS)]
    both = ["time", *(f"{j}_pos" for j in JOINTS), *(f"{j}_vel" for j in JOINTS)]
    table(tmp_path / "position.csv", np.c_[m["t"], m["q"], m["g"]], names)
    table(tmp_path / "velocity.csv", np.c_[m["t"], m["q"], m["g"]], names)
    files = [tmp_path / "position.csv", tmp_path / "velocity.csv"]
    assert put_together(files, JOINTS) is None
    table(tmp_path / "elbow.csv", np.c_[m["t"], m["q"], m["q"]], both)
    table(tmp_path / "shoulder.csv", np.c_[m["t"], m["q"], m["q"]], both)
    assert put_together([tmp_path / "elbow.csv", tmp_path / "shoulder.csv"], JOINTS) is None
    assert put_together([tmp_path / "elbow.csv"] * 2, JOINTS) is None


def test_rows_of_different_moments_go_by_their_times(tmp_path: Path) -> None:
    """Commands that were logged by another thread: seldom, later, and over a part of the time."""
    m = samples.motion()
    by_quantity(tmp_path, m)
    files = [tmp_path / "positions.csv", tmp_path / "commands.csv"]
    sent = np.c_[m["t"] + 0.004, m["g"]][20:-10:2]
    table(files[1], sent, ["time", *JOINTS])
    (log,) = taken_in(tmp_path, files)
    # From the first row at which a command was known, to the last before the next would have come.
    at = m["t"][21:-9]
    assert len(log) == len(at)
    assert log.sensors[:, :2] == pytest.approx(m["q"][21:-9])
    known = sent[np.searchsorted(sent[:, 0], at, side="right") - 1, 1:]
    assert log.commands == pytest.approx(known)
    # As many rows, at other times.
    table(files[1], np.c_[m["t"] + 0.02, m["g"]], ["time", *JOINTS])
    (log,) = taken_in(tmp_path, files)
    assert log.commands == pytest.approx(m["g"][:-2])


def test_rows_of_different_moments_do_not_stand_side_by_side(tmp_path: Path) -> None:
    m = samples.motion()
    files = [tmp_path / "positions.csv", tmp_path / "commands.csv"]
    robot, _ = load_robot(samples.robot_file(tmp_path))
    table(files[0], np.c_[m["t"], m["q"]], ["time", *JOINTS])
    table(files[1], m["g"][:-3], [*JOINTS])
    with pytest.raises(MeasurementError, match=r"positions.csv \(400 rows\), commands.csv \(397 rows\) cannot stand"):
        side_by_side({f.stem: read(f)[0].tables[0] for f in files})
    # What cannot stand side by side, and is no trial each either, is said, not taken for trials.
    table(tmp_path / "torques.csv", m["g"][:-6], [*JOINTS])
    with pytest.raises(MeasurementError, match="cannot stand side by side"):
        proposal_for([*files, tmp_path / "torques.csv"], robot, Hints())
    table(files[1], np.c_[m["t"] + 1e6, m["g"]][:-3], ["time", *JOINTS])
    with pytest.raises(MeasurementError, match="hardly a moment in common"):
        side_by_side({f.stem: read(f)[0].tables[0] for f in files})


def test_one_that_is_missing_is_named(tmp_path: Path) -> None:
    m = samples.motion()
    for run in ("a", "b"):
        (tmp_path / run).mkdir()
        by_quantity(tmp_path / run, m)
    robot, _ = load_robot(samples.robot_file(tmp_path))
    files = [f for run in ("a", "b") for f in recordings_in(tmp_path / run)[0]]
    (tmp_path / "mapping.yaml").write_text(
        as_yaml(proposal_for(files, robot, Hints()), str(tmp_path / "chain.yaml"), "")
    )
    with pytest.raises(MeasurementError, match=r"no positions\.csv beside it"):
        import_files(files[:-1], read_mapping(tmp_path / "mapping.yaml"), robot)


@pytest.mark.parametrize(
    ("listed", "said"),
    [
        ({"q": "q.csv"}, "expected two files or more"),
        ({"q": "", "tau": "tau.csv"}, "expected the name of a file"),
        ({"q": "{trial}{trial}.csv", "tau": "tau.csv"}, "expected the name of a file"),
        ("q.csv", "side_by_side"),
    ],
)
def test_a_wrong_list_of_files_is_said(listed: object, said: str) -> None:
    with pytest.raises(MeasurementError, match=said):
        mapping_of({"sensors": {}, "side_by_side": listed}, Path("mapping.yaml"))
    both = {"side_by_side": {"q": "q.csv", "tau": "tau.csv"}, "tables": {"q": {"file": "q.csv"}}}
    with pytest.raises(MeasurementError, match="leave one of the two out"):
        mapping_of({"sensors": {}} | both, Path("mapping.yaml"))


@settings(max_examples=25, deadline=None)
@given(st.integers(1, 4), st.integers(2, 30), st.booleans())
def test_columns_are_called_after_their_file_and_keep_their_numbers(
    tmp_path_factory: pytest.TempPathFactory, width: int, rows: int, named: bool
) -> None:
    folder = tmp_path_factory.mktemp("them")
    values = np.random.default_rng(width * rows).normal(size=(2, rows, width))
    names = [f"axis {k}" for k in range(width)] if named else None
    for stem, part in zip(("q", "tau"), values, strict=True):
        table(folder / f"{stem}.csv", part, names)
    tables = {s: read(folder / f"{s}.csv")[0].tables[0] for s in ("q", "tau")}
    found = side_by_side(tables)
    addresses = list(found.addresses())
    assert len(addresses) == 2 * width and len(found) == rows
    wanted = np.concatenate(list(values), axis=1)
    assert np.allclose(np.stack([found.numbers(a) for a in addresses], axis=1), wanted, rtol=1e-12)
    if named:
        assert addresses[0] == "q.axis 0" and addresses[-1] == f"tau.axis {width - 1}"


@pytest.mark.parametrize("trial", ["", "yaw_"])
def test_a_file_may_be_called_just_as_its_joint_is(tmp_path: Path, trial: str) -> None:
    """Of joint_a1 and joint_a2, as ROS calls them, no word but a number tells one from the other."""
    m, joints = samples.motion(), [f"joint_a{k + 1}" for k in range(len(JOINTS))]
    for k, joint in enumerate(joints):
        values = np.stack([m["t"], m["q"][:, k], m["g"][:, k]], axis=1)
        table(tmp_path / f"{trial}{joint}.csv", values, ["time", "position[rad]", "command_position[rad]"])
    found = put_together(sorted(tmp_path.glob("*.csv")), joints)
    assert isinstance(found, tuple)
    assert list(found[0].first) == joints and list(found[0].patterns) == joints
    others = [tmp_path / f"{trial}{joint}.csv" for joint in joints]
    assert put_together(others, ["a", *joints[1:]]) is None
