"""Torques may be known of some joints only: a wrist whose currents are empty stands in nobody's way."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import measurement_files as samples
import numpy as np
import pandas as pd
import pytest

from ee_dist.measurements.errors import MeasurementError
from ee_dist.measurements.importer import import_file
from ee_dist.measurements.mapping_file import mapping_of
from ee_dist.measurements.proposal.files import proposal_for
from ee_dist.measurements.proposal.model import Hints, Proposal
from ee_dist.measurements.proposal.write import as_yaml
from ee_dist.measurements.report import Report, describe
from ee_dist.recording.records import TrialRecord
from ee_dist.robots.describe import load_robot
from ee_dist.robots.inverse_dynamics import joint_torques

JOINTS = samples.JOINTS
THREE = ("pan", "lift", "wrist")


def read(folder: Path, torques: tuple[str, ...], empty: str = "", drive: str = "") -> tuple[TrialRecord, Report]:
    """A log of a chain without commands, imported with the torques of some joints; those of ``empty`` were never written."""
    robot, _ = load_robot(samples.robot_file(folder, JOINTS))
    t = np.arange(600) * robot.time_step_s
    frame = {"t": t}
    for k, j in enumerate(JOINTS):
        q = 0.3 * np.sin((3 + k) * t)
        frame |= {
            f"q_{j}": q,
            f"v_{j}": np.gradient(q, t),
            f"tau_{j}": np.cos(t) if j != empty else np.full(600, np.nan),
        }
    pd.DataFrame(frame).to_csv(folder / "log.csv", index=False)
    sensors = {
        s.name: {"column": f"{'q' if s.kind == 'position' else 'v'}_{s.target}", "unit": s.unit} for s in robot.sensors
    }
    columns = {j: {"column": f"tau_{j}", "unit": "N.m", "sure": True, "gaps": "interpolate"} for j in torques}
    mapping = mapping_of(
        {"time": {"column": "t", "unit": "s"}, "sensors": sensors, "torques": columns}, folder / "map.yaml"
    )
    return import_file(folder / "log.csv", mapping, robot)


def test_torques_of_some_joints_are_kept_and_the_others_said_not_to_be_known(tmp_path: Path) -> None:
    record, report = read(tmp_path, JOINTS[1:])
    assert record.log.torques is not None
    assert np.isnan(record.log.torques[:, 0]).all() and np.isfinite(record.log.torques[:, 1:]).all()
    assert np.isnan(record.log.commands).all()
    said = f"torques at {len(JOINTS) - 1} of {len(JOINTS)} joints"
    assert said in describe([report]) and f"those of {JOINTS[0]} are not known" in describe([report])
    assert not [n for n in read(tmp_path, JOINTS)[1].done if "are not known" in n]


def test_an_empty_column_may_be_left_out(tmp_path: Path) -> None:
    with pytest.raises(MeasurementError, match=f"cells are empty: leave out the torque of {JOINTS[0]}, which may stay"):
        read(tmp_path, JOINTS, empty=JOINTS[0])


def with_torques(folder: Path, name: str, of_last: float) -> Path:
    """A log of a hanging chain led by commands, with torques that its motion needs: those of the first joint turned, those of the
    last times a number."""
    robot, _ = load_robot(samples.robot_file(folder, THREE))
    t = np.arange(600) * 0.01
    way = lambda s: np.stack([0.3 * np.sin((2 + k) * s + k) for k in range(3)], axis=1)  # noqa: E731
    q = way(t - 0.02)
    w = np.gradient(q, t, axis=0)
    torques = joint_torques(robot, q, w, np.gradient(w, t, axis=0)) * np.array([-1.0, 1.0, of_last])
    frame = {"t": t}
    for what, values in {"pos": q, "vel": w, "goal": way(t), "torque": torques}.items():
        frame |= {f"{what}_{j}": values[:, k] for k, j in enumerate(THREE)}
    pd.DataFrame(frame).round(6).to_csv(folder / f"{name}.csv", index=False)
    return folder / f"{name}.csv"


def torques_proposed(folder: Path, of_last: tuple[float, ...], change: Callable[[str], str] = str) -> Proposal:
    files = [with_torques(folder, f"trial_{k}", size) for k, size in enumerate(of_last)]
    described = folder / "chain.yaml"
    described.write_text(change(described.read_text()))
    robot, _ = load_robot(described)
    return proposal_for(files, robot, Hints())


@pytest.mark.parametrize(("of_last", "every"), [((0.0,), "every row"), ((0.0, 0.0), "every row of all 2 trials")])
def test_torques_that_are_zero_all_through_are_left_out(tmp_path: Path, of_last: tuple[float, ...], every: str) -> None:
    found = torques_proposed(tmp_path, of_last)
    assert {c.name: c.entry is not None for c in found.choices if c.group == "torques"} == {
        "pan": True, "lift": True, "wrist": False,
    }  # fmt: skip
    assert f"left out, as it is 0 in {every}, and no torque was measured: torque_wrist" in found.notes
    assert "column: torque_wrist" not in as_yaml(found, "chain.yaml", "log")


def test_torques_of_a_joint_that_other_trials_have_are_kept(tmp_path: Path) -> None:
    found = torques_proposed(tmp_path, (0.0, 1.0))
    assert all(c.entry for c in found.choices if c.group == "torques")


def test_a_drive_that_obeys_torques_may_be_asked_for_none(tmp_path: Path) -> None:
    obeys = lambda text: re.sub(r"(wrist: \{)kp: 20", r"\1command: torque", text)  # noqa: E731
    found = torques_proposed(tmp_path, (0.0,), obeys)
    assert all(c.entry for c in found.choices if c.group == "torques" and c.name == "wrist")


def test_a_turned_sign_is_said_of_its_joint_alone(tmp_path: Path) -> None:
    found = torques_proposed(tmp_path, (1.0,))
    why = {c.name: c.why for c in found.choices if c.group == "torques"}
    assert why["pan"].endswith("sign turned: it was against what the motion needs")
    assert "sign" not in why["lift"] + why["wrist"]
