"""What was asked for beside what was measured: a plan of positions, and the rates and accelerations that go with it.

Commands are chosen last, of what is left. But which speeds were measured, and which numbers without a name are torques, can be
told only where what was asked for is known to be that, whatever it is called.
"""

from __future__ import annotations

from ee_dist.measurements import signals
from ee_dist.measurements.proposal.blocks import Block
from ee_dist.measurements.proposal.view import View
from ee_dist.measurements.proposal.words import POSITION, quantity_of

FOLLOWED = 0.97
"""Correlation from which positions follow numbers that nobody called a command."""
AS_LARGE = (0.8, 1.25)
"""Times the positions that such numbers are: those of a plan, in the same unit."""
BETTER = 0.5
"""Share of what the measured positions leave unexplained of a rate that the plan leaves, if it is the plan's."""
ITS_RATE = 0.9
"""Correlation from which numbers are the change of others."""


def plans_of(v: View) -> list[Block]:
    """Blocks of positions that were asked for: called so, or followed by the measured ones, or without the noise of these."""
    own, found = v.position.block, []
    for b in v.blocks:
        r = b.reading
        if b is own or r.command is False or not (r.kind in (POSITION, None) or r.weak) or not v.moves(b):
            continue
        ahead = v.lead(b, own)
        follows = abs(ahead.correlation) > FOLLOWED and AS_LARGE[0] < abs(ahead.slope) < AS_LARGE[1]
        early = ahead.lead_s > 1.5 * v.step(own) or v.planned_beside(b, own)
        if r.command or (follows and early and abs(v.derivative(own, b).correlation) < ITS_RATE):
            found.append(b)
    return found


def called_like_a_plan(v: View, b: Block) -> bool:
    """Whether a name shares with that of a plan what sets the plan apart from the measured positions."""
    return any(_besides(b) == _besides(plan) != _besides(v.position.block) for plan in v.plans)


def was_asked_for(v: View, b: Block) -> bool:
    """Whether numbers are a plan's, or its rate's rather than that of the measured positions: by what their names share with
    its name (VelocityCmptd with PositionCmptd), or by which of the two changes they are."""
    if b.reading.command is not None or b.reading.second:
        return bool(b.reading.command)
    if any(b is plan for plan in v.plans) or called_like_a_plan(v, b):
        return True
    measured = _besides(v.position.block)
    if _besides(b) == measured and any(_besides(plan) != measured for plan in v.plans):
        return False
    own = abs(v.derivative(v.position.block, b).correlation)
    rates = [abs(v.derivative(plan, b).correlation) for plan in v.plans]
    return any(rate > ITS_RATE and 1 - rate < BETTER * (1 - own) for rate in rates)


def goes_with_a_plan(v: View, b: Block) -> bool:
    """Whether numbers without a name are a motion's rate or acceleration, asked for or measured, and so no torques."""
    if was_asked_for(v, b) or abs(v.derivative(v.position.block, b).correlation) > ITS_RATE:
        return True
    step = v.step(v.position.block)
    values = v.on(v.position.block, b)
    planned = [p for p in (v.on(v.position.block, p) for p in v.plans) if p is not None]
    return values is not None and any(
        abs(signals.derivative(signals.change(p, step), values, step).correlation) > ITS_RATE for p in planned
    )


def _besides(b: Block) -> tuple[str, ...]:
    """The words of a name that say no quantity: what sets those that were asked for apart from the others."""
    return tuple(w for w in b.reading.family.split() if quantity_of(w) is None and len(w) > 1)
