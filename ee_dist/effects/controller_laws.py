"""What controllers that come with the robots here know of their joints."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ee_dist.effects.laws import LawContext, speed_law
from ee_dist.robots.linear_stage import SPEED_LAW


@speed_law(SPEED_LAW)
def speed_from_readings(context: LawContext) -> NDArray[np.float64]:
    """A difference of position readings over ``samples`` steps."""
    samples = np.maximum(context.values["samples"], 1.0).astype(int)
    past = context.memory.get("readings")
    if past is None:
        past = np.repeat(context.position[None], int(samples.max()) + 1, axis=0)
    past = np.roll(past, 1, axis=0)
    past[0] = context.position
    context.memory["readings"] = past
    return np.asarray((past[0] - past[samples, np.arange(len(samples))]) / (samples * context.time_step_s))
