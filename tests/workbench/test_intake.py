"""What comes onto the bench from outside: dropped files, and runs that are still being written."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from ee_dist.robots.describe import robot_of
from ee_dist.tasks.config import Config, ConfigError, EngineConfig, RobotConfig
from ee_dist.viewing.story import diagnosed_after
from ee_dist.workbench.intake import Answers, Intake, options_of
from ee_dist.workbench.session import Session


@pytest.fixture
def intake(tmp_path):
    session = Session(Config(engine=EngineConfig("mujoco")), "auto", tmp_path / "bench")
    yield Intake(session)
    session.close()


def test_a_dropped_file_keeps_to_its_folder(intake):
    path = intake.place_for("../../.ssh/../ke ys.csv")
    assert path.parent == intake.session.folder / "dropped" and path.name == "ke ys.csv"


def test_a_dropped_csv_is_taken_in_and_compared(intake):
    path = intake.place_for("swing.csv")
    t = np.arange(0.0, 2.0, 0.004)
    rows = zip(t, 0.4 * np.sin(2 * t - 0.05), 0.4 * np.sin(2 * t), strict=True)
    path.write_text("time_s,position_rad,command_rad\n" + "\n".join(f"{a:.4f},{b:.6f},{c:.6f}" for a, b, c in rows))
    found = intake.propose(path, "servo_pendulum", Answers())
    assert any("position_rad" in r[1] for r in found.rows) and "position_rad" in found.text
    intake.take_in("servo_pendulum", Answers(), found.text)
    session = intake.session
    assert session.seen is not None and len(session.measured.trials) == 1
    assert "task=import" in session.commands[0] and "task=compare" in session.commands[1]


def test_what_is_typed_is_checked():
    assert options_of(Answers(joints="a, -", gains="1, 2.5", unit="deg")).gains == [1.0, 2.5]
    with pytest.raises(ConfigError, match="motor gains: expected numbers"):
        options_of(Answers(gains="strong"))


def test_a_run_is_followed_while_it_grows(recording, tmp_path):
    pytest.importorskip("nicegui", reason="needs the extra 'workbench'")
    from ee_dist.workbench.pages.recovery import Followed

    followed = Followed(tmp_path, tmp_path / "out")
    assert not followed.look() and "waiting" in followed.note
    part = tmp_path / "recovery.mcap.part"
    part.write_bytes(recording.read_bytes()[:64])
    assert not followed.look() and "looking again" in followed.note
    shutil.copy(recording, part)
    assert followed.look() and len(followed.run.trials) == 1 and not followed.look()


def test_a_csv_of_a_robot_from_a_file(tmp_path):
    """The robot of the command line is offered with its files, and named by the command that does it again."""
    examples = Path(__file__).parents[2] / "docs" / "examples"
    own = RobotConfig("urdf", drives=str(examples / "arm.yaml"))
    intake = Intake(Session(Config(robot=own, engine=EngineConfig("mujoco")), "auto", tmp_path / "bench"))
    path = intake.place_for("reach.csv")
    t = np.arange(0.0, 1.0, 0.01)
    joints = robot_of("urdf", None, own.drives)[0].motor_names
    columns = [
        f"{kind}_{j}_{unit}"
        for kind, unit in (("position", "rad"), ("torque", "nm"), ("command", "rad"))
        for j in joints
    ]
    swings = [0.2 * np.sin(2 * t + k) for k in range(len(columns))]
    np.savetxt(path, np.stack([t, *swings], axis=1), delimiter=",", header=",".join(["time_s", *columns]), comments="")
    found = intake.propose(path, "urdf", Answers())
    intake.take_in("urdf", Answers(), found.text)
    session = intake.session
    assert session.measured.robot.motor_names == joints
    assert "robot=urdf robot.drives=" in session.commands[0] and "arm.yaml" in session.commands[0]
    session.close()


def test_the_first_diagnosis_comes_after_the_change():
    assert [diagnosed_after(k) for k in range(3)] == ["after the change", "after trial 1", "after trial 2"]
