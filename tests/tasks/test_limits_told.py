"""A torque limit that somebody guessed far too low: compare, explain and improve say so, in all that they write."""

from __future__ import annotations

import html
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from imported_logs import imported_logs
from scene_texts import text_of
from schemas import validated

from ee_dist.engines.contract import Rollout
from ee_dist.engines.drivers import Commands
from ee_dist.engines.mujoco.engine import MuJoCoEngine
from ee_dist.robots.describe import load_robot
from ee_dist.tasks import compare, explain, improve
from ee_dist.tasks.config import Config

ARM = """<robot name="arm"><link name="base"/>
  <link name="upper"><inertial><mass value="0.5"/><origin xyz="0.1 0 0"/>
    <inertia ixx="0.001" iyy="0.002" izz="0.002" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="hip" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 0 1"/>
    <limit lower="-2" upper="2" effort="20" velocity="20"/></joint></robot>"""
ONLY = ["viscous_friction"]


@pytest.fixture
def config(tmp_path: Path) -> Config:
    """An arm that can do what is asked of it, and a description of it in which a guess says that it cannot."""
    (tmp_path / "arm.urdf").write_text(ARM)
    drive = {"kp": 40.0, "kd": 2.0}
    said = {"urdf": str(tmp_path / "arm.urdf"), "time_step_s": 0.01, "free_base": False}
    robot = load_robot({**said, "drives": {"hip": drive}})[0]
    guessed = {**said, "drives": {"hip": {**drive, "torque_limit": 0.04, "assumed": ["torque_limit"]}}}
    (tmp_path / "arm.yaml").write_text(json.dumps(guessed))
    files = []
    for k in range(2):
        t = np.arange(300) / 100
        asked = 0.9 * np.sin((3 + k) * t) * np.minimum(1, t)
        steps = Rollout(robot, Commands(asked[:, None]), len(t), pose=True)
        (log,) = MuJoCoEngine(1).rollout([steps])
        seen = log.joints[:, 0] + np.random.default_rng(k).normal(0, 1e-3, len(t))
        files.append(tmp_path / f"run{k}.csv")
        pd.DataFrame({"t_s": t, "hip_cmd_rad": asked, "hip_pos_rad": seen}).to_csv(files[-1], index=False)
    return imported_logs(tmp_path / "arm.yaml", files, tmp_path / "measured")


@pytest.mark.parametrize("verb", ["compare", "explain", "improve"])
def test_a_limit_that_was_guessed_too_low_is_told_in_all_that_a_verb_writes(
    verb: str, config: Config, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / verb
    capsys.readouterr()
    if verb == "compare":
        compare.run(config, compare.Options(), out)
    elif verb == "explain":
        explain.run(config, explain.Options(only=ONLY), out)
    else:
        improve.run(replace(config, effect="auto"), improve.Options(only=ONLY), out)
    summary = validated(out / "summary.json")
    (told,) = summary["at_limit"]
    assert told["joint"] == "hip" and told["assumed"] and told["limit"] == pytest.approx(0.04) and told["share"] > 0.25
    (line,) = (w for w in summary["words"] if "at its torque limit" in w)
    assert summary["words"].index(line) == 1, "before any number"
    page = html.unescape((out / "report.html").read_text(encoding="utf-8"))
    scene = " ".join(" ".join(text_of(out / f"{verb}.rrd")).split())
    for text in (" ".join(capsys.readouterr().out.split()), page, scene):
        assert line in text
