"""The rerun recordings of compare, explain and improve: measured robot and predicted ghosts, channels, ladder."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ee_dist.discrepancy.improve import Rung
from ee_dist.discrepancy.problem import Problem
from ee_dist.discrepancy.words import Account, placed
from ee_dist.effects.catalogue import Hypothesis, apply
from ee_dist.viewing.comparison import Rung as Shown
from ee_dist.viewing.comparison import write_comparison_rrd


def write_scene(
    problem: Problem,
    models: Sequence[tuple[str, Hypothesis]],
    path: Path,
    verb: str,
    account: Account,
    ladder: Sequence[Rung] = (),
) -> None:
    """``models``: (label, terms), the last of which is what the scene predicts with."""
    _, terms = models[-1]
    motions = problem.simulated(terms)
    if any(m is None for m in motions):
        return
    pairs = []
    said = problem.series(terms)
    for k, (trial, motion) in enumerate(zip(problem.measured, motions, strict=True)):
        assert motion is not None
        sensors = np.array(motion.sensors)
        names = list(trial.log.sensor_names)
        for s in said:
            if s.trial == k and problem.channels[s.channel] in names and len(s.predicted) == len(sensors):
                sensors[:, names.index(problem.channels[s.channel])] = s.predicted
        pairs.append((f"{k + 1} {trial.name}", trial.log, replace(motion, sensors=sensors)))
    rungs = [Shown(placed(r.name), r.error_heldout, r.error_fit) for r in ladder] or None
    write_comparison_rrd(apply(problem.robot, terms), pairs, path, rungs, f"{verb}: {account.headline}")
