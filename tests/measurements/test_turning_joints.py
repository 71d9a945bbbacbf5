"""Angles of joints that turn on and on: counts of encoders, degrees, and what wraps."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import small_logs as logs

from ee_dist.measurements.importer import import_files
from ee_dist.measurements.mapping_file import mapping_of, read_mapping
from ee_dist.measurements.suspicious import suspicions
from ee_dist.measurements.units import TURN

T = np.arange(600) / 100


def wave(t: np.ndarray) -> np.ndarray:
    return np.stack([0.5 * np.sin(1.7 * t) + 0.2 * np.sin(4.1 * t), 0.4 * np.cos(2.3 * t)], axis=1)


def endless(urdf: str) -> str:
    return urdf.replace("revolute", "continuous").replace('lower="-1.7" upper="1.7" ', "")


def test_counts_of_an_encoder_are_asked_about(tmp_path: Path) -> None:
    counts = lambda x: np.round(2048 + x * 4096 / TURN).astype(int)  # noqa: E731
    frame = logs.frame_of(T, counts(wave(T - 0.05)), counts(wave(T)), "{what}_{joint}", what=("present", "goal"))
    frame = frame.rename(columns=lambda c: c.replace("present", "present_position").replace("goal", "goal_position"))
    file = logs.written(tmp_path, frame)
    robot, proposal = logs.proposed(tmp_path, file, change=endless)
    (asked,) = (q for q in proposal.questions if "counts" in q)
    entry = "unit: turn, scale: 0.000244140625, offset: -0.5"
    assert entry in asked
    mapping = f"""time: {{column: time, unit: s}}
sensors:
  position_shoulder: {{column: present_position_shoulder, {entry}}}
  position_elbow: {{column: present_position_elbow, {entry}}}
  velocity_shoulder: {{speed_of: position_shoulder, cutoff_hz: 20}}
  velocity_elbow: {{speed_of: position_elbow, cutoff_hz: 20}}
commands:
  shoulder: {{column: goal_position_shoulder, {entry}}}
  elbow: {{column: goal_position_elbow, {entry}}}
"""
    (tmp_path / "map.yaml").write_text(mapping)
    ((record, _),) = import_files([file], read_mapping(tmp_path / "map.yaml"), robot)
    assert record.log.commands == pytest.approx(wave(T), abs=TURN / 4096), "what is asked for is what cures it"


def test_degrees_of_a_joint_without_an_end_are_degrees(tmp_path: Path) -> None:
    angle = lambda t: np.degrees(3 * wave(t))  # noqa: E731
    file = logs.written(tmp_path, logs.frame_of(T, angle(T - 0.05), angle(T), "{joint}_{what}_deg"))
    log, _ = logs.imported(tmp_path, file, change=endless)
    assert np.allclose(log.commands, 3 * wave(T))


@pytest.mark.parametrize(("turn", "told"), [(360.0, True), (TURN, False)])
def test_an_angle_that_wraps_is_seen_in_its_own_unit(turn: float, told: bool) -> None:
    wrapped = (170 + 25 * np.sin(1.3 * T) + 180) % 360 - 180
    assert any("unwrap" in s for s in suspicions("q", wrapped, turn)) == told


def test_unwrapped_commands_are_on_the_turn_of_the_positions(tmp_path: Path) -> None:
    angle = lambda t: np.stack([178.5 + 25 * np.sin(1.3 * t), 40 * np.sin(2 * t)], axis=1)  # noqa: E731
    wrap = lambda x: (x + 180) % 360 - 180  # noqa: E731
    file = logs.written(tmp_path, logs.frame_of(T, wrap(angle(T - 0.08)), wrap(angle(T + 0.05)), "{joint}_{what}"))
    robot, _ = logs.proposed(tmp_path, file, change=endless)
    sensors = {
        f"position_{j}": {"column": f"{j}_pos", "unit": "deg", "unwrap": True, "sure": True}
        for j in ("shoulder", "elbow")
    } | {f"velocity_{j}": {"speed_of": f"position_{j}", "cutoff_hz": 20} for j in ("shoulder", "elbow")}
    commands = {j: {"column": f"{j}_goal", "unit": "deg", "unwrap": True} for j in ("shoulder", "elbow")}
    data = {"time": {"column": "time", "unit": "s"}, "sensors": sensors, "commands": commands}
    ((record, report),) = import_files([file], mapping_of(data, tmp_path / "map.yaml"), robot)
    assert np.abs(record.log.commands - record.log.sensors[:, :2]).max() < 0.5
    assert any("turns nearer to the positions" in d for d in report.done)
