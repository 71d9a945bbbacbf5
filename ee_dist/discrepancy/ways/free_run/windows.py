"""How records of a robot are run: started anew in windows, and also run through where controllers lead the robot."""

from __future__ import annotations

from ee_dist.robots.model import Robot

RESTART_S = 0.5
"""Length of windows that start anew from the measured state,"""
LATE, LAGS = 0.5, 4.0
"""but of so many lags where a joint was seen to come later than by so much of it: by the end of such a window it has hardly come
to what it was told, and any soft controller does as well."""


def window_s(robot: Robot) -> float:
    """How long windows of a robot are, by what was seen of it."""
    lag = max((robot.joint(d.joint).lag_s for d in robot.drives), default=0.0)
    return RESTART_S if lag <= LATE * RESTART_S else round(LAGS * lag, 1)


def led(robot: Robot) -> bool:
    """Whether controllers hold the joints to what is commanded."""
    return any(d.command in ("position", "speed") for d in robot.drives)
