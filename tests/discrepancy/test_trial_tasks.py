"""The seal, hidden changes as asked for, and logs that cannot be compared: one line each."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ee_dist.effects.catalogue import term
from ee_dist.effects.effect import EffectError
from ee_dist.robots.quadruped_lab import quadruped_lab
from ee_dist.tasks import recover
from ee_dist.tasks.config import Config, ConfigError, EngineConfig, RobotConfig
from ee_dist.tasks.measurements import checked, files_of
from ee_dist.tasks.seal import FILE, opened, sealed
from ee_dist.tasks.summary import config_digest
from ee_dist.tasks.trial import Options, hypothesis, run
from ee_dist.trials.log import LogError, SensorLog

ROBOT = quadruped_lab()
SEED = np.random.SeedSequence(3)


def log(rows: int = 100) -> SensorLog:
    s, m = len(ROBOT.sensors), len(ROBOT.drives)
    return SensorLog(
        np.arange(rows) * 0.01,
        np.zeros((rows, s)),
        np.zeros((rows, m)),
        ROBOT.sensor_names,
        tuple(x.unit for x in ROBOT.sensors),
        ROBOT.motor_names,
    )


def test_the_seal_hides_and_gives_back(tmp_path: Path) -> None:
    entry = term("motor_weak", "knee_front_left", loss=0.3).as_dict()
    text, digest = sealed({"hidden": [entry]})
    assert "motor" not in text and "knee" not in text
    path = tmp_path / FILE
    path.write_text(text)
    assert opened(path, digest)[0] == (term("motor_weak", "knee_front_left", loss=0.3),)
    with pytest.raises(ConfigError, match="another log"):
        opened(path, "0" * 64)
    path.write_text(text.replace('"payload": "', '"payload": "A'))
    with pytest.raises(ConfigError, match="broken"):
        opened(path)
    with pytest.raises(ConfigError, match="no sealed truth"):
        opened(tmp_path / "none.json")


def test_hidden_changes_as_typed() -> None:
    assert hypothesis(None, ROBOT, SEED) == ()
    assert hypothesis("random", ROBOT, SEED) == hypothesis("random", ROBOT, SEED)
    assert [t.target for t in hypothesis("motor_weak@knee_front_left", ROBOT, SEED)] == ["knee_front_left"]
    listed = [{"effect": "motor_weak", "target": "hip_rear_left", "loss": 0.5}]
    assert hypothesis(listed, ROBOT, SEED) == (term("motor_weak", "hip_rear_left", loss=0.5),)
    with pytest.raises(EffectError, match="motor_weak"):
        hypothesis("motor_weakk@knee_front_left", ROBOT, SEED)
    with pytest.raises(ConfigError, match="effect@target"):
        hypothesis(5, ROBOT, SEED)


def _renamed(names: tuple[str, ...], old: str, new: str) -> tuple[str, ...]:
    return tuple(new if n == old else n for n in names)


UNITS = tuple("deg" if s.name == "roll" else s.unit for s in ROBOT.sensors)
WRONG = [
    (replace(log(), sensor_names=_renamed(ROBOT.sensor_names, "roll", "rol")), "no channel 'roll'; is it rol?"),
    (replace(log(), motor_names=_renamed(ROBOT.motor_names, "hip_front_left", "hip_fl")), "no joint 'hip_front_left'"),
    (replace(log(), sensor_units=UNITS), "roll is in 'deg', the model has it in 'rad'"),
    (log(10), "10 rows; at least 30"),
    (replace(log(), times_s=np.arange(100) * 0.02), "resample"),
]


@pytest.mark.parametrize(("wrong", "said"), WRONG, ids=["channel", "joint", "unit", "short", "rate"])
def test_logs_that_cannot_be_compared(wrong: SensorLog, said: str) -> None:
    with pytest.raises(LogError, match=said) as caught:
        checked(wrong, ROBOT, "a.mcap")
    assert "\n" not in str(caught.value)


def test_a_value_that_is_not_a_number_is_told_with_its_place() -> None:
    values = np.zeros((100, len(ROBOT.sensors)))
    values[40:43, 7] = np.nan
    with pytest.raises(LogError, match=rf"{ROBOT.sensor_names[7]} is not a number in 3 rows, first at 0.4 s"):
        checked(replace(log(), sensors=values), ROBOT, "a.mcap")


def test_channels_in_another_order_are_put_right() -> None:
    order = list(reversed(range(len(ROBOT.sensors))))
    values = np.tile(np.arange(len(order), dtype=float), (100, 1))
    turned = replace(
        log(),
        sensors=values,
        sensor_names=tuple(ROBOT.sensor_names[i] for i in order),
        sensor_units=tuple(ROBOT.sensors[i].unit for i in order),
    )
    assert checked(turned, ROBOT, "x").sensors[0].tolist() == [float(i) for i in order]


def test_files_are_found_or_told(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="which log"):
        files_of(None)
    with pytest.raises(ConfigError, match=r"no \.mcap in this folder"):
        files_of(str(tmp_path))
    (tmp_path / "trial.mcap").touch()
    assert files_of(str(tmp_path)) == [tmp_path / "trial.mcap"]
    with pytest.raises(ConfigError, match=r"did you mean trial\.mcap"):
        files_of(str(tmp_path / "trail.mcap"))


def test_noise_of_none_is_none(tmp_path: Path) -> None:
    """noise=0 is what was asked for; where nothing was, task.noise counts."""
    found = {}
    for name, noise in (("asked", 0.0), ("silent", None)):
        config = Config(robot=RobotConfig(name="servo_pendulum"), engine=EngineConfig(name="mujoco"), noise=noise)
        (tmp_path / name).mkdir()
        run(config, Options(excitations=["sway:seconds=0.5"], repeats=1), tmp_path / name)
        found[name] = json.loads((tmp_path / name / "summary.json").read_text())
    assert (found["asked"]["noise"], found["silent"]["noise"]) == (0.0, 0.02)
    assert found["asked"]["result_digest"] != found["silent"]["result_digest"]
    assert found["asked"]["config_digest"] != found["silent"]["config_digest"]


def test_a_run_without_noise_has_the_digest_it_always_had() -> None:
    assert config_digest(Config(), recover.Options()) == config_digest(Config(noise=0.0), recover.Options())
