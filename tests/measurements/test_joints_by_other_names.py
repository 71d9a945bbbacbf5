"""A log may call the joints otherwise than the robot's description does: it is asked which is which, once."""

from __future__ import annotations

from pathlib import Path

import measurement_files as samples
import numpy as np
import pandas as pd
import pytest

from ee_dist.measurements.importer import import_files
from ee_dist.measurements.mapping_file import read_mapping
from ee_dist.measurements.proposal.files import proposal_for
from ee_dist.measurements.proposal.model import Hints
from ee_dist.measurements.proposal.other_names import other_names
from ee_dist.measurements.proposal.write import as_yaml, rows
from ee_dist.robots.describe import load_robot
from ee_dist.robots.model import Robot

CALLED = ("hip", "knee")
LAYOUTS = (("{}_meas_pos", "{}_des_pos"), ("measured_{}_angle_store", "desired_{}_angle_store"))


def log_of(folder: Path, layout: tuple[str, str], idle: bool = False) -> tuple[Robot, Path]:
    """A chain of shoulder and elbow, and a file that calls them hip and knee; ``idle``: nothing drives the first."""
    path, m = samples.robot_file(folder), samples.motion()
    if idle:
        path.write_text(path.read_text().replace("shoulder: {kp: 20, speed_limit: 8}", "shoulder: {command: none}"))
    robot, _ = load_robot(path)
    frame = pd.DataFrame({"meas_time": m["t"]})
    for name, values in zip(layout, (m["q"], m["g"]), strict=True):
        frame = frame.assign(**{name.format(c): values[:, k] for k, c in enumerate(CALLED)})
    frame = frame.assign(imu_pos=m["q"].sum(axis=1), gain_1=1.0)
    frame.to_csv(folder / "run.csv", index=False)
    return robot, folder / "run.csv"


@pytest.mark.parametrize("layout", LAYOUTS)
def test_it_is_said_what_the_columns_call_the_joints(tmp_path: Path, layout: tuple[str, str]) -> None:
    robot, file = log_of(tmp_path, layout)
    (question,) = proposal_for([file], robot, Hints()).questions
    assert question.startswith("positions: the columns call the joints hip, knee; which are these of shoulder, elbow?")


@pytest.mark.parametrize("idle", [False, True])
@pytest.mark.parametrize("order", [["shoulder", "elbow"], ["elbow", "shoulder"]])
@pytest.mark.parametrize("layout", LAYOUTS)
def test_the_order_of_the_joints_is_all_that_is_needed(
    tmp_path: Path, layout: tuple[str, str], order: list[str], idle: bool
) -> None:
    robot, file = log_of(tmp_path, layout, idle)
    proposal = proposal_for([file], robot, Hints(joints=order))
    assert not proposal.questions, proposal.questions
    (tmp_path / "mapping.yaml").write_text(as_yaml(proposal, str(tmp_path / "chain.yaml"), "run"))
    ((record, _),) = import_files([file], read_mapping(tmp_path / "mapping.yaml"), robot)
    m = samples.motion()
    places = [order.index(j) for j in robot.motor_names]
    assert record.log.joints == pytest.approx(m["q"][:, places], abs=1e-9)
    asked = m["g"][:, places] * (np.array([0.0, 1.0]) if idle else 1.0)
    assert record.log.commands == pytest.approx(asked, abs=1e-9)


def test_what_a_joint_without_a_drive_was_to_do_is_no_command_of_the_other(tmp_path: Path) -> None:
    """A planner writes down what it wants of all joints, also of those that swing freely."""
    robot, file = log_of(tmp_path, ("{}_meas_pos", "{}_des_pos"), idle=True)
    frame = pd.read_csv(file)
    frame.rename(columns=lambda c: c.replace("hip", "shoulder").replace("knee", "elbow")).to_csv(file, index=False)
    proposal = proposal_for([file], robot, Hints())
    assert not proposal.questions, proposal.questions
    assert {c: columns for c, columns, *_ in rows(proposal)}["command of elbow"] == "elbow_des_pos"


@pytest.mark.parametrize("names", [("des_time", "meas_time"), ("t_ref", "time"), ("cmd_time", "actual_time")])
def test_the_time_of_a_plan_is_not_that_of_the_readings(tmp_path: Path, names: tuple[str, str]) -> None:
    robot, _ = load_robot(samples.robot_file(tmp_path))
    m = samples.motion()
    frame = pd.DataFrame({names[0]: m["t"] / 7, names[1]: m["t"]})
    for what, values in (("meas_pos", m["q"]), ("meas_vel", m["w"]), ("des_pos", m["g"])):
        frame = frame.assign(**{f"{j}_{what}": values[:, k] for k, j in enumerate(samples.JOINTS)})
    frame.to_csv(tmp_path / "run.csv", index=False)
    proposal = proposal_for([tmp_path / "run.csv"], robot, Hints())
    assert not proposal.questions, proposal.questions
    assert {c: columns for c, columns, *_ in rows(proposal)}["time"] == names[1]


def test_names_of_several_words_and_columns_beside_those_of_the_joints(tmp_path: Path) -> None:
    path, m = samples.robot_file(tmp_path), samples.motion()
    robot, _ = load_robot(path)
    frame = pd.DataFrame({"meas_time": m["t"]})
    for what, values in (("pos", m["q"]), ("cmd_pos", m["g"])):
        tool = values.sum(axis=1)[:, None]
        for name, column in zip(("fl_th", "fr_ca", "rl_tip"), np.hstack([values, tool]).T, strict=True):
            frame = frame.assign(**{f"{what}_{name}": column})
    frame.to_csv(tmp_path / "run.csv", index=False)
    (question,) = proposal_for([tmp_path / "run.csv"], robot, Hints()).questions
    assert question.startswith(
        "positions: the columns call the joints fl_th, fr_ca, rl_tip; which are these of shoulder, elbow?"
    )
    assert "'-' for what is none of them" in question
    found = proposal_for([tmp_path / "run.csv"], robot, Hints(["shoulder", "elbow", "-"]))
    assert not found.questions
    columns = {(c.group, c.name): c.column for c in found.choices}
    assert columns["sensors", "position_elbow"] == "pos_fr_ca" and columns["commands", "shoulder"] == "cmd_pos_fl_th"


def test_of_names_that_say_what_an_angle_is_called_the_quantity_stands_beside() -> None:
    names, columns = other_names(["tail_meas_pos", "phi_meas_pos", "tail_meas_vel", "phi_meas_vel", "k1", "k2"], 2)
    assert names == ("tail", "phi") and columns[0] == ["tail_meas_pos", "phi_meas_pos"]
    assert other_names(["theta", "phi"], 2) == ((), []), "two angles that are called nothing else"
