"""Torques that are several, have no name, no gain or another scale: none of it passes in silence."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import measurement_files as samples
import numpy as np
import pandas as pd
import pytest

from ee_dist.measurements.need import torques_needed
from ee_dist.measurements.proposal.files import proposal_for
from ee_dist.measurements.proposal.model import FIT, Hints, Proposal
from ee_dist.robots.describe import load_robot
from ee_dist.robots.model import Robot

SENSORS = "sensors:\n" + "".join(
    f"  - {{name: {j}_{kind}, kind: {kind}, target: {j}}}\n" for kind in ("position", "torque") for j in samples.JOINTS
)


def robot_of(folder: Path, sensors: str = "") -> Robot:
    file = samples.robot_file(folder)
    file.write_text(file.read_text() + sensors)
    return load_robot(file)[0]


def log(robot: Robot, **more: float | tuple[float, ...]) -> pd.DataFrame:
    """Positions, commands and, for each word, torques that are so many times what the motion needs, with noise."""
    m, rng = samples.motion(), np.random.default_rng(1)
    needed = torques_needed(robot, m["q"], samples.STEP_S)
    assert needed is not None
    found: dict[str, Any] = {"t": m["t"]}
    for word, values in (("q", m["q"]), ("cmd", m["g"])):
        found |= {f"{word}{k + 1}": values[:, k] for k in range(2)}
    for word, times in more.items():
        values = needed[0] * times + rng.normal(scale=0.01, size=m["q"].shape) * np.abs(times)
        found |= {f"{word}{k + 1}": values[:, k] for k in range(2)}
    return pd.DataFrame(found)


def proposed(folder: Path, robot: Robot, frame: pd.DataFrame, header: bool = True, **hints: Any) -> Proposal:
    frame.to_csv(folder / "log.csv", index=False, header=header)
    return proposal_for([folder / "log.csv"], robot, Hints(**hints))


def noisy(frame: pd.DataFrame) -> pd.DataFrame:
    """Positions with the noise that tells them from a plan."""
    noise = np.random.default_rng(1).normal(scale=1e-4, size=(len(frame), 2))
    return frame.assign(**{f"q{k + 1}": frame[f"q{k + 1}"] + noise[:, k] for k in range(2)})


def torques(proposal: Proposal) -> list[dict[str, Any]]:
    return [c.entry or {} for c in proposal.choices if c.group == "torques"]


def test_torques_of_which_none_is_clearly_the_one_are_named(tmp_path: Path) -> None:
    robot = robot_of(tmp_path)
    found = proposed(tmp_path, robot, log(robot, tau=1.0, TorqueSm=0.5))
    assert not torques(found) and not found.questions
    (told,) = [n for n in found.notes if n.startswith("torques: ")]
    assert "tau1, tau2 (1 times what the motion needs) or TorqueSm1, TorqueSm2 (0.5 times" in told
    without = log(robot, tau=1.0, TorqueSm=0.5).drop(columns=["cmd1", "cmd2"])
    assert any("tau1, tau2 (1 times" in q for q in proposed(tmp_path, robot, without).questions)


def test_torques_without_a_name_are_found_by_what_the_motion_needs_and_commands_are_none(tmp_path: Path) -> None:
    robot = robot_of(tmp_path)
    frame = log(robot, tau=1.0)
    frame = noisy(frame)
    for hints in ({}, {"gains": (1.0, 1.0)}):
        found = proposed(tmp_path, robot, frame, header=False, joints=samples.JOINTS, **hints)
        assert [e["column"] for e in torques(found)] == ["6", "7"]
        assert [(c.entry or {})["column"] for c in found.choices if c.group == "commands"] == ["4", "5"]


def test_numbers_without_a_name_that_go_with_the_need_but_are_not_as_large_are_told(tmp_path: Path) -> None:
    robot = robot_of(tmp_path)
    found = proposed(tmp_path, robot, noisy(log(robot, tau=0.05)), header=False, joints=samples.JOINTS)
    assert not torques(found)
    assert any("6, 7 go with the torques" in n and "task.gains" in n for n in found.notes)


def test_gains_are_those_of_columns_called_efforts(tmp_path: Path) -> None:
    robot = robot_of(tmp_path, SENSORS)
    frame = log(robot, effort=(0.1, -0.2))
    asked = proposed(tmp_path, robot, frame)
    assert any(
        "effort1, effort2 are 0.099 (shoulder), -0.2 (elbow) times what the motion needs" in q for q in asked.questions
    )
    found = proposed(tmp_path, robot, frame, gains=(10.0, -5.0))
    assert not found.questions and not [n for n in found.notes if "torques" in n or "gains" in n]
    assert [e["scale"] for e in torques(found)] == [10.0, -5.0] and not any("sign" in e for e in torques(found))
    estimated = torques(proposed(tmp_path, robot, frame, gains=FIT))
    assert [e["scale"] * e.get("sign", 1) for e in estimated] == pytest.approx([10.0, -5.0], rel=0.02)


def test_gains_are_not_applied_where_a_name_says_newton_metres(tmp_path: Path) -> None:
    robot = robot_of(tmp_path)
    frame = log(robot, tau=1.0).rename(columns={"tau1": "tau1_Nm", "tau2": "tau2_Nm"})
    found = proposed(tmp_path, robot, frame, gains=(10.0, 5.0))
    assert not any("scale" in e for e in torques(found))
    assert any("applied to nothing" in n for n in found.notes)


def test_currents_whose_gains_cannot_all_be_estimated_are_not_said_to_be_unknown(tmp_path: Path) -> None:
    robot = robot_of(tmp_path, SENSORS)
    frame = log(robot, current=5.0)
    frame["current2"] = np.random.default_rng(2).normal(size=len(frame))
    found = proposed(tmp_path, robot, frame, gains=FIT)
    (asked,) = (q for q in found.questions if "gains" in q)
    assert "the gains of elbow cannot be estimated" in asked and "estimated of the others: 0.2" in asked
    assert not any("applied to nothing" in n for n in found.notes)


def test_gains_beside_torques_that_were_measured_name_the_currents(tmp_path: Path) -> None:
    robot = robot_of(tmp_path, SENSORS)
    found = proposed(tmp_path, robot, log(robot, torque=1.0, current=5.0), gains=FIT)
    (told,) = (n for n in found.notes if "applied to nothing" in n)
    assert "torque1, torque2 are torques themselves; to have current1, current2 instead" in told


def test_a_robot_that_is_led_by_its_commands_is_told_of_torques_of_another_scale(tmp_path: Path) -> None:
    robot = robot_of(tmp_path)
    found = proposed(tmp_path, robot, log(robot, tau=0.1))
    assert not found.questions
    assert any("tau1, tau2 are 0.099 (shoulder), 0.1 (elbow) times" in n and "task.gains" in n for n in found.notes)


def test_a_joint_whose_torques_are_another_share_of_the_need_is_remarked(tmp_path: Path) -> None:
    robot = robot_of(tmp_path)
    (told,) = [n for n in proposed(tmp_path, robot, log(robot, tau=(0.58, 1.0))).notes if "torques: " in n]
    assert "tau1, tau2 are 0.58 (shoulder) times what the motion needs" in told and "those of others 1 (elbow)" in told
    assert not [n for n in proposed(tmp_path, robot, log(robot, tau=(0.9, 1.1))).notes if "torques: " in n]


def test_efforts_in_milliamperes_are_currents(tmp_path: Path) -> None:
    robot = robot_of(tmp_path)
    frame = log(robot, effort=1.0).rename(columns={f"effort{k}": f"effort{k}_mA" for k in (1, 2)})
    found = proposed(tmp_path, robot, frame)
    assert not torques(found) and not found.questions
    assert any(n.startswith("motor currents (effort1_mA, effort2_mA) are left out") for n in found.notes)
    alone = proposed(tmp_path, robot, frame.drop(columns=["cmd1", "cmd2"]))
    assert any("are motor currents; say task.gains" in q for q in alone.questions)


@pytest.mark.parametrize("times", [1.0, 1000.0])
def test_numbers_that_no_drive_could_give_are_no_newton_metres(tmp_path: Path, times: float) -> None:
    robot = robot_of(tmp_path)
    frame = log(robot, tau=times)
    led, alone = (proposed(tmp_path, robot, f) for f in (frame, frame.drop(columns=["cmd1", "cmd2"])))
    beyond = times > 1
    assert bool(torques(led)) is not beyond and not led.questions
    assert bool([n for n in led.notes if "where its drive gives 5 at most: no N.m, and left out" in n]) is beyond
    assert (
        bool([q for q in alone.questions if "where its drive gives 5 at most: currents? say task.gains" in q]) is beyond
    )
    # Limits that were guessed say nothing of it.
    guessed = replace(robot, assumed=tuple((j, "torque_limit") for j in robot.motor_names))
    assert not [n for n in proposed(tmp_path, guessed, frame).notes if "where its drive gives" in n]


def test_a_command_of_one_joint_alone_is_told_with_what_to_do(tmp_path: Path) -> None:
    robot = robot_of(tmp_path)
    frame = log(robot, tau=1.0)
    found = proposed(tmp_path, robot, frame.drop(columns=["cmd2"]))
    (told,) = [n for n in found.notes if n.startswith("no commands were found")]
    assert "cmd1: called commands, and not one for each drive" in told and "fixed_joints" in told
    (told,) = [
        n for n in proposed(tmp_path, robot, frame.drop(columns=["cmd1", "cmd2"])).notes if n.startswith("no commands")
    ]
    assert told.endswith("a balance of forces is the way to compare")
