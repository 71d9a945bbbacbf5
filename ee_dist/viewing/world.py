"""The 3-D world of a scene: the robot, the prediction, the floor with its marks, and where the camera looks."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from ee_dist.effects.catalogue import Hypothesis, apply
from ee_dist.effects.effect import EffectError
from ee_dist.robots.model import Robot
from ee_dist.robots.pictured import reach
from ee_dist.trials.log import Array
from ee_dist.viewing.palette import GROUND, Rgb
from ee_dist.viewing.robot3d import Appearance, Shown, send_robot
from ee_dist.viewing.stream import times

WORLD = "world"
FOCUS = f"{WORLD}/camera_focus"
BESIDE_M = 0.5
"""How far a walking prediction keeps to the left of the robot. One with a fixed base lies over it."""
LOOK_AHEAD_M = 0.3
"""How far the camera leaves the robot at most to keep the prediction in sight."""
WALKING_EYE, WALKING_TARGET = (-0.3, -0.85, 0.75), (0.03, 0.2, 0.06)
FIXED_EYE = (-0.35, -0.9, 0.3)
FIXED_DISTANCE = 2.2
"""Of the camera, in sizes of what moves."""


@dataclass(frozen=True)
class Ghost:
    """A robot drawn see-through: what a model says. An appearance a trial, None where it is not to be seen."""

    key: str
    colour: Rgb
    shown: Shown


def send_world(
    stream: rr.RecordingStream, robot: Robot, real: Shown, ghosts: Sequence[Ghost], starts_s: Sequence[float]
) -> None:
    """Send all that is seen in 3-D: an appearance a trial of the robot and of its ghosts; the camera heeds the first."""
    stream.log(WORLD, rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    if any(real):
        send_robot(stream, f"{WORLD}/measured", robot, real, starts_s, None)
    for ghost in ghosts:
        if any(ghost.shown):
            send_robot(stream, f"{WORLD}/{ghost.key}", robot, ghost.shown, starts_s, ghost.colour)
    if robot.free_base and any(real):
        _send_marks(stream, [*real, *(a for g in ghosts for a in g.shown)])
        _send_focus(stream, real, ghosts[0].shown if ghosts else [None] * len(real))


def seen(appearance: Appearance) -> Appearance | None:
    """The appearance, or None where its log holds no pose to draw."""
    return appearance if len(appearance.moves[0]) else None


def believed_model(robot: Robot, hypothesis: Hypothesis) -> Robot:
    """The robot under a hypothesis; the robot itself where an effect of a user's own is not loaded here."""
    try:
        return apply(robot, hypothesis)
    except EffectError:
        return robot


def eye(robot: Robot, real: Shown) -> rrb.EyeControls3D:
    """From the right and above: going along with a robot that walks, framing one that stands."""
    if robot.free_base:
        return rrb.EyeControls3D(
            kind=rrb.Eye3DKind.Orbital, position=WALKING_EYE, look_target=WALKING_TARGET, tracking_entity="/" + FOCUS
        )
    found = [pose[:, :3] for a in real if a is not None for pose in a.moves[1].values()]
    places = np.concatenate(found) if found else np.zeros((1, 3))
    middle = (places.max(axis=0) + places.min(axis=0)) / 2
    spread = float(np.linalg.norm(places.max(axis=0) - places.min(axis=0)))
    size = max(spread, 2 * max(reach(robot, part) for part in robot.parts))
    position = middle + FIXED_DISTANCE * size / 2 * np.array(FIXED_EYE) / np.linalg.norm(FIXED_EYE)
    return rrb.EyeControls3D(kind=rrb.Eye3DKind.Orbital, position=position, look_target=middle)


def _send_marks(stream: rr.RecordingStream, shown: Shown) -> None:
    """Lines across the floor at the start and at every metre."""
    farthest = max(float(a.body[:, 0].max()) for a in shown if a is not None)
    marks = range(max(math.ceil(farthest), 0) + 1)
    near, far = -0.35, BESIDE_M + 0.35
    lines = [[(x, near, 0.0), (x, far, 0.0)] for x in marks]
    stream.log(f"{WORLD}/marks", rr.LineStrips3D(lines, colors=GROUND, radii=0.002), static=True)
    labels = ["start" if x == 0 else f"{x} m" for x in marks]
    ends = [(x, near - 0.05, 0.0) for x in marks]
    texts = rr.Points3D(ends, radii=0.0, labels=labels, colors=GROUND, show_labels=True)
    stream.log(f"{WORLD}/marks/labels", texts, static=True)


def _send_focus(stream: rr.RecordingStream, real: Shown, ghost: Shown) -> None:
    """An unseen point that the camera follows: between robot and prediction, near the robot, steady in height.

    The camera could follow the body itself, but then every bob of a gait would shake the picture.
    """
    at: list[Array] = []
    points: list[Array] = []
    for a, b in zip(real, ghost, strict=True):
        if a is None:
            continue
        place = a.body[:, :3].copy()
        if b is not None:
            ahead = np.interp(a.moves[0], b.moves[0], b.body[:, 0]) - place[:, 0]
            place[:, 0] += np.clip(ahead / 2, -LOOK_AHEAD_M, LOOK_AHEAD_M)
            place[:, 1] += b.aside_m / 2
        place[:, 2] = a.model.start_position_m[2]
        at.append(a.moves[0])
        points.append(place)
    stream.send_columns(FOCUS, [times(np.concatenate(at))], rr.Points3D.columns(positions=np.concatenate(points)))
    stream.log(FOCUS, rr.Points3D.from_fields(radii=[0.0]), static=True)
