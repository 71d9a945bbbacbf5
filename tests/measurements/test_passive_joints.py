"""Joints that nothing drives have sensors, and no commands."""

from __future__ import annotations

from pathlib import Path

import measurement_files as samples
import numpy as np
import pandas as pd
import pytest
import small_logs as logs

from ee_dist.discrepancy.measured_trial import MeasuredTrial
from ee_dist.engines.drivers import Commands
from ee_dist.measurements.importer import import_files
from ee_dist.measurements.mapping_file import read_mapping
from ee_dist.measurements.proposal.files import proposal_for
from ee_dist.measurements.proposal.model import Hints
from ee_dist.measurements.proposal.write import as_yaml
from ee_dist.robots.describe import load_robot
from ee_dist.robots.model import Robot
from ee_dist.tasks.measurements import Measurements
from ee_dist.tasks.ways import way_of


@pytest.mark.parametrize("driven", samples.JOINTS)
@pytest.mark.parametrize(("command", "word"), [("kp: 20, speed_limit: 8", "goal"), ("command: torque", "torque_cmd")])
def test_a_passive_joint_needs_no_command(tmp_path: Path, driven: str, command: str, word: str) -> None:
    m, k = samples.motion(), samples.JOINTS.index(driven)
    path = samples.robot_file(tmp_path)
    rest = {j: f"{j}: {{{command if j == driven else 'command: none'}}}" for j in samples.JOINTS}
    text = path.read_text().split("drives:")[0]
    path.write_text(f"{text}drives:\n" + "".join(f"  {line}\n" for line in rest.values()))
    robot, _ = load_robot(path)
    frame = logs.frame_of(m["t"], m["q"], m["g"])
    frame = frame.drop(columns=[c for c in frame if "goal" in c]).assign(**{f"{driven}_{word}": m["g"][:, k]})
    file = logs.written(tmp_path, frame)
    proposal = proposal_for([file], robot, Hints())
    assert not proposal.questions, proposal.questions
    assert [c.name for c in proposal.choices if c.group == "commands"] == [driven]
    (tmp_path / "mapping.yaml").write_text(as_yaml(proposal, str(path), file.name))
    ((record, _),) = import_files([file], read_mapping(tmp_path / "mapping.yaml"), robot)
    assert np.allclose(record.log.commands[:, k], m["g"][:, k])
    assert (record.log.commands[:, 1 - k] == 0.0).all()


@pytest.mark.parametrize(
    "columns",
    [
        ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz"),
        ("Fx_N", "Fy_N", "Tz_Nm"),
        ("sensor_force_x", "sensor_force_y", "sensor_torque_z"),
        ("ft_sensor_torque",),
        ("wrist_wrench",),
    ],
)
def test_a_sensor_of_forces_is_no_command_of_the_one_joint_that_obeys_torques(
    tmp_path: Path, columns: tuple[str, ...]
) -> None:
    m, path = samples.motion(), samples.robot_file(tmp_path)
    driven, swings = samples.JOINTS
    text = path.read_text().split("drives:")[0]
    path.write_text(f"{text}drives:\n  {driven}: {{command: torque}}\n  {swings}: {{command: none}}\n")
    robot, _ = load_robot(path)
    frame = logs.frame_of(m["t"], m["q"], m["g"]).drop(columns=[f"{j}_goal_rad" for j in samples.JOINTS])
    for k, name in enumerate(columns):
        frame[name] = np.sin((2 + k) * m["t"])
    proposal = proposal_for([logs.written(tmp_path, frame)], robot, Hints())
    assert [c.column for c in proposal.choices if c.group == "commands"] == ["???"]
    assert not any(name in q for q in proposal.questions for name in columns)
    proposal = proposal_for([logs.written(tmp_path, frame.assign(torque=m["g"][:, 0]))], robot, Hints())
    assert [c.column for c in proposal.choices if c.group == "commands"] == ["torque"]


def nothing_driven(tmp_path: Path) -> tuple[Path, Robot, pd.DataFrame]:
    """The description of a robot whose joints all swing freely, that robot, and a log with goals of them."""
    m, path = samples.motion(), samples.robot_file(tmp_path)
    text = path.read_text().split("drives:")[0]
    path.write_text(f"{text}drives:\n" + "".join(f"  {j}: {{command: none}}\n" for j in samples.JOINTS))
    return path, load_robot(path)[0], logs.frame_of(m["t"], m["q"], m["g"])


def test_where_nothing_is_driven_a_log_of_positions_is_all_that_there_is(tmp_path: Path) -> None:
    path, robot, frame = nothing_driven(tmp_path)
    file = logs.written(tmp_path, frame.drop(columns=[c for c in frame if "goal" in c]))
    proposal = proposal_for([file], robot, Hints())
    assert not proposal.questions, proposal.questions
    (tmp_path / "mapping.yaml").write_text(as_yaml(proposal, str(path), file.name))
    ((record, _),) = import_files([file], read_mapping(tmp_path / "mapping.yaml"), robot)
    assert record.log.torques is None and record.log.joints is not None
    assert (record.log.commands == 0.0).all()
    trials = (MeasuredTrial(record.name, record.log, Commands(record.log.commands)),)
    measured = Measurements(robot, trials, (file,), (), robot, tmp_path)
    assert way_of(measured, "auto").name == "free_run"


def test_commands_that_no_joint_takes_are_said_to_be_left_out_with_what_would_be_right(tmp_path: Path) -> None:
    _, robot, frame = nothing_driven(tmp_path)
    goals = [c for c in frame if "goal" in c]
    file = logs.written(tmp_path, frame)
    (said,) = [n for n in proposal_for([file], robot, Hints()).notes if "takes commands" in n]
    assert said.startswith(f"{goals[0]}, {goals[1]}: called commands and left out, for no joint of {robot.name} takes")
    assert "robot.drives=FILE" in said and "command: position, kp: ..., kd: ..." in said
    without = logs.written(tmp_path, frame.drop(columns=goals))
    assert not any("takes commands" in n for n in proposal_for([without], robot, Hints()).notes)
