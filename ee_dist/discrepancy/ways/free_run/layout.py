"""Where each value of a free run's residual belongs: row by row, channel by channel, piece after piece of the trials."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from ee_dist.discrepancy.problem import Index, Layout, joints_of
from ee_dist.discrepancy.ways.free_run.pieces import Piece
from ee_dist.robots.model import Robot
from ee_dist.trials.log import Array


def lay_out(
    robot: Robot,
    columns: Sequence[int],
    trials: Sequence[str],
    pieces: Sequence[Piece],
    own: Sequence[Index],
    blocks: int,
) -> tuple[Layout, list[slice]]:
    """Segments, channels and floors of all values, and where those of each piece are. A trial's values carry equal weight in
    sum, whatever its length: the floor of each is that weight. ``own``: which of the ``columns`` were recorded in each trial;
    ``blocks``: segments that a piece is cut into which is run through in one go."""
    rows, channels = [len(p.rows) for p in pieces], [own[p.trial] for p in pieces]
    starts = np.cumsum([0, *(count * len(some) for count, some in zip(rows, channels, strict=True))])
    names: list[str] = []
    of_trial: list[int] = []
    seg: list[Array] = []
    time: list[Array] = []
    for p, count, some in zip(pieces, rows, channels, strict=True):
        width = len(some)
        block, at = p.window, p.start_s + p.times_s
        cut = int(block.max()) + 1
        if cut == 1:
            cut = min(blocks, max(1, count // 10))
            block = np.arange(count) * cut // count
        seg.append(np.repeat(len(names) + block, width))
        time.append(np.repeat(at, width))
        names += [f"{trials[p.trial]}@{at[np.argmax(block == b)]:.1f}s" for b in range(cut)]
        of_trial += [p.trial] * cut
    segment_of, size = np.concatenate(seg), int(starts[-1])
    trial_of = np.array(of_trial)[segment_of]
    values = np.bincount(trial_of)
    weight = (values[values > 0].mean() / np.maximum(values, 1))[trial_of]
    sensors = [robot.sensors[k] for k in columns]
    layout = Layout(
        segments=tuple(names),
        trial_of_segment=np.array(of_trial),
        segment_of=segment_of,
        channel_of=np.concatenate([np.tile(some, count) for some, count in zip(channels, rows, strict=True)]),
        time_s=np.concatenate(time),
        reading=np.ones(size, dtype=bool),
        floor=weight,
        known=np.zeros(size),
        channels=tuple(s.name for s in sensors),
        units=tuple(s.unit for s in sensors),
        joint_of_channel=joints_of(robot, [s.target for s in sensors]),
    )
    return layout, [slice(int(a), int(b)) for a, b in pairwise(starts)]
