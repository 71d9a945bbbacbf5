"""A folder for each motion as a servo bus is logged: commands and states in files of their own, lists in cells, one clock, a
gripper as a share of its range, and currents without a sign."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import measurement_files as samples
import numpy as np
import pandas as pd
import pytest

from ee_dist.measurements.alignment import one_clock
from ee_dist.measurements.importer import import_files
from ee_dist.measurements.mapping_file import read_mapping
from ee_dist.measurements.proposal.files import proposal_for
from ee_dist.measurements.proposal.model import Hints, Proposal
from ee_dist.measurements.proposal.words import role_of
from ee_dist.measurements.proposal.write import as_yaml
from ee_dist.robots.describe import load_robot

JOINTS = ("pan", "lift", "elbow", "gripper")
ROWS, STEP_S = 900, 0.02
SHARE = 2.3
"""Speed of the gripper in rad/s over the change of its position, which is a share of its range."""


def wave(t: np.ndarray) -> np.ndarray:
    return np.stack([0.4 * np.sin(w * t) + 0.1 * np.sin(2.3 * w * t + 1) for w in (1.1, 1.7, 2.1, 2.9)], axis=1)


def stamps(seed: int) -> np.ndarray:
    return np.arange(ROWS) * STEP_S + 1e-4 * np.random.default_rng(seed).uniform(0, 1, ROWS)


def write(folder: Path, seed: int = 0, signed: bool = False, shared: Sequence[int] = (3,)) -> list[Path]:
    """Two files: what was commanded, and positions, speeds and torques of all joints as lists."""
    folder.mkdir(exist_ok=True)
    t = stamps(seed)
    q, goal = wave(t - 0.05), wave(t)
    speed = np.gradient(q, t, axis=0)
    torque = np.gradient(speed, t, axis=0) * 0.05 + 0.2 * np.tanh(10 * speed)
    torque = torque if signed else np.abs(torque)
    for k in shared:
        speed[:, k] *= SHARE

    def lists(values: np.ndarray) -> list[str]:
        return [json.dumps([round(float(x), 5) for x in row]) for row in values]

    frames = {
        "control": {"timestamp": 1e6 * t, "positions": lists(goal)},
        "state_motor": {
            "timestamp": 1e6 * t,
            "positions": lists(q),
            "velocities": lists(speed),
            "torques": lists(torque),
        },
    }
    for name, columns in frames.items():
        pd.DataFrame(columns).to_csv(folder / f"{name}.csv", index=False)
    return sorted(folder.glob("*.csv"))


def proposed(tmp_path: Path, files: list[Path]) -> tuple[Proposal, Path]:
    described = samples.robot_file(tmp_path, JOINTS)
    robot, _ = load_robot(described)
    proposal = proposal_for(files, robot, Hints())
    path = tmp_path / "mapping.yaml"
    path.write_text(as_yaml(proposal, described.name, "log"))
    return proposal, path


def test_it_comes_in_without_a_question(tmp_path: Path) -> None:
    files = write(tmp_path / "run")
    proposal, path = proposed(tmp_path, files)
    assert not proposal.questions
    entries = {c.name: c.entry for c in proposal.choices if c.group == "sensors"}
    assert entries["velocity_lift"]["unit"] == "rad/s"
    assert entries["velocity_gripper"]["speed_of"] == "position_gripper", "a speed that no unit explains is not taken"
    assert not [c for c in proposal.choices if c.group == "torques"], "sizes without a sign balance no forces"
    assert any("never change sign" in n for n in proposal.notes)
    robot, _ = load_robot(tmp_path / "chain.yaml")
    ((record, _),) = import_files(files, read_mapping(path), robot)
    log = record.log
    gap = np.interp(log.times_s - 0.05, log.times_s, log.commands[:, 0]) - log.sensors[:, 0]
    assert np.abs(gap[log.times_s > 0.1]).max() < 0.02, (
        "the commands lead as they did: no lag was taken for another clock"
    )


def test_joints_that_all_go_as_one_factor_are_still_asked_about(tmp_path: Path) -> None:
    proposal, _ = proposed(tmp_path, write(tmp_path / "run", shared=(0, 1, 2, 3)))
    (question,) = [q for q in proposal.questions if "could not be checked" in q]
    assert "at all joints alike: the times may be" in question and "another rate: say task.rate_hz=" in question


def test_torques_with_a_sign_are_kept(tmp_path: Path) -> None:
    proposal, _ = proposed(tmp_path, write(tmp_path / "run", signed=True))
    assert [c for c in proposal.choices if c.group == "torques"]


def test_sizes_are_told_of_joints_that_rest_most_of_the_time(tmp_path: Path) -> None:
    """They go there in half a second, and back after twelve: what the motion needs is of both signs only while it goes on."""
    files = write(tmp_path / "run")
    t = np.arange(ROWS) * STEP_S
    place = 0.3 * (np.tanh(6 * (t - 3)) - np.tanh(6 * (t - 15)))
    for name, late_s in (("control", 0.0), ("state_motor", 0.05)):
        file = tmp_path / "run" / f"{name}.csv"
        table = pd.read_csv(file)
        q = np.interp(t - late_s, t, place)[:, None] * np.array([1, -1, 1, -1])  # the last link hangs straight down
        w = np.gradient(q, t, axis=0)
        table["positions"] = [json.dumps(row) for row in q.round(5).tolist()]
        if name == "state_motor":
            torque = np.abs(0.05 * np.gradient(w, t, axis=0) + 0.2 * np.tanh(10 * w))
            table["velocities"] = [json.dumps(row) for row in w.round(5).tolist()]
            table["torques"] = [json.dumps(row) for row in torque.round(5).tolist()]
        table.to_csv(file, index=False)
    proposal, _ = proposed(tmp_path, files)
    assert not [c for c in proposal.choices if c.group == "torques"]
    assert any("never change sign" in n for n in proposal.notes)


@pytest.mark.parametrize(
    ("other", "same"),
    [
        (lambda t: t, True),
        (lambda t: t[::3], True),
        (lambda t: t + 0.004, False),
        (lambda _: stamps(1), False),
    ],
)
def test_one_clock_is_told_by_its_uneven_stamps(other, same: bool) -> None:  # type: ignore[no-untyped-def]
    t = stamps(0)
    assert one_clock(t, other(t)) is same


def test_counted_stamps_prove_nothing() -> None:
    t = np.arange(ROWS) * STEP_S
    assert not one_clock(t, t), "each of two loggers may count from its own start"
    assert one_clock(0.171 + t, 0.173 + t), "records that begin and end together, and not when their clocks do"
    assert not one_clock(0.171 + t, 0.171 + 1.1 * t) and not one_clock(0.171 + t, 0.171 + t + 5 * STEP_S)


def pair(folder: Path, seed: int, late_s: float) -> list[Path]:
    """What was asked for and what was measured, in files with the same columns, the second with a clock of its own."""
    folder.mkdir(parents=True)
    rng = np.random.default_rng(seed)
    t = np.arange(ROWS) * STEP_S
    torque = sum(rng.uniform(0.2, 0.4) * np.sin(w * t + rng.uniform(0, 6)) for w in (1.3, 2.9, 4.7, 7.7))
    shown = np.interp(t + late_s, t, torque)
    angle = sum(0.3 * np.sin(w * t + k) for k, w in enumerate((1.1, 2.3)))
    for name, position, asked in (("desired", 0 * t, torque), ("measured", angle, shown)):
        frame = {"time": t, "position": position, "velocity": np.gradient(position, t), "torque": asked}
        pd.DataFrame(frame).to_csv(folder / f"data_{name}.csv", index=False)
    return sorted(folder.glob("*.csv"))


def test_what_was_asked_for_is_no_trial_beside_what_was_measured(tmp_path: Path) -> None:
    described = samples.robot_file(tmp_path, ("shoulder",))
    described.write_text(described.read_text().replace("kp: 20", "command: torque"))
    robot, _ = load_robot(described)
    files = [f for k in range(2) for f in pair(tmp_path / "raw" / f"run_{k}", k, 0.3)]
    proposal = proposal_for(files, robot, Hints())
    assert not proposal.questions
    columns = {
        c.name: (c.entry["table"], c.entry["column"]) for c in proposal.choices if c.group in ("sensors", "commands")
    }
    assert columns["position_shoulder"] == ("data_measured", "position")
    assert columns["shoulder"] == ("data_desired", "torque")
    path = tmp_path / "mapping.yaml"
    path.write_text(as_yaml(proposal, described.name, "log"))
    found = import_files(files, read_mapping(path), robot)
    assert [record.name for record, _ in found] == ["run_0", "run_1"]
    assert all(any("-0.3" in d and "added to its clock" in d for d in report.done) for _, report in found), (
        "by their torques"
    )


@pytest.mark.parametrize(
    ("name", "role"),
    [
        ("data_desired", True),
        ("state_motor", False),
        ("/arm/command", True),
        ("/control/joint_states", None),
        ("run_1", None),
    ],
)
def test_what_a_file_or_topic_is_called(name: str, role: bool | None) -> None:
    assert role_of(name) is role
