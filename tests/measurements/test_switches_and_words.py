"""What switches the drives, what switches something else, and what a name says is of now."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import small_logs as logs
from measurement_files import STEP_S, motion, robot_file

from ee_dist.measurements.need import torques_needed
from ee_dist.measurements.proposal.files import proposal_for
from ee_dist.measurements.proposal.model import FIT, Hints
from ee_dist.measurements.proposal.words import CURRENT, POSITION, SPEED, read_name
from ee_dist.robots.describe import load_robot


@pytest.mark.parametrize(
    ("name", "values", "used"),
    [
        ("enabled", [True, False], True),
        ("drives_on", [1, 0], True),
        ("estop_active", [0, 0], False),
        ("vacuum_on", [0, 1], False),
        ("gripper_enabled", [False, True], False),
    ],
)
def test_only_what_switches_the_drives_tells_when_they_obey(
    tmp_path: Path, name: str, values: list[int], used: bool
) -> None:
    m = motion()
    frame = logs.frame_of(m["t"], m["q"], m["g"])
    frame[name] = np.repeat(values, len(m["t"]) // 2)
    log, _ = logs.imported(tmp_path, logs.written(tmp_path, frame))
    assert int(np.isnan(log.commands[:, 0]).sum()) == (200 if used else 0)


@pytest.mark.parametrize(
    ("name", "kind", "measured"),
    [
        ("current_position_elbow", POSITION, True),
        ("elbow_curr_pos", POSITION, True),
        ("current_velocity_2", SPEED, True),
        ("elbow_current", CURRENT, False),
        ("present_current_2", CURRENT, True),
        ("current_q", CURRENT, False),
    ],
)
def test_current_before_a_quantity_is_of_now(name: str, kind: str, measured: bool) -> None:
    found = read_name(name)
    assert (found.kind, found.command is False) == (kind, measured)


def test_current_positions_are_positions(tmp_path: Path) -> None:
    m = motion()
    frame = logs.frame_of(m["t"], m["q"], m["g"], "{what}_position_{joint}", what=("current", "target"))
    log, _ = logs.imported(tmp_path, logs.written(tmp_path, frame))
    assert np.allclose(log.sensors[:, :2], m["q"])


@pytest.mark.parametrize(
    ("name", "command", "unit"),
    [("i1_A", None, "A"), ("i_ref1_A", True, "A"), ("i_2_A", None, "A"), ("i_a", None, None)],
)
def test_an_i_with_amperes_is_a_current(name: str, command: bool | None, unit: str | None) -> None:
    found = read_name(name)
    assert (found.kind, found.command, found.unit) == (CURRENT, command, unit)
    assert found.weak == (unit is None)


def test_currents_that_were_measured_are_taken_not_those_that_were_asked_for(tmp_path: Path) -> None:
    m = motion()
    robot, _ = load_robot(robot_file(tmp_path))
    frame = logs.frame_of(m["t"], m["q"], m["g"])
    needed = torques_needed(robot, m["q"], STEP_S)
    assert needed is not None
    noise = np.random.default_rng(0).normal(scale=0.01, size=m["q"].shape)
    for k in range(2):
        frame[f"i_ref{k + 1}_A"] = needed[0][:, k] / 0.2
        frame[f"i{k + 1}_A"] = needed[0][:, k] / 0.2 + noise[:, k]
    proposal = proposal_for([logs.written(tmp_path, frame)], robot, Hints(gains=[0.2, 0.2]))
    assert [c.column for c in proposal.choices if c.group == "torques"] == ["i1_A", "i2_A"]
    assert not any("applied to nothing" in n for n in proposal.notes)


def test_gains_that_are_applied_to_nothing_are_told(tmp_path: Path) -> None:
    m = motion()
    robot, _ = load_robot(robot_file(tmp_path))
    file = logs.written(tmp_path, logs.frame_of(m["t"], m["q"], m["g"]))
    proposal = proposal_for([file], robot, Hints(gains=[0.2, 0.2]))
    assert [n for n in proposal.notes if "task.gains: applied to nothing" in n]


def counts(tmp_path: Path) -> Path:
    """Positions in counts of an encoder, 544 to a turn, with speeds in rad/s and currents beside them."""
    m = motion()
    robot, _ = load_robot(robot_file(tmp_path))
    needed = torques_needed(robot, m["q"], STEP_S)
    assert needed is not None
    of_a_count = 2 * np.pi / 544
    frame = {"t": m["t"]} | {f"position{k + 1}": np.round(20 * m["q"][:, k] / of_a_count) for k in range(2)}
    frame |= {f"speed{k + 1}": 20 * np.gradient(m["q"][:, k], m["t"]) for k in range(2)}
    frame |= {f"current{k + 1}": needed[0][:, k] / 0.2 for k in range(2)}
    return logs.written(tmp_path, pd.DataFrame(frame))


def test_speeds_tell_what_a_count_of_the_positions_is(tmp_path: Path) -> None:
    robot, _ = load_robot(robot_file(tmp_path))
    proposal = proposal_for([counts(tmp_path)], robot, Hints(gains=FIT))
    (why,) = {c.why for c in proposal.choices if c.column.startswith("speed")}
    scale = float(re.search(r"scale: ([0-9.e-]+)'", why)[1])  # type: ignore[index]
    assert scale == pytest.approx(2 * np.pi / 544, rel=0.01)
    (asked,) = (q for q in proposal.questions if q.startswith("positions"))
    assert asked.endswith("into the mapping, with what one count is") and "task.unit" not in asked
    assert any("not applied yet" in n for n in proposal.notes)
    assert not any("applied to nothing" in n for n in proposal.notes)


LATE = 14
"""Rows by which a sensor of speed that filters comes late: the signal alone no longer tells it."""


def test_qd_is_a_speed_where_it_goes_with_the_change_and_what_was_desired_where_it_does_not(tmp_path: Path) -> None:
    m = motion()
    robot, _ = load_robot(robot_file(tmp_path))
    rate = np.gradient(m["q"], m["t"], axis=0)
    for qd, group in (
        (np.roll(rate, LATE, axis=0), "sensors"),
        (m["g"], "commands"),
    ):
        frame = (
            {"t": m["t"]} | {f"q{k + 1}": m["q"][:, k] for k in range(2)} | {f"qd{k + 1}": qd[:, k] for k in range(2)}
        )
        proposal = proposal_for([logs.written(tmp_path, pd.DataFrame(frame))], robot, Hints())
        assert {c.group for c in proposal.choices if c.column.startswith("qd")} == {group}


@pytest.mark.parametrize(
    ("name", "kind", "unit"),
    [
        ("timestamps", "time", None),
        ("stamps", "time", None),
        ("motor_amps", CURRENT, "A"),
        ("tau_amps", CURRENT, "A"),
        ("vel_mps", SPEED, "m/s"),
        ("slide_mmps", SPEED, "mm/s"),
        ("velradps", SPEED, "rad/s"),
    ],
)
def test_the_end_of_a_word_is_no_unit(name: str, kind: str, unit: str | None) -> None:
    found = read_name(name)
    assert (found.kind, found.unit) == (kind, unit)
