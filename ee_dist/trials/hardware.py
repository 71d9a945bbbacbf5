"""Hardware as a protocol: it takes a driver, gives back a sensor log, and never tells what is wrong with it."""

from __future__ import annotations

from typing import Any, Protocol

from ee_dist.trials.log import SensorLog


class Hardware(Protocol):
    """A robot to be tried: a simulated physical robot, or a user's own class around a real one."""

    def trial(self, driver: Any, steps: int) -> SensorLog:
        """Run once, from rest at the start pose, and return what was measured."""
        ...
