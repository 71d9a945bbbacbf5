"""Logs of one joint each, from the import to what is compared: a joint that a trial does not have says nothing there."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from imported_logs import imported_logs

from ee_dist.discrepancy.accounts.of_compare import compare_account
from ee_dist.discrepancy.compare import compare
from ee_dist.recording.reader import read_run
from ee_dist.recording.writer import RunWriter
from ee_dist.tasks.config import Config
from ee_dist.tasks.measurements import load
from ee_dist.tasks.results import scenes
from ee_dist.tasks.results.sections import heat_section
from ee_dist.tasks.ways import WAYS

JOINTS = ("hip", "knee")
CHAIN = """<robot name="chain"><link name="base"/>
  <link name="upper"><inertial><mass value="0.5"/><origin xyz="0.1 0 0"/>
    <inertia ixx="0.001" iyy="0.002" izz="0.002" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="lower"><inertial><mass value="0.3"/><origin xyz="0.1 0 0"/>
    <inertia ixx="0.001" iyy="0.002" izz="0.002" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="hip" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" effort="20" velocity="8"/></joint>
  <joint name="knee" type="revolute"><parent link="upper"/><child link="lower"/><origin xyz="0.2 0 0"/>
    <axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="20" velocity="8"/></joint></robot>"""
DRIVES = (
    "{urdf: chain.urdf, time_step_s: 0.01, free_base: false, drives: {hip: {kp: 20, kd: 1}, knee: {kp: 20, kd: 1}}}"
)


@pytest.fixture
def config(tmp_path: Path) -> Config:
    """Two files of one joint each, imported without a mapping."""
    (tmp_path / "chain.urdf").write_text(CHAIN)
    (tmp_path / "chain.yaml").write_text(DRIVES)
    files = []
    for k, joint in enumerate(JOINTS):
        t = np.arange(500) / 100 + 0.0037 * k
        asked = 0.1 * k + 0.3 * np.sin(2 * t * (1 + 0.2 * k)) ** 2
        seen = np.interp(t - 0.04, t, asked) + np.random.default_rng(k).normal(0, 1e-3, len(t))
        files.append(tmp_path / f"{joint}.csv")
        pd.DataFrame({"t_s": t, "cmd_rad": asked, "pos_rad": seen}).to_csv(files[-1], index=False)
    return imported_logs(tmp_path / "chain.yaml", files, tmp_path / "out")


def test_the_recording_says_which_joint_nobody_recorded(config: Config) -> None:
    found = load(config)
    assert [t.not_recorded for t in found.trials] == [{"position_knee"}, {"position_hip"}]
    for way in ("open_loop", "free_run"):
        problem = WAYS[way].make(found, config)
        assert set(zip(problem.trial_of.tolist(), problem.channel_of.tolist(), strict=True)) == {(0, 0), (1, 1)}
        assert np.isfinite(problem.residuals([()])).all()


def test_a_recording_from_before_is_read_as_it_was(config: Config) -> None:
    before = read_run(config.measured)
    with RunWriter(config.measured, before.robot, before.metadata) as writer:
        for trial in before.trials:
            writer.trial(replace(trial, not_recorded=()))
    problem = WAYS["open_loop"].make(load(config), config)
    assert len(set(zip(problem.trial_of.tolist(), problem.channel_of.tolist(), strict=True))) == 4


def test_a_scene_draws_what_was_recorded(config: Config, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    problem, drawn = WAYS["open_loop"].make(load(config), config), []
    monkeypatch.setattr(scenes, "write_compare_rrd", lambda finding, _: drawn.append(finding))
    found = compare(problem, problem.residuals([()])[0])
    scenes.compare_scene(problem, found, compare_account(problem, found, []), (), tmp_path / "a.rrd")
    assert [c.measured.sensor_names for c in drawn[0].cases] == [("position_hip",), ("position_knee",)]


def test_a_heat_map_has_no_colour_where_nothing_was_recorded(config: Config) -> None:
    problem = WAYS["open_loop"].make(load(config), config)
    section = heat_section(problem, problem.residuals([()])[0])
    figure = section.figure
    assert section.caption.endswith("What is blank nobody recorded.")
    assert figure is not None
    blank = np.isnan(np.array(figure.data[0].z, dtype=float))
    np.testing.assert_array_equal(blank, np.stack([problem.trial_of_segment != k for k in range(2)]))
