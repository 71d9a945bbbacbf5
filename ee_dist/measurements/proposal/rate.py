"""How many rows a second there are where no column holds the time: a speed is the change of its position."""

from __future__ import annotations

from dataclasses import replace

from ee_dist.measurements.proposal.model import Hints
from ee_dist.measurements.proposal.time import time_of
from ee_dist.measurements.proposal.view import View
from ee_dist.measurements.proposal.words import POSITION, SPEED
from ee_dist.measurements.table import Recorded
from ee_dist.measurements.units import UNITS
from ee_dist.robots.model import Robot

TRIED_HZ = 100.0
USUAL = tuple(n * 10.0**k for k in range(4) for n in (1, 1.2, 1.25, 1.5, 2, 2.4, 2.5, 3, 4, 5, 6, 7.5, 8))
CLOSE = 0.03
"""Share within which a rate is a usual one."""
AGREES = 0.95


def rate_by_speeds(recorded: Recorded, robot: Robot, hints: Hints) -> tuple[float, str] | None:
    """Rows a second at which columns called speeds are the change of columns called positions, and which they are."""
    v = View(recorded, robot, replace(hints, rate_hz=TRIED_HZ))
    for table in recorded.tables:
        if (time := time_of(table, v.hints)) is not None:
            v.times[table.name] = time
    v.blocks = v.gathered()
    found: tuple[float, str] | None = None
    best = AGREES
    for p in v.blocks:
        for s in v.blocks:
            if p.reading.kind != POSITION or s.reading.kind != SPEED or p.table.name != s.table.name:
                continue
            r = v.derivative(p, s)
            ratio = r.slope * _size(s.unit, "rad/s") / _size(p.unit, "rad")
            if r.correlation > best and ratio > 0:
                best = r.correlation
                found = (
                    _usual(TRIED_HZ * ratio),
                    f"{s.name} are the change of {p.name} (correlation {r.correlation:.3f})",
                )
    return found


def _size(unit: str | None, base: str) -> float:
    return UNITS[unit or base][1]


def _usual(rate: float) -> float:
    near = min(USUAL, key=lambda u: abs(u / rate - 1))
    return near if abs(near / rate - 1) < CLOSE else float(f"{rate:.3g}")
