"""Joints whose commands show no unit: told one place all the time, or going nowhere although they are told to."""

from __future__ import annotations

import numpy as np

from ee_dist.measurements import signals
from ee_dist.measurements.proposal.blocks import Block
from ee_dist.measurements.proposal.view import View
from ee_dist.measurements.standing import reach_of, stands_still, step_of
from ee_dist.measurements.units import UNITS
from ee_dist.trials.log import Array


def stated_unit(b: Block, k: int) -> str | None:
    """The unit of an angle or a length in the name of a column."""
    return b.units[k] if b.units and b.units[k] in ("rad", "deg", "mrad", "turn", "m", "mm", "cm") else None


def allowed_units(v: View, k: int) -> tuple[str, str, str]:
    """The units that commands of a joint may be in by their ratio to its positions."""
    return ("rad", "deg", "turn") if v.joints[k].kind == "hinge" else ("m", "mm", "cm")


def held(v: View, b: Block) -> list[int]:
    """Joints that are told one place all the time but for what rounding left, in whatever unit: what varies by less than the step
    in which positions are read makes none of them move. Together with a motion of which a joint only sways it would have any
    slope, and any sign."""
    found = []
    for k, e in enumerate(v.units.entries):
        size = UNITS[str(e["unit"])][1]
        asked, read = (o.table.numbers(o.columns[k], gaps=True) for o in (b, v.position.block))
        stated = stated_unit(b, k)
        units = (stated,) if stated else allowed_units(v, k)
        largest = size * abs(e["scale"]) if "scale" in e else max(UNITS[u][1] for u in units)
        step = step_of(read) * size * abs(e.get("scale", 1.0))
        if largest * (np.nanmax(asked, initial=-np.inf) - np.nanmin(asked, initial=np.inf)) < step:
            found.append(k)
    return found


def standing_still(v: View, values: Array) -> list[int]:
    """Joints that do next to nothing of what they are asked for, in the unit of the positions or in that of the others."""
    seen, found = v.metric(), []
    relations = signals.each(values, v.position.block.values)
    followed = signals.lively(values, v.position.block.values)
    for k, e in enumerate(v.units.entries):
        like = [abs(relations[i].slope) for i in followed if i != k and v.joints[i].kind == v.joints[k].kind]
        asked = values[:, k] / (float(np.median(like)) if like and min(like) > 0 else 1.0)
        asked = (e.get("scale", 1.0) * asked + e.get("offset", 0.0)) * UNITS[str(e["unit"])][1]
        if stands_still(asked, seen[:, k], reach_of(v.joints[k])):
            found.append(k)
    return found
