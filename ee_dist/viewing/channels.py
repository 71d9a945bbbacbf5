"""Channels over time: each sensor measured and predicted, touch as lanes of states, commands."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import rerun as rr

from ee_dist.trials.log import Array, SensorLog
from ee_dist.viewing.palette import (
    AIR,
    GROUND,
    MEASURED,
    MEASURED_NAME,
    PREDICTED,
    PREDICTED_NAME,
    RESIDUALS,
    Rgb,
    series_colour,
)
from ee_dist.viewing.robot3d import changes
from ee_dist.viewing.stream import interval_s, seconds_of, times


@dataclass(frozen=True)
class Pair:
    """A measured log and what a model predicted for it, from ``start_s`` of the timeline on."""

    name: str
    start_s: float
    measured: SensorLog
    predicted: SensorLog | None = None


def units_of(pairs: Sequence[Pair]) -> dict[str, str]:
    """Units of all measured channels, by name, in the order of their first log."""
    return {n: u for p in pairs for n, u in zip(p.measured.sensor_names, p.measured.sensor_units, strict=True)}


def send_sensors(
    stream: rr.RecordingStream, pairs: Sequence[Pair], switches: Sequence[str], path: str = "sensors"
) -> None:
    """Scalars at ``<path>/<channel>/measured`` and ``.../predicted``, all rows; ``switches`` are drawn in steps.

    The prediction is a thin line upon a thick one, so that both are seen where they agree.
    """
    for source, colour, width in ((MEASURED_NAME, MEASURED, 3.5), (PREDICTED_NAME, PREDICTED, 1.25)):
        logs = [(p.start_s, p.measured if source == MEASURED_NAME else p.predicted) for p in pairs]
        present = [(start, log) for start, log in logs if log is not None]
        if not present:
            continue
        for name in units_of(pairs):
            place = f"{path}/{name}/{source}"
            _send_scalars(stream, place, [(s, g, g.channel(name)) for s, g in present if name in g.sensor_names])
            line = rr.SeriesLines(
                colors=colour,
                names=source,
                widths=width,
                # A switch knows no values between its two: neither slopes nor means.
                interpolation_mode="StepAfter" if name in switches else None,
                aggregation_policy="MinMax" if name in switches else None,
            )
            stream.log(place, line, static=True)


def residual(pairs: Sequence[Pair], name: str) -> Array:
    """Measured minus predicted of one channel over the rows that both logs of a pair have, all pairs in a row."""
    return np.concatenate([np.zeros(0), *(r for _, _, r in _residuals(pairs, name))])


def send_residuals(stream: rr.RecordingStream, pairs: Sequence[Pair], path: str = "residuals") -> None:
    """Scalars at ``<path>/<channel>``: measured minus predicted."""
    seen: dict[str, int] = {}
    for name, unit in units_of(pairs).items():
        place = f"{path}/{name}"
        _send_scalars(stream, place, _residuals(pairs, name))
        colour = RESIDUALS[seen.setdefault(unit, 0) % len(RESIDUALS)]
        seen[unit] += 1
        stream.log(place, rr.SeriesLines(colors=colour, names=name, widths=1.5), static=True)


def _residuals(pairs: Sequence[Pair], name: str) -> list[tuple[float, SensorLog, Array]]:
    found = []
    for pair in pairs:
        if pair.predicted is not None and name in pair.measured.sensor_names and name in pair.predicted.sensor_names:
            rows = min(len(pair.measured), len(pair.predicted))
            rest = pair.measured.channel(name)[:rows] - pair.predicted.channel(name)[:rows]
            found.append((pair.start_s, pair.measured.head(rows), rest))
    return found


def send_commands(stream: rr.RecordingStream, pairs: Sequence[Pair], path: str = "commands") -> None:
    """Scalars at ``<path>/<motor>``: what was commanded on the hardware."""
    for k, name in enumerate(pairs[0].measured.motor_names):
        place = f"{path}/{name}"
        _send_scalars(stream, place, [(p.start_s, p.measured, p.measured.commands[:, k]) for p in pairs])
        stream.log(place, rr.SeriesLines(colors=series_colour(k), names=name, widths=1.0), static=True)


def send_touch(stream: rr.RecordingStream, pairs: Sequence[Pair], names: Sequence[str], path: str = "touch") -> None:
    """Lanes at ``<path>/<channel>/<source>``: on the ground (channel above zero) or in the air."""
    for name in names:
        for source, colour in ((MEASURED_NAME, MEASURED), (PREDICTED_NAME, PREDICTED)):
            at: list[Array] = []
            states: list[str | None] = []
            for pair in pairs:
                log = pair.measured if source == MEASURED_NAME else pair.predicted
                if log is None or name not in log.sensor_names:
                    continue
                down = log.channel(name) > 0
                rows = changes(down)
                at += [pair.start_s + seconds_of(log)[rows], np.array([pair.start_s + interval_s(log)])]
                states += ["ground" if down[r] else "air" for r in rows] + [None]
            if at:
                place = f"{path}/{name.removeprefix('touch_')}/{source}"
                _send_states(stream, place, np.concatenate(at), states, {"ground": colour, "air": AIR}, labelled=False)


def send_trial_lane(
    stream: rr.RecordingStream, pairs: Sequence[Pair], labels: Sequence[str], path: str = "trial"
) -> None:
    """One lane that names the trial of each interval."""
    at: list[float] = []
    states: list[str | None] = []
    for pair, label in zip(pairs, labels, strict=True):
        at += [pair.start_s, pair.start_s + interval_s(pair.measured)]
        states += [label, None]
    _send_states(stream, path, np.array(at), states, dict.fromkeys(labels, GROUND))


def _send_states(
    stream: rr.RecordingStream,
    place: str,
    at: Array,
    states: list[str | None],
    colours: dict[str, Rgb],
    labelled: bool = True,
) -> None:
    values = list(colours)
    labels = values if labelled else [" "] * len(values)
    stream.log(place, rr.StateConfiguration(values=values, labels=labels, colors=list(colours.values())), static=True)
    lengths = [0 if s is None else 1 for s in states]
    column = rr.StateChange.columns(state=[s for s in states if s is not None]).partition(lengths)
    stream.send_columns(place, [times(at)], column)


def _send_scalars(stream: rr.RecordingStream, place: str, series: Sequence[tuple[float, SensorLog, Array]]) -> None:
    at: list[Array] = []
    values: list[Array] = []
    if not series:
        return
    for start, log, numbers in series:
        # A row without a number after the last one keeps a line from running on into the next trial.
        at += [start + seconds_of(log), np.array([start + interval_s(log)])]
        values += [numbers, np.array([np.nan])]
    stream.send_columns(place, [times(np.concatenate(at))], rr.Scalars.columns(scalars=np.concatenate(values)))
