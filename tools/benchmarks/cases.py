"""What the benchmarks that hide effects share: a trial of a robot with a hidden change, and the file of all cases."""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from typing import Any

import numpy as np

from ee_dist.discrepancy.measured_trial import MeasuredTrial, setup_of
from ee_dist.effects.catalogue import Hypothesis
from ee_dist.engines.contract import Engine
from ee_dist.evaluation.physical import PhysicalRobot
from ee_dist.robots.model import Robot
from ee_dist.tasks.trial import one_trial
from ee_dist.trials.excitation import Excitation


def tried(
    engine: Engine, robot: Robot, hidden: Hypothesis, excitation: Excitation, seed: Sequence[int], number: int = 0
) -> MeasuredTrial:
    """What the recording of one trial would hold, number ``number`` of its robot."""
    held = setup_of(excitation)
    hardware = PhysicalRobot(engine, robot, (*hidden, *held), np.random.SeedSequence(seed))
    _, record = one_trial(hardware, excitation, robot, number)
    return MeasuredTrial(f"{number} {record.name}", record.log, record.driver, held)


def seldom(trial: MeasuredTrial, every: int) -> MeasuredTrial:
    """The trial as an import brings it in whose sensors were read in every n-th row: straight lines lie between readings."""
    if every == 1:
        return trial
    log = trial.log
    read, rows = np.arange(0, len(log), every), np.arange(len(log))
    filled = np.ones(len(log), dtype=bool)
    filled[read] = False
    sensors = np.stack([np.interp(rows, read, c[read]) for c in log.sensors.T], axis=1)
    return replace(trial, log=replace(log, sensors=sensors, filled=filled))


def write_cases(args: argparse.Namespace, found: Mapping[str, object], cases: Sequence[Any]) -> None:
    """Settings, figures and every case (dataclasses) as JSON to ``args.json``, if it was asked for."""
    if args.json:
        settings = {k: v for k, v in vars(args).items() if k != "json"}
        content = {"settings": settings, **found, "robots": [asdict(c) for c in cases]}
        args.json.write_text(json.dumps(content, indent=1, default=str) + "\n", encoding="utf-8")
