"""Moments of inertia that no rigid body has, as files have them: rounded, exported by hand, or of frames that need none.

Of a solid each principal moment is positive, and none exceeds the sum of the other two (the triangle inequality). Published
robots miss it by some percent, which hardly moves anything; what is further off is no rounding.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ee_dist.basics.names import listed
from ee_dist.basics.quoted import quoted
from ee_dist.robots.mass_matrix import rotation_matrix
from ee_dist.robots.model import Joint, Part

EXACT = 0.001
"""Share of the largest moment by which the others may miss it and still be what the file says, in its digits."""
LITTLE = 0.1
"""Share up to which the smaller ones are raised: beyond it the file says something else than it means."""
FAR_OFF = 10.0
"""Times its robot's length, and m, from which on the mass of a part cannot be spread so far."""
LEFT_OUT, ALONG = 0.01, 0.999
"""Share of the given moment up to which two others of one size, none or a power of ten, were left out by who knew that a planar
robot turns about one direction; cosine from which that is the given moment's axis."""
RIGHT = (
    "moments are positive, and none is above the sum of the other two; take them from CAD, or from a box of the link's size "
    "(mass/12 x the sum of its other two sides squared)"
)


@dataclass
class Moments:
    """What was found of the links of one file: ``raised`` a little, ``unfit``, and unfit but ``idle``, as they are fixed to the
    root, or ``planar``, as they turn about one direction alone, whose moment is given: these only a robot whose base moves cannot
    do with."""

    raised: list[str] = field(default_factory=list)
    unfit: list[str] = field(default_factory=list)
    idle: list[str] = field(default_factory=list)
    planar: list[str] = field(default_factory=list)

    def usable(
        self, name: str, own: NDArray[np.float64], fixed_to_root: bool, axis: NDArray[np.float64] | None = None
    ) -> NDArray[np.float64]:
        """The (3, 3) inertia of a link (kg.m^2, about its centre of mass) with which it can be simulated; what is done to it, or
        that it cannot be, is kept. ``axis`` (3,): the one direction about which it turns, whatever moves."""
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
        along = axis is not None and abs(float(axes[:, 2] @ axis)) > ALONG
        planar = along and c > 0 and a == b <= LEFT_OUT * c and (a == 0 or a == float(f"1e{round(math.log10(a))}"))
        found = self.idle if fixed_to_root else self.planar if planar else self.unfit
        found.append(f"{quoted(name)} ({', '.join(f'{m:.3g}' for m in (a, b, c))})")
        # What never moves, or turns about one axis, only needs some other inertia that engines accept.
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
        if self.planar:
            notes.append(
                f"two moments of inertia are left out at {listed(self.planar)}: all joints turn about one direction, "
                "whose moment is given, and the others count for nothing: taken to be as large"
            )
        return notes


def one_direction(order: Sequence[str], carried: Mapping[str, Joint]) -> dict[str, NDArray[np.float64]]:
    """The direction (3,) about which all hinges turn, in the frame of each link (``order``: behind what carries it); empty where
    they turn about several, or none."""
    turned = {order[0]: np.eye(3)}
    for name in order[1:]:
        turned[name] = turned[carried[name].parent] @ rotation_matrix(carried[name].rotation)
    axes = [turned[j.child] @ np.array(j.axis) for j in carried.values() if j.kind == "hinge" and j.child in turned]
    if not axes or any(abs(float(axes[0] @ axis)) < ALONG for axis in axes):
        return {}
    return {name: turn.T @ axes[0] for name, turn in turned.items()}


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
