"""Where each value of a residual in open loop belongs: means of channels, then their texture, part after part of the trials."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ee_dist.discrepancy.problem import Layout, joints_of
from ee_dist.discrepancy.ways.open_loop.prediction import block_sums
from ee_dist.discrepancy.ways.open_loop.stretches import Stretch
from ee_dist.discrepancy.ways.open_loop.weights import Weights
from ee_dist.engines.drivers import Network
from ee_dist.robots.model import Robot
from ee_dist.trials.log import Array


def lay_out(
    robot: Robot, parts: Sequence[Stretch], imported: Sequence[bool], weights: Weights, soft: float
) -> tuple[Layout, list[slice]]:
    """Segments, channels and floors of all values, and where those of each part are. ``imported``: whether a part is of a trial
    whose rows are not all readings."""
    names: list[str] = []
    seg: list[Array] = []
    chan: list[Array] = []
    floor: list[Array] = []
    known: list[Array] = []
    time: list[Array] = []
    reading: list[Array] = []
    trial_of_segment: list[int] = []
    slices: list[slice] = []
    block, window = weights.block, weights.window
    per = window // block
    at = 0
    looped = any(isinstance(p.run.driver, Network) for p in parts)
    for k, (part, filled) in enumerate(zip(parts, imported, strict=True)):
        own, rows = weights.own[k], len(part.run.log.readings)
        s = len(own)
        blocks, windows = rows // block, rows // window
        first = len(names)
        count = max(1, windows)
        names += [f"{part.run.name}@{_begins(robot, part, w * window):.1f}s" for w in range(count)]
        trial_of_segment += [part.trial] * count
        of_block = first + np.minimum(np.arange(blocks) // per, count - 1)
        seg += [np.repeat(of_block, s), np.repeat(first + np.arange(windows), 2 * s)]
        chan += [np.tile(own, blocks), np.tile(own, 2 * windows)]
        middle = _middles(robot, part, filled, block)
        time += [np.repeat(middle, s), np.repeat(_middles(robot, part, filled, window), 2 * s)]
        reading += [np.ones(blocks * s, dtype=bool), np.zeros(2 * windows * s, dtype=bool)]
        least, left = weights.floors(k, soft)
        floor += least
        known += left
        if isinstance(part.run.driver, Network):
            m = len(robot.drives)
            seg.append(np.repeat(of_block, m))
            chan.append(np.tile(len(robot.sensors) + np.arange(m), blocks))
            time.append(np.repeat(middle, m))
            reading.append(np.zeros(m * blocks, dtype=bool))
            floor.append(np.zeros(m * blocks))
            known.append(np.zeros(m * blocks))
        size = sum(map(len, seg)) - at
        slices.append(slice(at, at + size))
        at += size
    computed = robot.motor_names if looped else ()
    layout = Layout(
        segments=tuple(names),
        trial_of_segment=np.array(trial_of_segment),
        segment_of=np.concatenate(seg).astype(np.int64),
        channel_of=np.concatenate(chan).astype(np.int64),
        time_s=np.concatenate(time),
        reading=np.concatenate(reading).astype(bool),
        floor=np.concatenate(floor),
        known=np.concatenate(known),
        channels=(*robot.sensor_names, *(f"command_{m}" for m in computed)),
        units=(*(x.unit for x in robot.sensors), *(_joint_unit(robot, m) for m in computed)),
        joint_of_channel=joints_of(robot, [*(x.target for x in robot.sensors), *computed]),
    )
    return layout, slices


def _begins(robot: Robot, part: Stretch, row: int) -> float:
    """When a reading was taken, s."""
    log = part.run.log
    return row * robot.time_step_s if log.filled is None else float(log.times_s[log.readings[row]])


def _middles(robot: Robot, part: Stretch, filled: bool, size: int) -> Array:
    """(R // size,) middles of so many readings in a row, s."""
    log, step = part.run.log, robot.time_step_s
    if log.filled is None:
        return (np.arange(len(log.readings) // size) + 0.5) * size * step
    # What is read in every row stands for a step, of which its time is the beginning.
    half = 0.0 if filled else step / 2
    return block_sums(log.times_s[log.readings][:, None], size)[:, 0] / size + half


def _joint_unit(robot: Robot, joint: str) -> str:
    return "m" if robot.joint(joint).kind == "slide" else "rad"
