"""task=import by the real command line: with a mapping, without one, and where a person has to say something."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import measurement_files as samples
import numpy as np
import odd_files
import pandas as pd
import pytest
import small_logs as logs

from ee_dist.recording.reader import read_run
from ee_dist.robots.agree import changed_sources

ROOT = Path(__file__).parents[2]
DATA = ROOT.parent / "shared" / "data"
Command = Callable[..., tuple[int, str, str]]


def test_a_file_without_a_mapping_becomes_a_recording(tmp_path: Path, command: Command) -> None:
    """The mapping that is written gives the same recording when it is named."""
    robot = samples.robot_file(tmp_path)
    log = samples.rosbag2_mcap(tmp_path)
    out = tmp_path / "out"
    status, said, _ = command(f"measured={log}", "robot=urdf", f"robot.drives={robot}", f"hydra.run.dir={out}")
    assert status == 0
    assert "Proposed mapping" in said
    *_, following = said.strip().splitlines()
    there = os.path.relpath(out / "measured.mcap", ROOT)
    assert following == f"Next: python -m ee_dist task=compare measured={there} engine=mujoco"
    first: dict[str, Any] = json.loads((out / "summary.json").read_text())
    assert first["mapping"] == "mapping.yaml"
    assert {p["sure"] for p in first["proposed"]} <= {"sure", "likely"}
    command(f"measured={log}", f"task.mapping={out / 'mapping.yaml'}", f"hydra.run.dir={tmp_path / 'again'}")
    second = json.loads((tmp_path / "again" / "summary.json").read_text())
    assert first["result_digest"] == second["result_digest"]
    kept = [read_run(d / "measured.mcap").metadata for d in (out, tmp_path / "again")]
    assert [changed_sources(m) for m in kept] == [(), ()]
    robot.write_text(robot.read_text() + "\n# another gear\n")
    for metadata in kept:
        (line,) = changed_sources(metadata)
        assert str(robot) in line and "has changed since the import" in line


def test_what_a_description_is_to_say_first_makes_another_proposal(tmp_path: Path, command: Command) -> None:
    """The mapping that was written knows nothing of it."""
    m = samples.motion()
    frame = pd.DataFrame({"time_s": m["t"], "shoulder_position": m["q"][:, 0], "shoulder_effort": np.sin(m["t"])})
    given = (f"measured={logs.written(tmp_path, frame)}", "robot=urdf", f"robot.drives={samples.robot_file(tmp_path)}")
    status, _, complaint = command(*given, f"hydra.run.dir={tmp_path / 'out'}")
    assert status == 2
    assert "fixed_joints: {elbow: 0.0}" in complaint and complaint.rstrip().endswith("; then the same again")


def test_a_log_of_a_servo_drive_comes_in_at_five_kilohertz_or_at_the_rate_that_is_asked_for(
    tmp_path: Path, command: Command
) -> None:
    """Finer rows than the model's steps would ask for become its steps: every verb wants them to be the same."""
    t = np.arange(15_000) / 5000.0
    goals, positions = (0.4 * np.stack([np.sin(3 * s), np.cos(2 * s)], axis=1) for s in (t, t - 0.04))
    frame = logs.frame_of(t, positions, goals).rename(columns={"time": "time_s"})
    file, robot = logs.written(tmp_path, frame), samples.robot_file(tmp_path)
    given = (f"measured={file}", "robot=urdf", f"robot.drives={robot}")
    status, _, complaint = command(*given, f"hydra.run.dir={tmp_path / 'out'}")
    assert status == 0, complaint
    usual = read_run(tmp_path / "out" / "measured.mcap")
    mapping = tmp_path / "out" / "mapping.yaml"
    mapping.write_text(mapping.read_text() + "rate_hz: 2500\n")
    status, said, _ = command(*given, f"task.mapping={mapping}", f"hydra.run.dir={tmp_path / 'fine'}")
    assert status == 0 and "is stepped every 0.0004 s" in said
    fine = read_run(tmp_path / "fine" / "measured.mcap")
    for run, step_s in ((usual, usual.robot.time_step_s), (fine, 0.0004)):
        assert run.robot.time_step_s == step_s
        assert np.diff(run.trials[0].log.times_s) == pytest.approx(step_s)
    assert usual.robot.time_step_s > 0.0004


def test_what_no_file_can_say_is_asked_in_one_line(tmp_path: Path, command: Command) -> None:
    case = next(c for c in odd_files.cases() if c.name == "currents without a gain")
    (file,) = case.write(tmp_path)
    (tmp_path / "arm.yaml").write_text(
        odd_files.ARM.read_text().replace("arm.urdf", str(odd_files.ARM.parent / "arm.urdf"))
    )
    given = (
        f"measured={file}",
        "robot=urdf",
        f"robot.drives={tmp_path / 'arm.yaml'}",
    )
    status, _, said = command(*given, f"hydra.run.dir={tmp_path / 'out'}")
    assert status == 2
    assert len(said.strip().splitlines()) == 1
    assert "current1 to current3 are motor currents; say task.gains=[N.m per A, one for each joint]" in said
    assert "???" in (tmp_path / "out" / "mapping.yaml").read_text()
    assert not (tmp_path / "out" / "measured.mcap").exists()
    command(*given, "task.gains=[0.2,0.2,0.2]", f"hydra.run.dir={tmp_path / 'again'}")
    assert (tmp_path / "again" / "measured.mcap").exists()


def test_all_that_is_to_be_said_stands_in_the_terminal_once(tmp_path: Path, command: Command) -> None:
    """No time, and drives that obey positions where the description has torques."""
    m = samples.motion()
    names = ("pos_{}", m["q"]), ("vel_{}", m["w"]), ("goal_{}", m["g"])
    frame = pd.DataFrame({n.format(j): v[:, k] for n, v in names for k, j in enumerate(samples.JOINTS)})
    robot = samples.robot_file(tmp_path)
    robot.write_text(robot.read_text().replace("kp: 20", "command: torque"))
    given = (f"measured={logs.written(tmp_path, frame)}", "robot=urdf", f"robot.drives={robot}")
    status, said, complaint = command(*given, f"hydra.run.dir={tmp_path / 'out'}")
    assert status == 2 and len(complaint.strip().splitlines()) == 1
    assert "what the file cannot say (and 1 more, above): no column rises like a time" in complaint
    (line,) = (x for x in said.splitlines() if x.startswith("to be said, too: "))
    assert "the robot's description has 'command: position' with kp and kd" in line and line not in complaint


@pytest.mark.skipif(not (DATA / "double_pendulum").is_dir(), reason="the public data are not here")
def test_a_real_log_needs_no_mapping(tmp_path: Path, command: Command) -> None:
    """The double pendulum, with a robot that is not it: measured before filtered, nothing turned round in silence."""
    robot = samples.robot_file(tmp_path)
    log = DATA / "double_pendulum" / "20230629-143339.csv"
    out = tmp_path / "out"
    command(f"measured={log}", "robot=urdf", f"robot.drives={robot}", f"hydra.run.dir={out}")
    text = (out / "mapping.yaml").read_text()
    assert "position_shoulder: {column: pos_meas1, unit: rad}" in text
    assert "velocity_elbow: {column: vel_meas2" in text
    assert "elbow: {column: tau_meas2" in text
    assert "sign: -1}" not in text


@pytest.mark.skipif(not (DATA / "emps").is_dir(), reason="the public data are not here")
def test_a_real_stage_is_the_same_with_and_without_a_mapping(tmp_path: Path, command: Command) -> None:
    from ee_dist.recording.reader import read_logs

    log = DATA / "emps" / "train.csv"
    command(f"measured={log}", "robot=linear_stage", f"hydra.run.dir={tmp_path / 'a'}")
    command(f"measured={log}", "task.mapping=docs/examples/emps.yaml", f"hydra.run.dir={tmp_path / 'b'}")
    (a,), (b,) = (read_logs(tmp_path / n / "measured.mcap") for n in "ab")
    assert np.array_equal(a.log.sensors, b.log.sensors)
    assert np.array_equal(a.log.commands, b.log.commands)


def test_a_stop_that_the_log_passes_is_suspicious_and_stands_in_no_comparison(tmp_path: Path, command: Command) -> None:
    """The import says so, and the model's joint follows its robot to where the description has a wall."""
    described = samples.robot_file(tmp_path)
    urdf = tmp_path / "chain.urdf"
    first = '<limit lower="-1.7" upper="1.7"'
    assert first in urdf.read_text()
    log = samples.rosbag2_mcap(tmp_path)
    errors = []
    for upper in ("1.7", "0.1"):
        urdf.write_text(urdf.read_text().replace(first, f'<limit lower="-1.7" upper="{upper}"', 1))
        out = tmp_path / upper
        status, said, _ = command(
            f"measured={log}", "robot=urdf", f"robot.drives={described}", f"hydra.run.dir={out / 'in'}"
        )
        assert (status, "beyond the stop" in said) == (0, upper == "0.1")
        compared = (f"measured={out / 'in'}", "engine=mujoco", "evaluator=serial", f"hydra.run.dir={out / 'off'}")
        status, said, _ = command("task=compare", *compared)
        found = json.loads((out / "off" / "summary.json").read_text())
        assert status == 0 and any("beyond the stop at 0.1" in w for w in found["words"]) == (upper == "0.1")
        errors.append(found["error"])
    assert errors[1] == pytest.approx(errors[0], rel=0.02)


def test_the_recording_has_the_gains_of_the_log_where_the_description_only_assumed_some(
    tmp_path: Path, command: Command
) -> None:
    """By the mapping that is written, too; and not where its line is taken out."""
    described = samples.robot_file(tmp_path)
    text = described.read_text().replace("kp: 20,", "kp: 90, kd: 0.5, assumed: [kp, rotor_inertia],")
    described.write_text(text)
    log = samples.csv(tmp_path)
    lines = log.read_text().splitlines()
    log.write_text("\n".join([f"{lines[0]},kp", *(f"{line},30" for line in lines[1:])]) + "\n")
    status, said, _ = command(
        f"measured={log}", "robot=urdf", f"robot.drives={described}", f"hydra.run.dir={tmp_path / 'out'}"
    )
    assert status == 0 and "the log states kp 30, where the description only assumes kp 90" in said
    mapping = tmp_path / "out" / "mapping.yaml"
    without = tmp_path / "without.yaml"
    without.write_text("\n".join(line for line in mapping.read_text().splitlines() if not line.startswith("gains:")))
    for name, used in (("again", mapping), ("without", without)):
        command(f"measured={log}", f"task.mapping={used}", f"hydra.run.dir={tmp_path / name}")
    robots = [read_run(tmp_path / d / "measured.mcap").robot for d in ("out", "again", "without")]
    assert [{d.kp for d in r.drives} for r in robots] == [{30.0}, {30.0}, {90.0}]
    assert [r.assumed_joints("kp") for r in robots] == [(), (), samples.JOINTS]
    assert all(r.assumed_joints("rotor_inertia") == samples.JOINTS for r in robots)
