"""A known force that is not a drive's: read from a column, kept in the recording, and counted by every way of comparing."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from way_samples import engine_for, motor_forces, problem_by, samples, sines

from ee_dist.discrepancy.measured_trial import MeasuredTrial
from ee_dist.discrepancy.problem import error
from ee_dist.engines.contract import Rollout
from ee_dist.engines.drivers import Commands
from ee_dist.measurements.errors import MeasurementError
from ee_dist.measurements.importer import import_file
from ee_dist.measurements.mapping_file import mapping_of
from ee_dist.recording.reader import read_run
from ee_dist.recording.writer import RunWriter

PUSHED = "shoulder"


def pushed_arm() -> MeasuredTrial:
    """An arm whose shoulder is pushed by a known torque while its drives hold a motion; joints and motor torques as read."""
    robot = samples()["arm"].robot
    commands = sines(robot, 0.4, 2.0)[0]
    t = np.arange(len(commands)) * robot.time_step_s
    push = np.stack([1.5 * np.sin(11.0 * t), np.zeros(len(t))], axis=1)
    rollout = Rollout(robot, Commands(commands), len(commands), seed=0, pose=True, external=push)
    (log,) = engine_for(robot).rollout([rollout])
    assert log.joints is not None
    read = np.stack([log.sensors[:, c] for c, s in enumerate(robot.sensors) if s.kind == "position"], axis=1)
    log = replace(log, joints=read, torques=motor_forces(robot, commands, log.joints), external=push)
    return MeasuredTrial("pushed", log, Commands(commands))


@pytest.mark.parametrize("way", ["open_loop", "free_run", "force_balance"])
def test_a_known_push_is_counted_and_left_out_it_shows(way: str) -> None:
    robot, trial = samples()["arm"].robot, pushed_arm()
    silent = replace(trial, log=replace(trial.log, external=None))
    known, unknown = (problem_by(way, (t,), robot) for t in (trial, silent))
    with_it, without = (p.natural(error(p.residuals([()])[0])) for p in (known, unknown))
    assert without > 5 * with_it


def test_a_column_is_a_push_and_a_recording_keeps_it(tmp_path: Path) -> None:
    robot, log = samples()["arm"].robot, pushed_arm().log
    assert log.external is not None
    table = pd.DataFrame({"t": log.times_s, "f": 1000 * log.external[:, 0]})
    for k, name in enumerate(log.sensor_names):
        table[name] = log.sensors[:, k]
    for k, name in enumerate(log.motor_names):
        table[f"goal_{name}"] = log.commands[:, k]
    table.to_csv(tmp_path / "a.csv", index=False)
    data = {
        "time": "t",
        "sensors": {s.name: {"column": s.name, "unit": s.unit} for s in robot.sensors},
        "commands": {m: {"column": f"goal_{m}", "unit": "rad"} for m in robot.motor_names},
        "external": {PUSHED: {"column": "f", "unit": "mN.m"}},
    }
    record, report = import_file(tmp_path / "a.csv", mapping_of(data, Path("map.yaml")), robot)
    assert record.log.external == pytest.approx(log.external, abs=1e-12), "joints that are not named are not pushed"
    assert report.ranges[f"external torque on {PUSHED}"][2] == "N.m"
    with RunWriter(tmp_path / "run.mcap", robot, {}, {}) as writer:
        writer.trial(record)
    (back,) = read_run(tmp_path / "run.mcap").trials
    assert np.array_equal(back.log.external, record.log.external)

    data["external"] = {"sholder": {"column": "f", "unit": "N.m"}}
    with pytest.raises(MeasurementError, match=r"external: small_arm has no 'sholder'; did you mean shoulder"):
        import_file(tmp_path / "a.csv", mapping_of(data, Path("map.yaml")), robot)
