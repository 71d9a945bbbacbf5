"""Sensors that are read more seldom than the model must step: what lies between readings is simulated, and is no evidence."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from way_samples import measure, problem_by, samples

from ee_dist.discrepancy.measured_trial import MeasuredTrial, evenly_read
from ee_dist.discrepancy.problem import error
from ee_dist.discrepancy.slow_noise import slow_noise
from ee_dist.measurements.importer import import_file
from ee_dist.measurements.mapping_file import mapping_of
from ee_dist.recording.reader import read_run
from ee_dist.recording.records import HARDWARE, TrialRecord
from ee_dist.recording.writer import RunWriter

EVERY = 6
SAMPLE = samples()["arm"]


def imported(trial: MeasuredTrial, folder: Path, uneven: bool) -> tuple[TrialRecord, list[str]]:
    """A CSV with about every sixth row of a trial, commands sent at these times and held, and what an import makes of it."""
    robot, log = SAMPLE.robot, trial.log
    rows = np.arange(0, len(log), EVERY)
    if uneven:
        rows[1:-1] += np.random.default_rng(3).integers(-2, 3, len(rows) - 2)
    table = pd.DataFrame({"t": log.times_s[rows]})
    for k, name in enumerate(log.sensor_names):
        table[name] = log.sensors[rows, k]
    for k, name in enumerate(log.motor_names):
        table[f"goal_{name}"] = log.commands[rows, k]
        assert log.torques is not None
        table[f"force_{name}"] = log.torques[rows, k]
    table.to_csv(folder / "a.csv", index=False)
    motors = robot.motor_names
    data = {
        "time": "t",
        "sensors": {s.name: {"column": s.name, "unit": s.unit} for s in robot.sensors},
        "commands": {m: {"column": f"goal_{m}", "unit": "rad"} for m in motors},
        "torques": {m: {"column": f"force_{m}", "unit": "N.m"} for m in motors},
    }
    record, report = import_file(folder / "a.csv", mapping_of(data, Path("map.yaml")), robot)
    return record, report.done


@cache
def held() -> tuple[tuple[MeasuredTrial, ...], tuple[MeasuredTrial, ...]]:
    """Trials with a hidden change, and the same where every command is held as long as a computer that sends seldom holds it."""
    rows = EVERY * (np.arange(10_000) // EVERY)
    plan = tuple(p[rows[: len(p)]] for p in SAMPLE.plan if isinstance(p, np.ndarray))
    slow = replace(SAMPLE, plan=plan)
    return measure(slow, SAMPLE.hidden), measure(slow, ())


@pytest.mark.parametrize("uneven", [False, True])
def test_an_import_tells_readings_from_rows_between_them_and_a_recording_keeps_it(tmp_path: Path, uneven: bool) -> None:
    (trial, *_), _ = held()
    record, done = imported(trial, tmp_path, uneven)
    log = record.log
    assert log.filled is not None and len(log) > 5 * len(log.readings)
    read = pd.read_csv(tmp_path / "a.csv")
    assert np.allclose(log.times_s[log.readings], read["t"], atol=1e-9)
    assert np.allclose(log.sensors[log.readings], read[list(log.sensor_names)])
    assert log.torques is not None and np.allclose(log.torques[log.readings, 0], read[f"force_{log.motor_names[0]}"])
    assert any("only these are compared" in line for line in done)
    with RunWriter(tmp_path / "run.mcap", SAMPLE.robot, {}, {}) as writer:
        writer.trial(record)
    (back,) = read_run(tmp_path / "run.mcap").trials
    assert np.array_equal(back.log.filled, log.filled)
    part = log.part(7, 100)
    assert np.array_equal(
        part.times_s[part.readings], [t for t in log.times_s[log.readings] if 7 <= round(t / 0.004) < 100]
    )
    even = evenly_read(log)
    assert even.filled is None and len(even) == pytest.approx(len(log.readings), abs=4)
    assert even.sensors[:, 0] == pytest.approx(np.interp(even.times_s, read["t"], read[log.sensor_names[0]]))


def test_a_log_at_the_rate_of_the_model_has_nothing_filled_in(tmp_path: Path) -> None:
    (trial, *_), _ = held()
    path = tmp_path / "run.mcap"
    with RunWriter(path, SAMPLE.robot, {}, {}) as writer:
        writer.trial(TrialRecord(0, "a", HARDWARE, trial.driver, trial.log))
    (back,) = read_run(path).trials
    assert back.log.filled is None and len(back.log.readings) == len(back.log)


@pytest.mark.parametrize("way", ["open_loop", "free_run", "force_balance"])
def test_the_true_model_is_near_the_floor_and_the_other_is_not(tmp_path: Path, way: str) -> None:
    trials = tuple(MeasuredTrial(t.name, imported(t, tmp_path, False)[0].log, None, t.setup) for t in held()[0])
    problem = problem_by(way, trials, SAMPLE.robot)
    off, right = (error(problem.residuals([h])[0]) for h in ((), SAMPLE.hidden))
    floor, _ = problem.noise_floor()
    assert floor > 0 and np.isfinite([off, right]).all()
    off, right, floor = (problem.natural(v) for v in (off, right, floor))
    # Forty readings a second are few for forces that change as often, so that noise is most of what is left of those.
    assert off > (1.25 if way == "force_balance" else 2.5) * right
    assert right < 3 * floor
    for s in problem.series(()):
        assert len(s.times_s) == len(s.measured) == len(s.predicted) <= len(trials[s.trial].log.readings)


def test_noise_is_found_between_readings_that_are_far_apart() -> None:
    rng = np.random.default_rng(0)
    t = np.cumsum(rng.uniform(0.02, 0.045, 400))
    motion = np.stack([np.sin(5 * t), 0.2 * t], axis=1)
    for noise in (0.0005, 0.02):
        found = slow_noise(t, motion + noise * rng.standard_normal(motion.shape))
        assert found == pytest.approx([noise, noise], rel=0.4)
