"""A recording of which something is missing is used as far as it is whole, and every verb says so."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ee_dist.discrepancy.measured_trial import driver_of
from ee_dist.engines.mujoco.engine import MuJoCoEngine
from ee_dist.evaluation.physical import PhysicalRobot
from ee_dist.recording.records import HARDWARE, TrialRecord
from ee_dist.recording.writer import RunWriter
from ee_dist.robots.servo_pendulum import servo_pendulum
from ee_dist.tasks.config import Config, EngineConfig, EvaluatorConfig
from ee_dist.tasks.measurements import load
from ee_dist.trials.excitation import Excitation
from ee_dist.trials.log import LogError
from ee_dist.trials.noise import with_noise

ROBOT = with_noise(servo_pendulum(), 0.005)
CONFIG = Config(engine=EngineConfig("mujoco", 1), evaluator=EvaluatorConfig("serial"))
MOTIONS = [Excitation(kind, 2.0, 0.4, 1) for kind in ("multisine", "steps")]


@pytest.fixture(scope="module")
def whole(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("log") / "trial.mcap"
    metadata = {"task": "trial", "seal": "0", "trials": json.dumps([m.as_dict() for m in MOTIONS])}
    robot = PhysicalRobot(MuJoCoEngine(1), ROBOT, (), np.random.SeedSequence(0))
    with RunWriter(path, ROBOT, metadata) as writer:
        for k, motion in enumerate(MOTIONS):
            driver = driver_of(motion, ROBOT)
            log = robot.trial(driver, motion.steps(ROBOT))
            writer.trial(TrialRecord(k, motion.kind, HARDWARE, driver, log))
        writer.finish({})
    return path


def loaded(path: Path):
    return load(replace(CONFIG, measured=str(path)))


def test_what_is_whole_of_a_cut_recording_is_used_and_that_is_said(whole: Path, tmp_path: Path) -> None:
    assert not any("not complete" in line for line in loaded(whole).remarks)
    cut, content = tmp_path / "cut.mcap", whole.read_bytes()
    cut.write_bytes(content[: int(0.75 * len(content))])
    found = loaded(cut)
    (line,) = [r for r in found.remarks if "is not complete" in r]
    assert [t.name for t in found.trials] == ["multisine"]
    assert str(cut) in line and "1 trial of 2 (multisine)" in line


def test_a_recording_without_a_whole_trial_is_told_to_be_cut(whole: Path, tmp_path: Path) -> None:
    cut, content = tmp_path / "cut.mcap", whole.read_bytes()
    cut.write_bytes(content[: int(0.4 * len(content))])
    with pytest.raises(LogError, match="no whole hardware trial in it: it was cut or damaged"):
        loaded(cut)
