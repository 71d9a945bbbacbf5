"""An effect of a user's own, from the very file that the documentation shows."""

from __future__ import annotations

import os
import pickle
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from effect_robots import MASS_KG, Bench, slider

from ee_dist.effects import CATALOGUE, EffectError, apply, load_plugin, loaded_plugins, term
from ee_dist.effects.laws import LAWS, SPEED_LAWS, LawError, drive_law, find_law, speed_law
from ee_dist.effects.plugins import text_of_plugin
from ee_dist.engines.contract import Rollout
from ee_dist.engines.drivers import Commands
from ee_dist.engines.mujoco.engine import MuJoCoEngine
from ee_dist.evaluation.cache import CachedEvaluator
from ee_dist.evaluation.jobs import Job, Whole
from ee_dist.evaluation.serial import SerialEvaluator
from ee_dist.robots.model import Law
from ee_dist.robots.quadruped import quadruped
from ee_dist.tasks.wiring import EngineMaker

ROOT = Path(__file__).parents[2]
BLOCKS = re.findall(r"^```python\n(.*?)^```$", (ROOT / "docs" / "own_effect.md").read_text(), re.MULTILINE | re.DOTALL)
HOLD = Commands(np.full((1, 1), 0.05))
WORKER = """
import pickle, sys
from ee_dist.effects import load_plugin
from ee_dist.engines.mujoco.engine import MuJoCoEngine
paths, rollout = pickle.load(sys.stdin.buffer)
for path in paths:
    load_plugin(path)
(log,) = MuJoCoEngine(threads=1).rollout([rollout])
sys.stdout.buffer.write(pickle.dumps(log))
"""


@pytest.fixture
def example(tmp_path: Path) -> Path:
    file = tmp_path / "cogging.py"
    file.write_text(BLOCKS[0])
    load_plugin(file)
    return file


@pytest.mark.usefixtures("example")
def test_the_documented_effect_pulls_with_its_torque(bench: Bench) -> None:
    cogging = term("cogging", "joint", torque_nm=6.0)
    for position in (-0.2, 0.05, 0.4):
        log = bench.run(slider(), cogging, steps=2, position=position)
        expected = -6.0 * np.sin(12 * position) / MASS_KG
        assert log.channel("velocity")[-1] / 0.001 == pytest.approx(expected, rel=1e-6)


@pytest.mark.usefixtures("example")
def test_the_documented_effect_keeps_the_promises_of_the_catalogue(bench: Bench) -> None:
    effect, robot = CATALOGUE["cogging"], quadruped()
    assert effect.bounds(robot, "hip_front_left") == {"torque_nm": (0.0, pytest.approx(0.6))}
    assert apply(robot, (term("cogging", "hip_front_left"),)) == robot
    gait = Commands(0.5 * np.sin(np.arange(300)[:, None] * 0.05 + np.arange(8)))
    all_joints = [term("cogging", j, torque_nm=0.6) for j in robot.motor_names]
    models = [robot, apply(robot, all_joints), robot]
    logs = bench.engine.rollout([Rollout(m, gait, 300, pose=True) for m in models])
    assert all(log.finite for log in logs)
    assert (logs[0].sensors == logs[2].sensors).all()
    assert (logs[0].sensors != logs[1].sensors).any()


def test_the_documented_trial_runs(
    example: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture
) -> None:
    monkeypatch.chdir(example.parent)
    exec(compile(BLOCKS[1], "own_effect.md", "exec"), {"__name__": "example"})
    moved = re.fullmatch(r"cogging moves the joint by up to (\d+) mrad\n", capsys.readouterr().out)
    assert moved is not None
    assert int(moved[1]) > 5


def test_another_process_gets_the_same_result(example: Path) -> None:
    model = apply(slider(), (term("cogging", "joint", torque_nm=6.0),))
    rollout = Rollout(model, Commands(np.zeros((1, 1))), 50)
    paths = loaded_plugins()
    assert str(example) in paths
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    answer = subprocess.run(
        [sys.executable, "-c", WORKER], input=pickle.dumps((paths, rollout)), stdout=-1, env=environment, check=True
    )
    (here,) = MuJoCoEngine(threads=1).rollout([rollout])
    assert pickle.loads(answer.stdout).sensors.tobytes() == here.sensors.tobytes()


def test_a_file_is_read_once_and_again_when_it_has_changed(example: Path) -> None:
    first = CATALOGUE["cogging"]
    load_plugin(example)
    assert CATALOGUE["cogging"] is first
    example.write_text(BLOCKS[0].replace("cogging", "slotting"))
    load_plugin(example)
    assert "slotting" in CATALOGUE
    assert "cogging" not in CATALOGUE
    assert "cogging" not in LAWS
    assert loaded_plugins().count(str(example)) == 1


def test_a_law_with_another_text_is_another_rollout(example: Path) -> None:
    """A robot names its laws: without their text a cache gave what the law had been."""
    asked = [Job(Rollout(apply(slider(), (term("cogging", "joint", torque_nm=6.0),)), HOLD, 20), Whole())]
    plain = Rollout(slider(), HOLD, 20).key
    make = EngineMaker("mujoco", 1, ((str(example), text_of_plugin(example)),))
    evaluator = CachedEvaluator(SerialEvaluator(make(), 8))
    (before,) = evaluator.evaluate(asked)
    example.write_text(BLOCKS[0].replace("return -joint", "return joint"))
    with pytest.raises(EffectError, match=r"cogging\.py: its text is not the one that the run began with"):
        make()
    load_plugin(example)
    (after,) = evaluator.evaluate(asked)
    assert before.channel("velocity")[-1] == pytest.approx(-after.channel("velocity")[-1], rel=1e-3)
    assert evaluator.counts.simulated == 2
    assert Rollout(slider(), HOLD, 20).key == plain
    example.write_text(BLOCKS[0])
    load_plugin(example)
    assert evaluator.evaluate(asked)[0] is before


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("def broken(:\n", r"own.py, line 1: SyntaxError"),
        ("\n\nimport nothing_of_this_name\n", r"own.py, line 3: ModuleNotFoundError"),
        ("x = 1\n", r"own.py: it registers no effect"),
        ("\nraise RuntimeError('no')\n", r"own.py, line 2: RuntimeError: no"),
    ],
)
def test_a_broken_file_says_where_and_leaves_no_trace(tmp_path: Path, text: str, message: str) -> None:
    file, before = tmp_path / "own.py", dict(CATALOGUE)
    file.write_text(text)
    with pytest.raises(EffectError, match=message) as caught:
        load_plugin(file)
    assert "\n" not in str(caught.value)
    assert dict(CATALOGUE) == before
    assert str(file) not in loaded_plugins()


def test_a_file_that_fails_half_way_registers_nothing(tmp_path: Path) -> None:
    file = tmp_path / "half.py"
    file.write_text(BLOCKS[0] + "\nraise RuntimeError('later')\n")
    with pytest.raises(EffectError, match="RuntimeError: later"):
        load_plugin(file)
    assert "cogging" not in CATALOGUE
    assert "cogging" not in LAWS


def test_a_file_that_is_not_there_is_named() -> None:
    with pytest.raises(EffectError, match=r"no such file of effects: nowhere.py"):
        load_plugin("nowhere.py")


def test_a_name_of_ours_cannot_be_taken(tmp_path: Path) -> None:
    file = tmp_path / "taken.py"
    file.write_text(BLOCKS[0].replace('"cogging",\n', '"backlash",\n'))
    with pytest.raises(EffectError, match="an effect named 'backlash' exists already"):
        load_plugin(file)
    assert CATALOGUE["backlash"].transform.__module__ == "ee_dist.effects.transmission"


@pytest.mark.usefixtures("example")
def test_a_law_whose_name_is_taken_is_refused() -> None:
    with pytest.raises(LawError, match="'cogging' exists already"):
        drive_law("cogging")(lambda joint: joint.position)
    with pytest.raises(LawError, match="'cogging' exists already"):
        speed_law("cogging")(lambda joint: joint.position)
    assert "cogging" not in SPEED_LAWS, "it goes on as the law of torques that it is"


def test_a_law_that_is_not_registered_is_named(bench: Bench) -> None:
    with pytest.raises(LawError, match="no drive law named 'gone'"):
        bench.run(slider().with_law(Law("gone", "joint", ())))
    with pytest.raises(LawError, match="no drive law named 'gone'"):
        find_law("gone")
