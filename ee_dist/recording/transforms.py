"""The body of a trial as Foxglove frame transforms, so that a viewer shows it moving without knowing our robots.

A picture, not data: a coarse rate and single precision keep it a small share of the file. The reader does not use it.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ee_dist.effects.catalogue import apply
from ee_dist.effects.effect import EffectError
from ee_dist.recording.clock import SECOND_NS, offsets_ns
from ee_dist.recording.records import TrialRecord
from ee_dist.recording.schemas import FrameTransform, FrameTransforms
from ee_dist.recording.topics import FLOOR_FRAME, part_frame
from ee_dist.robots.kinematics import Array, part_poses
from ee_dist.robots.model import Robot
from ee_dist.trials.motion import base_poses, joint_positions

PERIOD_NS = SECOND_NS // 25


def transform_messages(record: TrialRecord, robot: Robot, start_ns: int) -> Iterator[tuple[int, Any]]:
    """(log time in ns, FrameTransforms) of the parts, about 25 a second.

    Joints that the log does not hold are taken from its position sensors; a body whose place was not measured stays
    where it starts. A prediction is drawn as the model that it comes from, without parts that its hypothesis says are lost.
    """
    log = record.log
    if not len(log):
        return
    offsets = offsets_ns(log.times_s)
    rows = _thinned(offsets)
    # A sensor may say infinity; such a pose gets no frame below.
    with np.errstate(invalid="ignore", over="ignore"):
        base, joints = base_poses(robot, log, np.array(rows)), joint_positions(robot, log)[rows]
        poses = part_poses(model_of(record, robot), base, joints)
    frames = {part_frame(record.source, name): _single(pose) for name, pose in poses.items()}
    for k, row in enumerate(rows):
        log_time = start_ns + int(offsets[row])
        stamp = {"seconds": log_time // SECOND_NS, "nanos": log_time % SECOND_NS}
        yield (
            log_time,
            FrameTransforms(
                transforms=[
                    FrameTransform(
                        timestamp=stamp,
                        parent_frame_id=FLOOR_FRAME,
                        child_frame_id=frame,
                        translation=dict(zip("xyz", pose[k][:3], strict=True)),
                        rotation=dict(zip("xyzw", pose[k][3:], strict=True)),
                    )
                    for frame, pose in frames.items()
                    if pose[k] is not None
                ]
            ),
        )


def model_of(record: TrialRecord, robot: Robot) -> Robot:
    """The robot to draw: under what a prediction believes."""
    try:
        return apply(robot, record.believed)
    except EffectError:  # an effect of a plugin that is not loaded: draw the robot as it was
        return robot


def _thinned(offsets: NDArray[np.int64]) -> list[int]:
    """The first row of every period."""
    slots = offsets // PERIOD_NS
    return [0, *(int(k) + 1 for k in np.flatnonzero(slots[1:] > np.maximum.accumulate(slots[:-1])))]


def _single(pose: Array) -> list[Any]:
    """Rows of (T, 7) in single precision; None in place of a row that is not finite."""
    finite = np.all(np.isfinite(pose), axis=1).tolist()
    with np.errstate(over="ignore"):
        rounded = pose.astype(np.float32).astype(float).tolist()
    return [row if good else None for row, good in zip(rounded, finite, strict=True)]
