"""A small run with something of everything, and how to compare trials bit for bit."""

from __future__ import annotations

import struct
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from ee_dist.effects.catalogue import Term
from ee_dist.engines.drivers import Commands, Network
from ee_dist.recording.records import (
    DIAGNOSIS,
    HARDWARE,
    PREDICTION,
    PRUNED,
    REPAIR,
    GenerationRecord,
    HypothesisRecord,
    RunRecord,
    TrialRecord,
)
from ee_dist.recording.writer import RunWriter
from ee_dist.robots.quadruped import quadruped
from ee_dist.trials.log import SensorLog

LOST_LEG = (Term("part_lost", "upper_front_left"),)


def sample_log(seed: int, rows: int = 100) -> SensorLog:
    """A log of the quadruped with every field but the supply."""
    rng, robot = np.random.default_rng(seed), quadruped()
    turn = rng.normal(size=(rows, 4))
    turn /= np.linalg.norm(turn, axis=1, keepdims=True)
    return SensorLog(
        times_s=np.arange(rows, dtype=np.float64) * 0.01,
        sensors=rng.normal(size=(rows, 8)),
        commands=rng.normal(size=(rows, 8)),
        sensor_names=robot.sensor_names,
        sensor_units=tuple(s.unit for s in robot.sensors),
        motor_names=robot.motor_names,
        base_pose=np.concatenate([rng.normal(size=(rows, 3)), turn], axis=1),
        joints=rng.normal(size=(rows, 8)),
        torques=rng.normal(size=(rows, 8)),
        travel_m=float(rng.normal()),
    )


def sample_run() -> RunRecord:
    """Two hardware trials, each with a prediction and some generations and hypotheses."""
    run = RunRecord(quadruped(), {"task": "recover", "seed": "0"}, {"config.yaml": b"seed: 0\n", "empty": b""})
    weights = tuple(np.random.default_rng(9).normal(size=68).tolist())
    for k in range(2):
        driver = Network(weights) if k == 0 else Commands(np.random.default_rng(k).normal(size=(30, 8)))
        run.trials += [
            TrialRecord(k, f"trial {k}", HARDWARE, driver, sample_log(k)),
            TrialRecord(k, f"trial {k}", PREDICTION, driver, sample_log(10 + k), LOST_LEG),
        ]
        run.generations.append(GenerationRecord(DIAGNOSIS, k, 0, 0.25, 0.5, 3, 100, 20))
        run.generations.append(GenerationRecord(REPAIR, k, 0, 1.25, 0.5, 7, 100, 60))
        run.hypotheses.append(HypothesisRecord(k, 0, 0, LOST_LEG, 0.125, final=True, stage=PRUNED))
        run.hypotheses.append(HypothesisRecord(k, 0, 1, (), 0.25))
    return run


def record(writer: RunWriter, run: RunRecord) -> None:
    """Trial, generations, hypotheses, prediction, for one pass after the other, as a run does."""
    for k in range(len(run.trials) // 2):
        writer.trial(run.trials[2 * k])
        for generation in run.generations[2 * k : 2 * k + 2]:
            writer.generation(generation)
        writer.hypotheses(run.hypotheses[2 * k : 2 * k + 2])
        writer.trial(run.trials[2 * k + 1])


def write(path: Path, run: RunRecord) -> Path:
    with RunWriter(path, run.robot, run.metadata, run.attachments) as writer:
        record(writer, run)
        writer.finish({"result_digest": "abc"})
    return path


def bits(value: Any) -> Any:
    """A form in which equal means equal in every bit: NaN equals itself, 0.0 does not equal -0.0."""
    if value is None or isinstance(value, (str, int)):
        return value
    if isinstance(value, float):
        return struct.pack("<d", value)
    if isinstance(value, np.ndarray):
        return value.shape, str(value.dtype), value.tobytes()
    if isinstance(value, tuple):
        return tuple(bits(v) for v in value)
    return type(value).__name__, tuple((f.name, bits(getattr(value, f.name))) for f in fields(value))
