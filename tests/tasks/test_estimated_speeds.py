"""Speeds that an import made of positions are to be seen: nothing is judged by them, and a model knows nothing of them."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ee_dist.discrepancy.measured_trial import driver_of
from ee_dist.effects.catalogue import term
from ee_dist.effects.model_file import write_model
from ee_dist.engines.mujoco.engine import MuJoCoEngine
from ee_dist.evaluation.physical import PhysicalRobot
from ee_dist.recording.records import HARDWARE, TrialRecord
from ee_dist.recording.writer import RunWriter
from ee_dist.robots.servo_pendulum import servo_pendulum
from ee_dist.tasks.config import Config, EngineConfig, EvaluatorConfig
from ee_dist.tasks.measurements import load
from ee_dist.tasks.ways import WAYS
from ee_dist.trials.excitation import Excitation
from ee_dist.trials.noise import with_noise

ROBOT = with_noise(servo_pendulum(), 0.005)
CONFIG = Config(engine=EngineConfig("mujoco", 1), evaluator=EvaluatorConfig("serial"))
FRICTION = term("coulomb_friction", "servo", torque_nm=0.05)


def recorded(folder: Path, name: str, estimated: list[str] | None) -> Path:
    motion = Excitation("multisine", 2.0, 0.4, 1)
    driver = driver_of(motion, ROBOT)
    log = PhysicalRobot(MuJoCoEngine(1), ROBOT, (FRICTION,), np.random.SeedSequence(0)).trial(
        driver, motion.steps(ROBOT)
    )
    metadata = {"task": "import"} | ({} if estimated is None else {"estimated": json.dumps(estimated)})
    with RunWriter(folder / name, ROBOT, metadata) as writer:
        writer.trial(TrialRecord(0, name, HARDWARE, driver, log))
    return folder / name


def test_what_nobody_measured_is_not_compared(tmp_path: Path) -> None:
    assert ROBOT.sensor_names == ("position", "speed")
    file = recorded(tmp_path, "a.mcap", ["speed"])
    found = load(replace(CONFIG, measured=str(file)))
    assert found.robot.sensor_names == found.trials[0].log.sensor_names == ("position",)
    problem = WAYS["open_loop"].make(found, CONFIG)
    assert problem.channels == ("position",) and np.isfinite(problem.residuals([(), (FRICTION,)])).all()
    for none in (None, []):
        assert (
            load(replace(CONFIG, measured=str(recorded(tmp_path, "b.mcap", none)))).robot.sensor_names
            == ROBOT.sensor_names
        )


def test_a_model_from_before_goes_with_the_log(tmp_path: Path) -> None:
    file = recorded(tmp_path, "a.mcap", ["speed"])
    model = tmp_path / "model.yaml"
    write_model(model, ROBOT, tmp_path, (FRICTION,), ())
    found = load(replace(CONFIG, measured=str(file), model=str(model)))
    assert found.robot.sensor_names == ("position",) and found.model == (FRICTION,)
    assert not any("otherwise than the log" in line for line in found.remarks)


def test_of_two_recordings_each_has_what_both_measured(tmp_path: Path) -> None:
    files = [str(recorded(tmp_path, "a.mcap", ["speed"])), str(recorded(tmp_path, "b.mcap", []))]
    found = load(replace(CONFIG, measured=files))
    assert {t.log.sensor_names for t in found.trials} == {("position",)}


@pytest.mark.parametrize("said", ['"speed"', "[1, 2]", "{}"])
def test_what_a_file_says_wrongly_of_it_is_nothing(tmp_path: Path, said: str) -> None:
    file = tmp_path / "a.mcap"
    motion = Excitation("multisine", 2.0, 0.4, 1)
    driver = driver_of(motion, ROBOT)
    log = PhysicalRobot(MuJoCoEngine(1), ROBOT, (), np.random.SeedSequence(0)).trial(driver, motion.steps(ROBOT))
    with RunWriter(file, ROBOT, {"task": "import", "estimated": said}) as writer:
        writer.trial(TrialRecord(0, "a", HARDWARE, driver, log))
    assert load(replace(CONFIG, measured=str(file))).robot.sensor_names == ROBOT.sensor_names
