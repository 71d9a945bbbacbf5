"""A small run made of real rollouts, and reading a recording back by entity and component."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from rerun.chunk import Chunk, RrdReader

from ee_dist.effects import apply, term
from ee_dist.effects.catalogue import Hypothesis
from ee_dist.engines.contract import Rollout
from ee_dist.engines.drivers import Network, weight_count
from ee_dist.engines.pybullet.engine import PyBulletEngine
from ee_dist.recording.records import (
    DIAGNOSIS,
    EVOLVED,
    HARDWARE,
    HINDSIGHT,
    PREDICTION,
    PRUNED,
    REPAIR,
    GenerationRecord,
    HypothesisRecord,
    RunRecord,
    TrialRecord,
)
from ee_dist.robots.quadruped import quadruped

STEPS = 150
LOST_LEG = (term("part_lost", "upper_front_left"),)
LOST_FOOT = (term("part_lost", "lower_rear_right"),)
NAMES = ("intact", "after the change", "trial 1")
BELIEVED: tuple[Hypothesis, ...] = ((), (), LOST_FOOT)


def sample_run() -> RunRecord:
    """Three trials of a robot that loses a leg after the first; the last prediction and the hindsight believe in a lost foot."""
    rng = np.random.default_rng(7)
    robot = quadruped()
    drivers = [Network(tuple(rng.uniform(-1, 1, weight_count(8, 8)).round(2).tolist())) for _ in range(2)]
    drivers = [drivers[0], *drivers]
    bodies = [robot, apply(robot, LOST_LEG), apply(robot, LOST_LEG)]
    models = [apply(robot, b) for b in BELIEVED]
    engine = PyBulletEngine()
    logs = engine.rollout(
        [
            Rollout(m, d, STEPS, pose=True)
            for m, d in zip([*bodies, *models, models[2]], [*drivers, *drivers, drivers[1]], strict=True)
        ]
    )
    engine.close()
    run = RunRecord(robot, {"scenario": "3", "seed": "0", "truth": json.dumps([t.as_dict() for t in LOST_LEG])})
    for k, name in enumerate(NAMES):
        run.trials.append(TrialRecord(k, name, HARDWARE, drivers[k], logs[k]))
        run.trials.append(TrialRecord(k, name, PREDICTION, drivers[k], logs[k + 3], BELIEVED[k]))
    # What the diagnosis made of the trial after the change: its driver on the model of trial 1's prediction.
    run.trials.append(TrialRecord(1, NAMES[1], HINDSIGHT, drivers[1], logs[6], LOST_FOOT))
    for p in range(3):
        run.generations += [GenerationRecord(REPAIR, p, g, 0.5 * p + 0.1 * g, 0.0, g, 8, 8) for g in range(5)]
    run.generations += [GenerationRecord(DIAGNOSIS, 0, g, 1.0 / (1 + g), 2.0, g, 8, 8) for g in range(5)]
    run.hypotheses += [HypothesisRecord(0, g, 0, LOST_FOOT if g else (), 1.0 / (1 + g)) for g in range(5)]
    run.hypotheses.append(HypothesisRecord(0, 4, 0, LOST_FOOT, 0.2, stage=EVOLVED))
    run.hypotheses.append(HypothesisRecord(0, 4, 1, (), 0.9, stage=EVOLVED))
    run.hypotheses.append(HypothesisRecord(0, 4, 0, LOST_FOOT, 0.15, final=True, stage=PRUNED))
    run.complete = True
    return run


def chunks_of(path: Path, blueprint: bool = False) -> list[Chunk]:
    """The chunks of the recording, or of its blueprint."""
    reader = RrdReader(path)
    return reader.stream(store=reader.blueprints()[0] if blueprint else None).to_chunks()


def rows_of(path: Path, entity: str, component: str) -> tuple[np.ndarray, list[Any]]:
    """Times (s, or empty where static) and values (a list for each row) of a component of an entity, by time."""
    found: list[tuple[float, Any]] = []
    static: list[Any] = []
    for chunk in chunks_of(path):
        batch = chunk.to_record_batch()
        if chunk.entity_path != f"/{entity}" or component not in batch.schema.names:
            continue
        values = batch.column(component).to_pylist()
        if chunk.is_static:
            static += values
        else:
            nanos = batch.column("run_time").cast("int64").to_pylist()
            found += zip((n / 1e9 for n in nanos), values, strict=True)
    assert found or static, f"no {component} at {entity}"
    found.sort(key=lambda row: row[0])
    return np.array([t for t, _ in found]), static or [v for _, v in found]


def contents_of(path: Path, blueprint: bool = False) -> list[str]:
    """Everything that a recording says, but for the ids and times of day that rerun makes up."""
    told = []
    for chunk in chunks_of(path, blueprint):
        batch = chunk.to_record_batch()
        names = [n for n in batch.schema.names if n not in ("rerun.controls.RowId", "log_time", "log_tick")]
        told.append(f"{chunk.entity_path} {batch.select(names).to_pydict()}")
    return sorted(told)
