"""The scale of each channel: how large a residual has to be to say anything, and what noise alone leaves of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ee_dist.discrepancy.measured_trial import MeasuredTrial
from ee_dist.discrepancy.recorded import means_of
from ee_dist.discrepancy.slow_noise import MEDIAN_OF_SQUARES, slow_noise, without_motion
from ee_dist.discrepancy.ways.open_loop.prediction import roughness
from ee_dist.robots.described import OF_JOINT
from ee_dist.robots.model import Robot
from ee_dist.trials.log import Array, SensorLog
from ee_dist.trials.noise import channel_range

RESOLUTION = 0.002
"""Share of a channel's range below which no difference counts: models are not better than that, noise or not."""
PLACES = ("position", "angle")
"""Kinds of sensors that say where a joint is;"""
SPEED = "velocity"
"""and that says how fast it goes."""
TOUCH_SCALE = 0.2
"""A touch channel jumps by 2 when a contact comes a row early: its scale must not make one such row decide everything."""


@dataclass(frozen=True, eq=False)
class Scale:
    """``noise`` and ``scale``: (S,) in the units of the channels; ``least`` (S,) is what no model is better than. ``source`` says
    where the noise figures come from. ``loosened``: how many times less than ``least`` asks for counts what joints report beside
    their positions; ``of_lag``: because of what comes late, and not of what the described robot is off by."""

    noise: Array
    scale: Array
    least: Array
    source: str
    loosened: float = 1.0
    of_lag: bool = False


def channel_scale(robot: Robot, trials: Sequence[MeasuredTrial]) -> Scale:
    """The noise declared by the robot's sensors; where it declares none, measured between repeated trials, or else
    estimated from the second differences of the logs."""
    declared = np.array([s.noise for s in robot.sensors])
    spans = np.array([channel_range(robot, s) for s in robot.sensors])
    touch = np.array([s.kind == "touch" for s in robot.sensors])
    noise, source = declared, "declared by the sensors"
    if not declared.any():
        own = np.stack([t.recorded(robot) for t in trials])
        between = _between_repeats(trials, own)
        if between is not None:
            noise, source = between, "measured: differences between repeated trials"
        else:
            noise = np.sqrt(means_of(np.stack([_variance(t.log) for t in trials]), own))
            seldom = any(t.log.filled is not None for t in trials)
            source = f"estimated: {'divided' if seldom else 'second'} differences of the logs"
    scale = np.maximum(noise, RESOLUTION * spans)
    scale = np.where(touch, np.maximum(scale, TOUCH_SCALE), scale)
    return Scale(noise, scale, scale, source)


def no_more_than_places(
    scale: Scale, robot: Robot, off: Array, recorded: Array | None = None, changing: Array | None = None
) -> Scale:
    """The scale by which speeds and torques count no more than the positions that are measured beside them. ``off``: (S,) root
    mean squares by which the robot as described misses each channel, in its own unit; ``recorded``: (S,) which were recorded in
    some trial, if not all; ``changing``: (S,) by how much each changes in a second, root mean squares, if that is known.

    By shares of their ranges speeds count many times as much: what is late or too soft is quick, and a speed is off by
    it as many times more as it is quick. Then positions, for which people look at a model, decide nothing. Within what no model
    is better than positions ask for nothing more. What the described robot is off by tells that where it is soft; one
    that hangs too low is off in its positions alone, and what is left of it once that is put right is what comes late: then
    positions are off by how fast they change, and speeds by how fast these do."""
    kinds = np.array([s.kind for s in robot.sensors])
    there = np.ones(len(kinds), dtype=bool) if recorded is None else recorded
    places = np.isin(kinds, PLACES) & there
    seen = {s.target for s, place in zip(robot.sensors, places, strict=True) if place}
    beside = np.isin(kinds, OF_JOINT) & ~places & there & np.array([s.target in seen for s in robot.sensors])
    if not beside.any() or not np.isfinite(off).all():
        return scale
    squares = (off / scale.least) ** 2
    as_described = float(np.sqrt(squares[beside].mean() / max(1.0, squares[places].mean())))
    by_lag = 1.0 if changing is None else _by_lag(changing / scale.least, places, beside & (kinds == SPEED))
    times = max(as_described, by_lag)
    if times <= 1.0:
        return scale
    loosened = np.where(beside, times * scale.least, scale.least)
    return replace(scale, scale=loosened, loosened=times, of_lag=by_lag > as_described)


def _by_lag(changing: Array, places: Array, speeds: Array) -> float:
    """How many times more speeds are off than places where both come late, from how fast each changes (S,); 1 where nothing
    moves."""
    at_places = float((changing[places] ** 2).mean())
    return float(np.sqrt((changing[speeds] ** 2).mean() / at_places)) if at_places > 0 and speeds.any() else 1.0


def _variance(log: SensorLog) -> Array:
    """(S,) of the noise of what was read."""
    if log.filled is None:
        rough = np.sqrt(np.median(roughness(log.sensors), axis=0) / MEDIAN_OF_SQUARES)
        return without_motion(rough, log.times_s, log.sensors) ** 2
    return slow_noise(log.times_s[log.readings], log.sensors[log.readings]) ** 2


def _between_repeats(trials: Sequence[MeasuredTrial], recorded: Array) -> Array | None:
    """None where a channel that was ``recorded`` (trials, S) has no repeats."""
    groups: dict[str, list[int]] = {}
    for k, t in enumerate(trials):
        groups.setdefault(t.name, []).append(k)
    spread, known = [], []
    for members in groups.values():
        if len(members) > 1:
            logs = [trials[k].log.sensors for k in members]
            rows = min(map(len, logs))
            spread.append(np.var(np.stack([g[:rows] for g in logs]), axis=0, ddof=1).mean(axis=0))
            known.append(recorded[members].all(axis=0))
    if not spread or (recorded.any(axis=0) & ~np.any(known, axis=0)).any():
        return None
    return np.sqrt(means_of(np.stack(spread), np.stack(known)))
