"""How records of a robot are run: started anew in windows, and also run through where controllers lead the robot."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import TypeVar

from ee_dist.robots.model import Robot

RESTART_S = 0.5
"""Length of windows that start anew from the measured state,"""
LATE, LAGS = 0.5, 4.0
"""but of so many lags where a joint was seen to come later than by so much of it: by the end of such a window it has hardly come
to what it was told, and any soft controller does as well."""

SECOND = 0.55
"""Share of the shortest trial that a window may be: the second may end a little before it does."""
TELLS = 1.25
"""Times as far above what starts may do that longer windows must bring the described robot, to be taken."""

Windows = TypeVar("Windows")
"""Whatever goes by windows of one length."""


def window_s(robot: Robot) -> float:
    """How long windows of a robot are, by what was seen of it."""
    lag = max((robot.joint(d.joint).lag_s for d in robot.drives), default=0.0)
    return RESTART_S if lag <= LATE * RESTART_S else round(LAGS * lag, 1)


def longer(first_s: float, shortest_s: float) -> Iterator[float]:
    """Windows (s) twice as long, four times, and so on, two of which a trial of ``shortest_s`` has, or next to that."""
    while (first_s := 2.0 * first_s) <= SECOND * shortest_s:
        yield first_s


def most_telling(first: Windows, others: Iterable[Windows], above: Callable[[Windows], float]) -> Windows:
    """The windows by which the described robot is farthest ``above`` what starts may do (a ratio of energies), if that is much
    farther than by the ``first``. What a start is off by dies out in a robot that controllers hold, and grows in one that falls;
    what is wrong with a model stays."""
    best, found = TELLS * above(first), first
    for windows in others:
        if (now := above(windows)) > best:
            best, found = now, windows
    return found


def led(robot: Robot) -> bool:
    """Whether controllers hold the joints to what is commanded."""
    return any(d.command in ("position", "speed") for d in robot.drives)
