"""Channels that nobody recorded in some of the trials: what is made of all trials is made of those that have them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ee_dist.basics.names import counted, listed
from ee_dist.discrepancy.measured_trial import MeasuredTrial
from ee_dist.robots.model import Robot
from ee_dist.trials.log import Array

NOT_COMPARED = "not compared. A model goes by commands that were held there: what it leaves right after may be of that"
"""What becomes of rows that were lost, where a model is simulated."""


def means_of(values: Array, recorded: Array) -> Array:
    """(C,) means of values (N, C) over those that were ``recorded`` (N, C); 0 where none was."""
    if recorded.all():
        return np.asarray(np.mean(values, axis=0))
    return np.asarray(np.where(recorded, values, 0.0).sum(axis=0) / np.maximum(recorded.sum(axis=0), 1))


def medians_of(values: Array, recorded: Array) -> Array:
    """The same of medians."""
    if recorded.all():
        return np.asarray(np.median(values, axis=0))
    pairs = zip(values.T, recorded.T, strict=True)
    return np.array([np.median(column[own]) if own.any() else 0.0 for column, own in pairs])


def row_by_row(each: Sequence[Array], recorded: Sequence[Array]) -> Array:
    """(N, C) whether it was recorded in its trial, of each value of several tables (R, C), one below the other."""
    return np.concatenate([np.broadcast_to(own, rows.shape) for rows, own in zip(each, recorded, strict=True)])


def not_compared(trials: Sequence[MeasuredTrial], robot: Robot) -> list[str]:
    """What of the trials is not compared, in a line for people; none where all of it is."""
    own = np.stack([t.recorded(robot) for t in trials])
    if own.all():
        return []
    some = [t.name for t, seen in zip(trials, own, strict=True) if not seen.all()]
    line = f"Channels that nobody recorded in a trial are not compared in it ({counted(len(some), 'trial')}: {listed(some)})"
    if never := [name for name, seen in zip(robot.sensor_names, own.T, strict=True) if not seen.any()]:
        line += f"; recorded in none: {listed(never)}"
    return [f"{line}."]


def bridged(trials: Sequence[MeasuredTrial], become: str = NOT_COMPARED) -> list[str]:
    """That rows were lost, and what becomes of those that stand in their place, in a line for people; none where none were."""
    lost = [(t, int(t.log.bridged.sum())) for t in trials]
    some = [t for t, rows in lost if rows]
    if not some:
        return []
    rows, of = sum(rows for _, rows in lost), sum(len(t.log) for t in trials)
    where = f"{counted(len(some), 'trial')}: {listed(t.name for t in some)}"
    return [f"{rows} of {of} rows lie in gaps between readings ({where}): they are bridged by lines, and {become}."]
