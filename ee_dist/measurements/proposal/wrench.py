"""Forces and torques by axes, as a sensor between two parts reads them: they are no joint's, and nothing asked for them."""

from __future__ import annotations

import re
from collections.abc import Mapping

from ee_dist.measurements.proposal.words import TORQUE, Reading, quantity_of, tokens

FEWEST = 3
"""Columns of forces or torques along two axes or more that are such a sensor; those of a planar one are as many."""
CALLED = frozenset(["ft", "fts", "ftsensor", "wrench", "loadcell"])
"""What a table of nothing else is called."""
_AXIS, _SHORT = re.compile(r"[xyz]"), re.compile(r"[ftm]([xyz])")


def of_a_wrench(table: str, readings: Mapping[str, Reading]) -> frozenset[str]:
    """The columns of a table that are forces or torques along axes (``force_x``, ``Fx``, ``Tz_Nm``), where there are several, by
    what their names say that name no joint; all of these in a ``table`` that is called so."""
    if CALLED & {*tokens(table)}:
        return frozenset(readings)
    axes = {a: axis for a, r in readings.items() if r.command is not True and (axis := _axis(r.family.split()))}
    return frozenset(axes) if len(axes) >= FEWEST and len(set(axes.values())) > 1 else frozenset()


def _axis(words: list[str]) -> str:
    if not words:
        return ""
    if found := _SHORT.fullmatch(words[-1]):
        return found[1]
    return words[-1] if _AXIS.fullmatch(words[-1]) and any(quantity_of(w) == TORQUE for w in words) else ""
