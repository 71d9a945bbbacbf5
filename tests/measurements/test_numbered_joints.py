"""Joints whose names differ by a number alone: columns of that name are theirs, wherever they stand."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import small_logs as logs

from ee_dist.measurements.proposal.model import LIKELY, SURE

CHAIN = ("joint_3", "joint_1", "joint_2")
T = np.arange(400) / 100


def wave(t: np.ndarray) -> np.ndarray:
    """Joints 1, 2 and 3, (T, 3)."""
    return np.stack([0.5 * np.sin(1.7 * t), 0.4 * np.cos(2.3 * t), 0.3 * np.sin(3.1 * t + 1)], axis=1)


@pytest.mark.parametrize("names", ["{joint}_{what}_rad", "{what}[{joint}]", "{what}_J{number}", "{what}[{joint}.pos]"])
def test_columns_go_to_the_joints_they_name(tmp_path: Path, names: str) -> None:
    called = names.replace("{number}", "{joint}")
    labels = tuple(j[-1] if "number" in names else j for j in sorted(CHAIN))
    file = logs.written(tmp_path, logs.frame_of(T, wave(T - 0.04), wave(T), called, labels))
    log, _ = logs.imported(tmp_path, file, CHAIN)
    assert np.allclose(log.sensors[:, :3], wave(T - 0.04)[:, [2, 0, 1]])
    assert np.allclose(log.commands, wave(T)[:, [2, 0, 1]])


def test_columns_that_count_from_0_are_ranked_and_not_sure(tmp_path: Path) -> None:
    file = logs.written(tmp_path, logs.frame_of(T, wave(T - 0.04), wave(T), joints=("joint_0", "joint_1", "joint_2")))
    _, proposal = logs.proposed(tmp_path, file, ("joint_1", "joint_2", "joint_3"))
    found = {c.name: ((c.entry or {})["column"], c.sure) for c in proposal.choices if c.name.startswith("position")}
    assert found == {f"position_joint_{k + 1}": (f"joint_{k}_pos_rad", LIKELY) for k in range(3)}


@pytest.mark.parametrize("robot", ["panda_joint", "fr3_joint", "joint"])
def test_joint_states_of_an_arm_with_numbered_joints(tmp_path: Path, robot: str) -> None:
    joints = tuple(f"{robot}{k}" for k in (1, 2, 3))
    seen = np.c_[wave(T - 0.04), np.full(len(T), 0.04)]
    file = logs.bag(
        tmp_path,
        {
            "/joint_states": logs.states(T, seen, (*joints, "panda_finger_joint1")),
            "/joint_command": logs.states(T, wave(T), joints),
        },
    )
    _, proposal = logs.proposed(tmp_path, file, joints)
    assert not proposal.questions
    found = {c.name: (c.entry or {}).get("column") for c in proposal.choices if c.group == "commands"}
    assert found == {j: f"position[{j}]" for j in joints}
    assert {c.sure for c in proposal.choices if c.name.startswith("position")} == {SURE}
    log, _ = logs.imported(tmp_path, file, joints)
    assert np.allclose(log.commands, wave(T))
