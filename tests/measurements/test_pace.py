"""Speeds that are not the change of their positions by one number at all joints: the time is off, or they are scaled."""

from __future__ import annotations

from pathlib import Path

import measurement_files as samples
import numpy as np
import pandas as pd
import pytest
import small_logs as logs

from ee_dist.measurements.importer import import_file
from ee_dist.measurements.mapping_file import read_mapping
from ee_dist.measurements.proposal.write import as_yaml
from ee_dist.measurements.speeds_beside import pace_suspicion, stall_suspicion

STEP_S = 0.01
T = np.arange(3000) * STEP_S
POSITION = np.stack([0.5 * np.sin(9 * T), 0.3 * np.sin(21 * T + 1), 0.4 * np.cos(37 * T)], axis=1)
SPEED = np.stack([4.5 * np.cos(9 * T), 6.3 * np.cos(21 * T + 1), -14.8 * np.sin(37 * T)], axis=1)


def said(speed: np.ndarray, position: np.ndarray = POSITION) -> str | None:
    return pace_suspicion(speed, position, STEP_S, 1 / STEP_S)


@pytest.mark.parametrize("ratio", [1.14, 1.07, 0.9, 0.46, 3.2])
def test_one_number_at_all_joints_is_told_with_both_explanations(ratio: float) -> None:
    note = said(ratio * SPEED)
    assert note is not None
    assert f"speeds: {ratio:.3g} times the change of the positions at 3 joints" in note
    assert f"rows would come at {100 * ratio:.4g} Hz, not 100" in note and "the speeds are scaled" in note


def test_what_agrees_differs_from_joint_to_joint_or_is_another_unit_is_not_told() -> None:
    assert said(SPEED) is None
    assert said(1.03 * SPEED) is None
    assert said(SPEED * [1.2, 0.85, 1.2]) is None
    assert said(SPEED * [1.0, 1.2, 1.2]) is None
    assert said(57.3 * SPEED) is None and said(9.55 * SPEED) is None  # told joint by joint
    assert said(-1.2 * SPEED) is None


def test_rounding_noise_lags_and_slow_joints_are_no_other_pace() -> None:
    rng = np.random.default_rng(0)
    assert said(np.round(SPEED / 3) * 3) is None
    assert said(SPEED, np.round(POSITION / 0.1) * 0.1) is None
    assert said(SPEED + 5 * rng.standard_normal(SPEED.shape)) is None
    slow = 0.01 * np.sin(0.3 * T)[:, None]
    assert said(0.003 * np.cos(0.3 * T)[:, None], np.round(slow / 0.002) * 0.002) is None
    # A filter of first order takes from the size as it delays.
    filtered = np.zeros_like(SPEED)
    for k in range(1, len(T)):
        filtered[k] = filtered[k - 1] + STEP_S / (0.03 + STEP_S) * (SPEED[k] - filtered[k - 1])
    assert said(filtered) is None
    assert said(SPEED[:2], POSITION[:2]) is None


def test_an_import_tells_it_once_and_does_not_say_that_speeds_agree(tmp_path: Path) -> None:
    m = samples.motion()
    frame = {"t": m["t"]} | {f"{k}{j}": m[k][:, j] * (1.2 if k == "w" else 1.0) for k in "qwg" for j in (0, 1)}
    file = logs.written(tmp_path, pd.DataFrame(frame))
    _, report = logs.imported(tmp_path, file)
    (line,) = (s for s in report.suspicious if s.startswith("speeds: "))
    assert "1.2 times" in line and "120 Hz, not 100" in line
    _, proposal = logs.proposed(tmp_path, file)
    assert not any("speeds agree" in c.why for c in proposal.choices)


def test_speeds_that_are_estimated_are_of_that_pace(tmp_path: Path) -> None:
    m = samples.motion()
    frame = pd.DataFrame({"t": m["t"]} | {f"{k}{j}": m[k][:, j] for k in "qg" for j in (0, 1)})
    _, report = logs.imported(tmp_path, logs.written(tmp_path, frame))
    assert not any("speeds" in s for s in report.suspicious)


def test_a_logger_that_stood_still_is_told_and_not_its_speeds() -> None:
    at = T + 0.08 * np.floor(T / 0.5)  # every fiftieth row is nine times as late
    position, speed = (np.stack([np.interp(at, T, c) for c in values.T], axis=1) for values in (POSITION, SPEED))
    rows = slice(0, 1600)
    note = stall_suspicion(speed[rows], position[rows], STEP_S)
    assert note is not None and note.startswith("time: at ") and "the logger stood still" in note
    assert stall_suspicion(SPEED, POSITION, STEP_S) is None
    assert stall_suspicion(1.2 * SPEED, POSITION, STEP_S) is None
    noisy = POSITION + 1e-3 * np.random.default_rng(0).standard_normal(POSITION.shape)
    assert stall_suspicion(SPEED, noisy, STEP_S) is None


def test_a_joint_that_goes_far_and_agrees_is_believed_before_those_that_shake() -> None:
    at = T + 0.08 * np.floor(T / 0.5)
    late = [0.05 * np.stack([np.interp(at, T, c) for c in v[:, 1:].T], axis=1)[:1600] for v in (SPEED, POSITION)]
    assert stall_suspicion(*late, STEP_S) is not None, "by themselves they say that it stood still"
    speed, position = (np.hstack([v[:1600, :1], shaking]) for v, shaking in zip((SPEED, POSITION), late, strict=True))
    assert stall_suspicion(speed, position, STEP_S) is None


@pytest.mark.parametrize(("way", "told"), [(0.0015, False), (0.2, True)])
def test_a_joint_that_shakes_with_another_tells_nothing_of_its_speeds(tmp_path: Path, way: float, told: bool) -> None:
    """Links bend: what the other end of a joint does is not what its encoder says."""
    m = samples.motion()
    q, w = m["q"].copy(), m["w"].copy()
    q[:, 1], w[:, 1] = way * np.cos(9 * m["t"]), -0.4 * way * 9 * np.sin(9 * m["t"])
    frame = {"t": m["t"]} | {f"{k}{j}": v[:, j] for k, v in (("q", q), ("w", w), ("g", m["g"])) for j in (0, 1)}
    robot, proposal = logs.proposed(tmp_path, samples.csv(tmp_path))
    (tmp_path / "mapping.yaml").write_text(as_yaml(proposal, None, "log"))
    file = logs.written(tmp_path, pd.DataFrame(frame))
    _, report = import_file(file, read_mapping(tmp_path / "mapping.yaml"), robot)
    assert any("times the change of its position" in s for s in report.suspicious) == told


def test_speeds_that_are_off_in_quick_motion_alone_are_no_other_pace() -> None:
    """A clock that is off is off over seconds too; what goes to and fro between two readings is not."""
    slow, quick = 2.0 * np.sin(0.8 * T)[:, None], 0.12 * np.sin(21 * T)[:, None]
    speed = 1.6 * np.cos(0.8 * T)[:, None], 2.52 * np.cos(21 * T)[:, None]
    assert said(speed[0] + 1.3 * speed[1], slow + quick) is None
    assert said(1.2 * (speed[0] + speed[1]), slow + quick) is not None
