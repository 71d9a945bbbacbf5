"""What the loop works on: a robot, or any other coupled system of which there is a model.

The search for faults and for controllers asks for no more than this. What a system is made of, only its engine, its effects
and its pictures know.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

from ee_dist.robots.model import Sensor, Wiring


class System(Protocol):
    """Immutable data. An effect makes another one of it; an engine turns it and a controller into a log."""

    @property
    def name(self) -> str: ...

    @property
    def sensors(self) -> tuple[Sensor, ...]:
        """Its channels, and what may be wrong with them."""
        ...

    @property
    def drives(self) -> Sequence[Any]:
        """What a controller commands: motors, stimuli."""
        ...

    @property
    def wiring(self) -> Wiring: ...

    @property
    def time_step_s(self) -> float: ...

    @property
    def sensor_names(self) -> tuple[str, ...]: ...

    @property
    def motor_names(self) -> tuple[str, ...]:
        """Of the drives, in their order."""
        ...

    @property
    def digest(self) -> str:
        """Content address: equal systems, and only they, have equal digests."""
        ...

    @property
    def noisy(self) -> bool:
        """Whether a sensor draws random numbers."""
        ...
