"""A robot in 3-D: solids that move, a track on the floor, a label, feet that light up when they touch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from ee_dist.engines.loop import gravity_vector
from ee_dist.robots.kinematics import part_poses
from ee_dist.robots.model import Robot
from ee_dist.robots.pictured import Solid, solids_of
from ee_dist.trials.log import Array, SensorLog
from ee_dist.trials.motion import base_poses, joint_positions
from ee_dist.viewing import drawn
from ee_dist.viewing.palette import FOOT, GRAVITY, LIMB, MEASURED, TOUCHING, Rgb
from ee_dist.viewing.stream import seconds_of, times

Rows = NDArray[np.intp]
POSE_HZ, TRACK_HZ, TRACK_UPDATES_HZ = 33.0, 10.0, 4.0
FLOOR_M = 0.003
"""Height of lines on the floor, just above it so that the two do not flicker."""
LABEL_ABOVE_M = 0.16
GRAVITY_M, GRAVITY_AT_M = 0.25, (0.25, 0.0, 0.15)
"""Length of the arrow of gravity, and where it begins, ahead of the body and above it."""


@dataclass(frozen=True, eq=False)
class Appearance:
    """One interval in which a robot is to be seen: ``model`` says which parts it still has, ``label`` floats above it.

    ``aside_m`` shifts it sideways (+y), so that a prediction goes beside the robot and not through it.
    """

    start_s: float
    model: Robot
    log: SensorLog
    label: str
    aside_m: float = 0.0

    @cached_property
    def moves(self) -> tuple[Array, dict[str, Array]]:
        """Thinned times (K,) on the timeline, s, and poses (K, 7) of every part; rows that the log lacks left out."""
        seconds = seconds_of(self.log)
        rows = thinned(seconds, POSE_HZ)
        base, joints = base_poses(self.model, self.log, rows).copy(), joint_positions(self.model, self.log)[rows]
        base[:, 1] += self.aside_m
        known = np.isfinite(base).all(axis=1) & np.isfinite(joints).all(axis=1)
        return self.start_s + seconds[rows][known], part_poses(self.model, base[known], joints[known])

    @property
    def body(self) -> Array:
        """Poses (K, 7) of the root part."""
        return self.moves[1][self.model.root.name]


Shown = Sequence[Appearance | None]


def send_robot(
    stream: rr.RecordingStream, path: str, robot: Robot, shown: Shown, starts_s: Sequence[float], ghost: Rgb | None
) -> None:
    """Send a robot under ``path``: one appearance a trial, None where it is not to be seen.

    ``ghost`` is the colour of one that is drawn see-through.
    """
    for part in robot.parts:
        moves = [a.moves for a in shown if a is not None and part.name in a.moves[1]]
        if not moves:
            continue
        place = f"{path}/{part.name}"
        pose = np.concatenate([poses[part.name] for _, poses in moves])
        columns = rr.Transform3D.columns(translation=pose[:, :3], quaternion=pose[:, 3:])
        stream.send_columns(place, [times(np.concatenate([at for at, _ in moves]))], columns)
        seen = [a is not None and part.name in a.moves[1] for a in shown]
        for solid in solids_of(robot, part):
            own = f"{place}/{solid.name}"
            colour = None if solid.senses else ghost or (MEASURED if part is robot.root else LIMB)
            _send_solid(stream, own, solid, colour, ghost is not None, seen, starts_s)
            if solid.senses:
                _send_touch(stream, own, solid, _touch_sensor(robot, part.name), shown, seen, ghost or FOOT)
    if robot.free_base:
        for a, start in zip(shown, starts_s, strict=True):
            _send_track(stream, f"{path}/track", a, start, ghost)
            _send_gravity(stream, f"{path}/gravity", a, start)
        _send_labels(stream, f"{path}/label", shown, starts_s, ghost or MEASURED)


def thinned(seconds: Array, hz: float) -> Rows:
    """Row numbers thinned to about ``hz``; first and last row stay."""
    last = len(seconds) - 1
    if last < 1:
        return np.arange(last + 1)
    stride = max(1, round(last / (hz * max(float(seconds[-1] - seconds[0]), 1e-9))))
    return np.unique(np.append(np.arange(0, last, stride), last))


def _touch_sensor(robot: Robot, part: str) -> str:
    return next(s.name for s in robot.sensors if s.kind == "touch" and s.target == part)


def _send_solid(
    stream: rr.RecordingStream,
    place: str,
    solid: Solid,
    colour: Rgb | None,
    ghost: bool,
    seen: Sequence[bool],
    starts_s: Sequence[float],
) -> None:
    if all(seen):
        stream.send_columns(place, [], drawn.columns(solid, colour, ghost, 1))
        return
    # Geometry that comes and goes: a row at the begin of each trial, empty where the part is not there.
    columns = drawn.columns(solid, colour, ghost, sum(seen)).partition([int(s) for s in seen])
    stream.send_columns(place, [times(np.array(starts_s))], columns)


def _send_touch(
    stream: rr.RecordingStream,
    place: str,
    solid: Solid,
    sensor: str,
    shown: Shown,
    seen: Sequence[bool],
    lifted: Rgb,
) -> None:
    """The colour of a foot, a row at each change."""
    at: list[Array] = []
    colours: list[Rgb] = []
    for a, there in zip(shown, seen, strict=True):
        if a is None or not there:
            continue
        told = sensor in a.log.sensor_names
        down = a.log.channel(sensor) > 0 if told else np.zeros(len(a.log), dtype=bool)
        rows = changes(down)
        at.append(a.start_s + seconds_of(a.log)[rows])
        colours += [TOUCHING if down[r] else lifted for r in rows]
    stream.send_columns(place, [times(np.concatenate(at))], drawn.colour_columns(solid, colours))


def changes(states: NDArray[np.bool_]) -> Rows:
    """Numbers of the rows at which a state begins; the first row is one."""
    return np.flatnonzero(np.append(True, states[1:] != states[:-1]))


def _send_track(
    stream: rr.RecordingStream, place: str, a: Appearance | None, start_s: float, ghost: Rgb | None
) -> None:
    """The way of the body so far, on the floor."""
    if a is None:
        stream.send_columns(place, [times(np.array([start_s]))], rr.LineStrips3D.columns(strips=[]).partition([0]))
        return
    seconds, points = a.moves[0], a.body[:, :3].copy()
    points[:, 2] = FLOOR_M
    kept, ends = thinned(seconds, TRACK_HZ), thinned(seconds, TRACK_UPDATES_HZ)
    strips = [points[np.append(kept[kept < end], end)].astype(np.float32) for end in ends]
    colours, radii = [ghost or MEASURED] * len(ends), [0.002 if ghost else 0.004] * len(ends)
    columns = rr.LineStrips3D.columns(strips=strips, colors=colours, radii=radii)
    stream.send_columns(place, [times(seconds[ends])], columns)


def _send_gravity(stream: rr.RecordingStream, place: str, a: Appearance | None, start_s: float) -> None:
    """An arrow where gravity pulls, on a slope only.

    The floor is drawn level: a slope turns gravity, as in the engine.
    """
    down = np.array((0.0, 0.0, -1.0) if a is None else gravity_vector(a.model))
    if a is None or not down[:2].any():
        stream.send_columns(place, [times(np.array([start_s]))], rr.Arrows3D.columns(vectors=[]).partition([0]))
        return
    arrow, count = GRAVITY_M * down / np.linalg.norm(down), len(a.body)
    columns = rr.Arrows3D.columns(
        origins=a.body[:, :3] + np.array(GRAVITY_AT_M),
        vectors=np.tile(arrow, (count, 1)),
        colors=[GRAVITY] * count,
        labels=["gravity"] * count,
        radii=[0.004] * count,
    )
    stream.send_columns(place, [times(a.moves[0])], columns)


def _send_labels(stream: rr.RecordingStream, place: str, shown: Shown, starts_s: Sequence[float], colour: Rgb) -> None:
    there = [a for a in shown if a is not None]
    points = np.concatenate([a.body[:, :3] for a in there]) + np.array((0.0, 0.0, LABEL_ABOVE_M))
    stream.send_columns(
        place, [times(np.concatenate([a.moves[0] for a in there]))], rr.Points3D.columns(positions=points)
    )
    texts = rr.Points3D.columns(labels=["" if a is None else a.label for a in shown])
    stream.send_columns(place, [times(np.array(starts_s))], texts)
    stream.log(place, rr.Points3D.from_fields(colors=[colour], radii=[0.0], show_labels=True), static=True)
