"""What switches the drives, what switches something else, and what a name says is of now."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import small_logs as logs
from measurement_files import motion

from ee_dist.measurements.proposal.words import CURRENT, POSITION, SPEED, read_name


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
