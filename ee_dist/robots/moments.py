"""Moments of inertia that no rigid body has, as files have them: rounded, exported by hand, or of frames that need none.

Of a solid each principal moment is positive, and none exceeds the sum of the other two (the triangle inequality). Published
robots miss it by some percent, which hardly moves anything; what is further off is no rounding.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ee_dist.basics.names import listed
from ee_dist.basics.quoted import quoted
from ee_dist.robots.model import Joint, Part

EXACT = 0.001
"""Share of the largest moment by which the others may miss it and still be what the file says, in its digits."""
LITTLE = 0.1
"""Share up to which the smaller ones are raised: beyond it the file says something else than it means."""
FAR_OFF = 10.0
"""Times its robot's length, and m, from which on the mass of a part cannot be spread so far."""
RIGHT = (
    "moments are positive, and none is above the sum of the other two; take them from CAD, or from a box of the link's size "
    "(mass/12 x the sum of its other two sides squared)"
)


@dataclass
class Moments:
    """What was found of the links of one file: ``raised`` a little, ``unfit``, and unfit but ``idle``, as they are fixed to the
    root, which only a robot whose base moves cannot do with."""

    raised: list[str] = field(default_factory=list)
    unfit: list[str] = field(default_factory=list)
    idle: list[str] = field(default_factory=list)

    def usable(self, name: str, own: NDArray[np.float64], fixed_to_root: bool) -> NDArray[np.float64]:
        """The (3, 3) inertia of a link (kg.m^2, about its centre of mass) with which it can be simulated; what is done to it, or
        that it cannot be, is kept."""
        moments, axes = np.linalg.eigh(own)
        a, b, c = (float(m) for m in moments)
        missing = 1 - (a + b) / c if c > 0 else 1.0
        if a > 0 and missing <= EXACT:
            return own
        if a > 0 and missing <= LITTLE:
            self.raised.append(f"{quoted(name)} ({100 * missing:.2g} %)")
            return np.asarray(
                axes @ np.diag([a + a / (a + b) * (c - a - b), b + b / (a + b) * (c - a - b), c]) @ axes.T
            )
        found = self.idle if fixed_to_root else self.unfit
        found.append(f"{quoted(name)} ({', '.join(f'{m:.3g}' for m in (a, b, c))})")
        # What never moves only needs some inertia that engines accept.
        return np.eye(3) * max(c, 1e-6)

    def assumed(self) -> list[str]:
        """What was assumed, as notes."""
        notes = []
        if self.raised:
            notes.append(
                f"the largest moment of inertia is above the sum of the other two, as of no rigid body, at "
                f"{listed(self.raised)}: the other two are raised until it is not"
            )
        if self.idle:
            notes.append(
                f"no rigid body has the inertia of {listed(self.idle)}: fixed to the base, which is bolted down, they need none"
            )
        return notes


def spread_too_far(parts: Sequence[Part], joints: Sequence[Joint]) -> list[str]:
    """Parts but the root, as texts, whose moments would have their mass many times farther from its centre than the robot is
    long (their radius of gyration): of another unit, or a typing error."""
    above = {j.child: j for j in joints}

    def away(part: Part) -> float:
        far, joint = math.hypot(*part.com_m), above.get(part.name)
        while joint is not None:
            far, joint = far + math.hypot(*joint.position_m), above.get(joint.parent)
        return far

    long_m = max((away(p) for p in parts), default=0.0)
    found = []
    for p in parts[1:]:
        spread = sum(p.inertia_kg_m2[:3]) / 2
        spread_m = math.sqrt(spread / p.mass_kg) if p.mass_kg > 0 else 0.0
        if spread_m > FAR_OFF * max(long_m, 1.0):
            stated = f"{max(p.inertia_kg_m2[:3]):.3g} kg.m^2 for {p.mass_kg:.3g} kg"
            found.append(f"{quoted(p.name)} ({stated}, as if that were {spread_m:.3g} m away from its centre)")
    return found


def refused() -> str:
    """Why links whose principal moments are named are refused, and what would be right."""
    return f"no rigid body has this inertia (principal moments in kg.m^2); {RIGHT}"
