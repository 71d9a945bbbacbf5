"""What to record next: which excitation would tell tied explanations apart best, predicted by simulating each of them on it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from ee_dist.discrepancy.measured_trial import driver_of, setup_of
from ee_dist.discrepancy.ways.open_loop.prediction import ToSensors, clean, report
from ee_dist.discrepancy.ways.open_loop.scale import channel_scale
from ee_dist.effects.catalogue import Hypothesis, apply
from ee_dist.engines.contract import Rollout
from ee_dist.engines.drivers import Commands, Network
from ee_dist.evaluation.jobs import Evaluator, Job
from ee_dist.robots.model import Robot
from ee_dist.trials.excitation import Excitation
from ee_dist.trials.log import Array

LIBRARY = (
    Excitation("rest", 2.0),
    Excitation("sway", 6.0, 0.1, 10),
    Excitation("multisine", 3.0, 0.3, 11),
    Excitation("multisine", 4.0, 1.0, 12, "stand"),
    Excitation("fast_sines", 1.8, 0.15, 13),
    Excitation("fast_sines", 3.0, 0.4, 14, "stand"),
    Excitation("steps", 1.8, 0.25, 15),
    Excitation("steps", 4.0, 0.6, 16, "stand"),
    Excitation("slow_sines", 9.6, 1.0, 17, "stand"),
    Excitation("gait", 1.8, 0.5, 18),
)


ENOUGH = 4.0
"""Standard deviations from which a trial is expected to tell two explanations apart."""


@dataclass(frozen=True)
class PlannedTrial:
    """``separation``: predicted distance of the two most similar explanations on this trial, in standard deviations of
    its noise (all channels and rows together). Below ENOUGH the trial would not tell them apart either."""

    excitation: Excitation
    separation: float


def next_trials(
    robot: Robot, tied: Sequence[Hypothesis], evaluator: Evaluator, library: Sequence[Excitation] = LIBRARY
) -> list[PlannedTrial]:
    """Excitations by how well they separate the hypotheses, the best first."""
    if len(tied) < 2:
        return []
    loose = [apply(robot, h) for h in tied]
    scale = channel_scale(robot, [])
    jobs, drivers = [], []
    models_of: list[list[Robot]] = []
    for excitation in library:
        driver = driver_of(excitation, robot)
        drivers.append(driver)
        held = setup_of(excitation)
        models_of.append([apply(m, held) for m in loose])
        jobs += [Job(_rollout(m, driver, excitation.steps(robot)), ToSensors()) for m in models_of[-1]]
    found = evaluator.evaluate(jobs)
    out = []
    for k, (excitation, driver) in enumerate(zip(library, drivers, strict=True)):
        models = models_of[k]
        logs = found[k * len(models) : (k + 1) * len(models)]
        if isinstance(driver, Commands):
            logs = [report(m, true) for m, true in zip(models, logs, strict=True)]
        gaps = [_distance(a, b, scale.scale) for a, b in combinations(logs, 2)]
        out.append(PlannedTrial(excitation, float(min(gaps)) if np.isfinite(gaps).all() else 0.0))
    return sorted(out, key=lambda p: -p.separation / np.sqrt(p.excitation.seconds))


def _rollout(model: Robot, driver: Commands | Network, steps: int) -> Rollout:
    if isinstance(driver, Network):
        return Rollout(model, driver, steps, seed=0)
    return Rollout(clean(model), Commands(np.ascontiguousarray(driver.values[:, list(model.wiring.source)])), steps)


def _distance(a: Array, b: Array, scale: Array) -> float:
    """In standard deviations; one channel and row counts at most as 6, so that a divergence late in a gait is no evidence."""
    return float(np.sqrt((np.minimum(np.abs(a - b) / scale, 6.0) ** 2).sum()))
