"""Stops that a robot was seen beyond: they are not where its description has them.

A simulated joint cannot follow its robot through a stop, so that every fit would make up for a wall that is not there.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ee_dist.robots.model import Joint, Robot
from ee_dist.robots.ranges import span

BEYOND = 0.01
"""Share of a joint's range by which a reading may lie outside it: stops give way a little, sensors are calibrated so well."""
NOISE = 5.0
"""Standard deviations of a sensor that count as its noise, of thousands of readings."""


def past(joint: Joint, lowest: float, highest: float, noise: float = 0.0) -> tuple[float | None, float | None]:
    """How far positions from ``lowest`` to ``highest`` (rad, m) lead beyond the lower and the upper stop; None: they do not."""
    low, high = joint.ends
    first, last = span(joint)
    allowed = max(BEYOND * (last - first), NOISE * noise)
    return (low - lowest if low - lowest > allowed else None, highest - high if highest - high > allowed else None)


def told(joint: Joint, lowest: float, highest: float, noise: float = 0.0) -> Iterator[str]:
    """Words for each stop that was passed: ``reaches -1.92 rad, 0.26 beyond the stop at -1.66``."""
    unit = "rad" if joint.kind == "hinge" else "m"
    for reached, by, stop in zip((lowest, highest), past(joint, lowest, highest, noise), joint.ends, strict=True):
        if by is not None:
            yield f"reaches {reached:.3g} {unit}, {by:.2g} beyond the stop at {stop:.3g}"


def with_room(robot: Robot, readings: Sequence[NDArray[np.float64]]) -> tuple[Robot, tuple[str, ...]]:
    """The robot with its stops moved out to what was measured, and a line for each.

    ``readings``: of each trial, all sensors, (T, number of sensors). A sensor that is off by a constant would move a stop to
    where none is felt, which changes nothing that was measured.
    """
    joints, lines = list(robot.joints), []
    for k, sensor in enumerate(robot.sensors):
        if sensor.kind != "position" or not readings:
            continue
        seen = np.concatenate([r[:, k] for r in readings])
        lowest, highest = float(seen.min()), float(seen.max())
        at = next(i for i, j in enumerate(joints) if j.name == sensor.target)
        joint = joints[at]
        below, above = past(joint, lowest, highest, sensor.noise)
        lines += [f"{joint.name} {words}" for words in told(joint, lowest, highest, sensor.noise)]
        if below is not None:
            joint = replace(joint, lower=lowest)
        if above is not None:
            joint = replace(joint, upper=highest)
        joints[at] = joint
    return (replace(robot, joints=tuple(joints)) if lines else robot), tuple(lines)
