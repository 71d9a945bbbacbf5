"""Drive laws of controllers that come with the robots here."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ee_dist.effects.laws import LawContext, drive_law
from ee_dist.robots.linear_stage import SPEED_LAW

CONTROLLER_LAWS = frozenset({SPEED_LAW})
"""Laws that are part of a controller: where the drive's force was measured, they have had their say."""


@drive_law(SPEED_LAW)
def speed_from_readings(context: LawContext) -> NDArray[np.float64]:
    """The controller's speed is a difference of position readings over ``samples`` steps, not the true speed.

    The drive has damped with gain * true speed; this puts the difference in its place. It holds as long as the
    controller's output is not clipped.
    """
    samples = np.maximum(context.values["samples"], 1.0).astype(int)
    past = context.memory.get("readings")
    if past is None:
        past = np.repeat(context.position[None], int(samples.max()) + 1, axis=0)
    past = np.roll(past, 1, axis=0)
    past[0] = context.position
    context.memory["readings"] = past
    read = (past[0] - past[samples, np.arange(len(samples))]) / (samples * context.time_step_s)
    return context.values["gain"] * (context.speed - read)
