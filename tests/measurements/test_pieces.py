"""A long record as several trials."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ee_dist.discrepancy.measured_trial import MeasuredTrial
from ee_dist.discrepancy.ways.open_loop.problem import OpenLoop
from ee_dist.engines.contract import Rollout
from ee_dist.engines.drivers import Commands
from ee_dist.engines.one_joint import OneJointEngine
from ee_dist.evaluation.serial import SerialEvaluator
from ee_dist.measurements.errors import MeasurementError
from ee_dist.measurements.pieces import in_pieces, pieces_asked
from ee_dist.recording.reader import read_run
from ee_dist.recording.records import HARDWARE, TrialRecord
from ee_dist.robots.servo_pendulum import servo_pendulum

ROBOT = servo_pendulum()
SECONDS = 12.0


@pytest.fixture(scope="module")
def whole() -> TrialRecord:
    """A pendulum that is in motion all the time."""
    t = np.arange(0, SECONDS, ROBOT.time_step_s)
    sent = (np.minimum(1.0, t / 0.4) ** 2 * (0.5 * np.sin(3.1 * t) + 0.4 * np.sin(1.3 * t**1.2)))[:, None]
    (log,) = OneJointEngine().rollout([Rollout(ROBOT, Commands(sent), len(t), pose=True)])
    return TrialRecord(0, "long", HARDWARE, Commands(sent), log)


@pytest.mark.parametrize(
    ("asked", "names"),
    [
        (None, ["long"]),
        (4, ["long 0-4 s", "long 4-8 s", "long 8-12 s"]),
        (5, ["long 0-5 s", "long 5-12 s"]),
        (4.5, ["long 0-4.5 s", "long 4.5-9 s", "long 9-12 s"]),
        (100, ["long 0-12 s"]),
        ([1, 3], ["long 1-3 s"]),
        ([[6, 99], [1, 3]], ["long 6-12 s", "long 1-3 s"]),
    ],
)
def test_which_pieces(whole, asked, names):
    found = in_pieces([whole], pieces_asked(asked))
    assert [r.name for r in found] == names and [r.index for r in found] == [*range(len(names))]


@given(st.floats(0.3, 20.0))
def test_every_row_is_in_one_piece(whole, seconds):
    found = in_pieces([whole], pieces_asked(seconds))
    assert np.array_equal(np.concatenate([r.log.sensors for r in found]), whole.log.sensors)
    assert all(r.log.times_s[0] == 0 for r in found)
    assert all(np.array_equal(r.driver.values, r.log.commands) for r in found)


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        (0, "cannot be 0; expected task.pieces=30"),
        (True, "expected task.pieces=30"),
        ("half", "expected task.pieces=30"),
        ([], "expected task.pieces=30"),
        ([3, 1], "from 3 to 1 s is no piece"),
        ([[0, 5], [4, 6]], "overlap"),
        ([[0, 5], [1]], "expected task.pieces=30"),
        ([[20, 30]], "trial long has 12 s, none from 20 to 30 s"),
    ],
)
def test_what_is_no_piece_is_told(whole, asked, said):
    with pytest.raises(MeasurementError, match=r"task\.pieces") as told:
        in_pieces([whole], pieces_asked(asked))
    assert said in str(told.value)


def test_a_model_that_is_right_follows_each_piece_from_where_it_begins(whole):
    """Pieces begin in motion: nothing is left of the part that was cut off."""
    rng, noise = np.random.default_rng(0), 1e-3
    trials = []
    for record in in_pieces([whole], 4.0):
        sensors = record.log.sensors + noise * rng.standard_normal(record.log.sensors.shape)
        trials.append(MeasuredTrial(record.name, replace(record.log, sensors=sensors), record.driver, (), False))
    problem = OpenLoop(tuple(trials), ROBOT, SerialEvaluator(OneJointEngine()))
    (residual,) = problem.residuals([()])
    later = [problem.trial_error(residual, k) for k in (1, 2)]
    assert max(later) < 1.1 * problem.noise_floor()[0]


def test_the_command_line_cuts_what_it_imports(tmp_path, command, whole):
    log = whole.log
    columns = {"t": log.times_s, "angle": log.sensors[:, 0], "speed": log.sensors[:, 1], "target": log.commands[:, 0]}
    pd.DataFrame(columns).to_csv(tmp_path / "long.csv", index=False)
    ask = (f"measured={tmp_path / 'long.csv'}", "robot=servo_pendulum", f"hydra.run.dir={tmp_path / 'out'}")
    status, said, _ = command(*ask, "task.pieces=4")
    assert (
        status == 0
        and "3 trial(s) of servo_pendulum, pieces of 1 that are told whole above: long 0-4 s, long 4-8 s, long 8-12 s"
        in said
    )
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    trials = read_run(tmp_path / "out" / "measured.mcap").trials
    assert summary["pieces"] == [t.name for t in trials] and len(summary["trials"]) == 1
    assert sum(len(t.log) for t in trials) == len(log)
    status, _, complaint = command(*ask, "task.pieces=[[4,2]]", "overwrite=true")
    assert status == 2 and "is no piece" in complaint and complaint.count("\n") == 1
