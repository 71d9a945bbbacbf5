"""Channels over time: each sensor measured and predicted, touch as lanes of states, commands."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import rerun as rr

from ee_dist.trials.log import Array, SensorLog
from ee_dist.viewing.palette import (
    AIR,
    GROUND,
    MEASURED,
    MEASURED_NAME,
    PREDICTED,
    RESIDUALS,
    Rgb,
    series_colour,
)
from ee_dist.viewing.robot3d import changes
from ee_dist.viewing.stream import interval_s, seconds_of, times


@dataclass(frozen=True)
class Model:
    """A model that says what the trials would be: its place among the entities, its name for people, its colour."""

    key: str
    label: str
    colour: Rgb = PREDICTED


@dataclass(frozen=True)
class Shot:
    """A measured log and what models say of it, by their keys, from ``start_s`` of the timeline on."""

    name: str
    start_s: float
    measured: SensorLog
    said: Mapping[str, SensorLog] = field(default_factory=dict)


def units_of(shots: Sequence[Shot]) -> dict[str, str]:
    """Units of all measured channels, by name, in the order of their first log."""
    return {n: u for p in shots for n, u in zip(p.measured.sensor_names, p.measured.sensor_units, strict=True)}


def send_sensors(
    stream: rr.RecordingStream,
    shots: Sequence[Shot],
    models: Sequence[Model],
    switches: Sequence[str],
    path: str = "sensors",
) -> None:
    """Scalars at ``<path>/<channel>/measured`` and ``.../<model>``, all rows; ``switches`` are drawn in steps.

    What a model says is a thin line upon a thick one, so that both are seen where they agree.
    """
    for source, width in ((Model(MEASURED_NAME, MEASURED_NAME, MEASURED), 3.5), *((m, 1.25) for m in models)):
        logs = [(p.start_s, p.measured if source.key == MEASURED_NAME else p.said.get(source.key)) for p in shots]
        present = [(start, log) for start, log in logs if log is not None]
        if not present:
            continue
        for name in units_of(shots):
            place = f"{path}/{name}/{source.key}"
            send_scalars(stream, place, [(s, g, g.channel(name)) for s, g in present if name in g.sensor_names])
            stream.log(place, _line(name in switches, source.colour, source.label, width), static=True)


def send_measured(
    stream: rr.RecordingStream,
    shots: Sequence[Shot],
    groups: Iterable[Sequence[str]],
    switches: Sequence[str],
    path: str = "sensors",
) -> None:
    """Scalars at ``<path>/<channel>/measured``; the channels of a group, which share a plot, in different colours."""
    for names in groups:
        for k, name in enumerate(names):
            place = f"{path}/{name}/{MEASURED_NAME}"
            logs = [(s.start_s, s.measured) for s in shots if name in s.measured.sensor_names]
            send_scalars(stream, place, [(start, log, log.channel(name)) for start, log in logs])
            stream.log(place, _line(name in switches, series_colour(k), name.replace("_", " "), 1.5), static=True)


def _line(switch: bool, colour: Rgb, name: str, width: float) -> rr.SeriesLines:
    return rr.SeriesLines(
        colors=colour,
        names=name,
        widths=width,
        # A switch knows no values between its two: neither slopes nor means.
        interpolation_mode="StepAfter" if switch else None,
        aggregation_policy="MinMax" if switch else None,
    )


def residual(shots: Sequence[Shot], name: str, model: str) -> Array:
    """Measured minus what a model says of one channel, over the rows that both logs have, all shots in a row."""
    return np.concatenate([np.zeros(0), *(r for _, _, r in _residuals(shots, name, model))])


def send_residuals(
    stream: rr.RecordingStream, shots: Sequence[Shot], models: Sequence[Model], path: str = "residuals"
) -> None:
    """Scalars at ``<path>/<channel>/<model>``: measured minus what the model says. One model: a colour a channel."""
    seen: dict[str, int] = {}
    for name, unit in units_of(shots).items():
        colour = RESIDUALS[seen.setdefault(unit, 0) % len(RESIDUALS)]
        seen[unit] += 1
        for m in models:
            place = f"{path}/{name}/{m.key}"
            send_scalars(stream, place, _residuals(shots, name, m.key))
            line = (colour, name) if len(models) == 1 else (m.colour, m.label)
            stream.log(place, rr.SeriesLines(colors=line[0], names=line[1], widths=1.5), static=True)


def _residuals(shots: Sequence[Shot], name: str, model: str) -> list[tuple[float, SensorLog, Array]]:
    found = []
    for shot in shots:
        said = shot.said.get(model)
        if said is not None and name in shot.measured.sensor_names and name in said.sensor_names:
            rows = min(len(shot.measured), len(said))
            rest = shot.measured.channel(name)[:rows] - said.channel(name)[:rows]
            found.append((shot.start_s, shot.measured.head(rows), rest))
    return found


def send_commands(stream: rr.RecordingStream, shots: Sequence[Shot], path: str = "commands") -> None:
    """Scalars at ``<path>/<motor>``: what was commanded on the hardware."""
    for k, name in enumerate(shots[0].measured.motor_names):
        place = f"{path}/{name}"
        send_scalars(stream, place, [(p.start_s, p.measured, p.measured.commands[:, k]) for p in shots])
        stream.log(place, rr.SeriesLines(colors=series_colour(k), names=name, widths=1.0), static=True)


def send_touch(
    stream: rr.RecordingStream,
    shots: Sequence[Shot],
    models: Sequence[Model],
    names: Sequence[str],
    path: str = "touch",
) -> None:
    """Lanes at ``<path>/<channel>/<source>``: on the ground (channel above zero) or in the air."""
    for name in names:
        for source in (Model(MEASURED_NAME, MEASURED_NAME, MEASURED), *models):
            at: list[Array] = []
            states: list[str | None] = []
            for shot in shots:
                log = shot.measured if source.key == MEASURED_NAME else shot.said.get(source.key)
                if log is None or name not in log.sensor_names:
                    continue
                down = log.channel(name) > 0
                rows = changes(down)
                at += [shot.start_s + seconds_of(log)[rows], np.array([shot.start_s + interval_s(log)])]
                states += ["ground" if down[r] else "air" for r in rows] + [None]
            if at:
                place = f"{path}/{name.removeprefix('touch_')}/{source.key}"
                colours = {"ground": source.colour, "air": AIR}
                _send_states(stream, place, np.concatenate(at), states, colours, labelled=False)


def send_trial_lane(
    stream: rr.RecordingStream, shots: Sequence[Shot], labels: Sequence[str], path: str = "trial"
) -> None:
    """One lane that names the trial of each interval."""
    at: list[float] = []
    states: list[str | None] = []
    for shot, label in zip(shots, labels, strict=True):
        at += [shot.start_s, shot.start_s + interval_s(shot.measured)]
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


def send_scalars(stream: rr.RecordingStream, place: str, series: Sequence[tuple[float, SensorLog, Array]]) -> None:
    """Scalars at ``place``: of each log, from its start on, one number a row; none where rows were lost, so that no line is
    drawn over a gap as if it had been measured."""
    at: list[Array] = []
    values: list[Array] = []
    if not series:
        return
    for start, log, numbers in series:
        # A row without a number after the last one keeps a line from running on into the next trial.
        at += [start + seconds_of(log), np.array([start + interval_s(log)])]
        values += [np.where(log.bridged, np.nan, numbers), np.array([np.nan])]
    stream.send_columns(place, [times(np.concatenate(at))], rr.Scalars.columns(scalars=np.concatenate(values)))
