"""Which share of what the motion needs measured torques are, joint by joint: a wrong scale shows in it, and a wrong mass."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from ee_dist.measurements.proposal.blocks import Block
from ee_dist.measurements.proposal.model import FIT
from ee_dist.measurements.proposal.view import View
from ee_dist.measurements.proposal.words import POSITION, SPEED
from ee_dist.robots.instruments import MOTOR_TORQUE

FAR = (0.3, 3.0)
"""Times what the motion needs that torques in N.m (N) are, be the model's masses wrong as they may."""
NEAR = (0.7, 1.4)
"""Times what it needs beyond which a joint is remarked."""
CERTAIN = 0.9
"""Correlation from which such a remark is made."""


@dataclass(frozen=True)
class Share:
    """Times what the motion needs that torques are, with their sign, and how well they go with it (correlation, 0 to 1)."""

    ratio: float
    fit: float


def led(v: View) -> bool:
    """Whether drives obey positions or speeds, and such were asked for: this robot is compared without torques."""
    kinds = {d.command for d in v.robot.drives if d.command != "none"}
    asked = {b.reading.kind for b in v.blocks if b.reading.command and v.moves(b)} | ({POSITION} if v.plans else set())
    return bool(kinds) and kinds <= asked & {POSITION, SPEED}


def tell_shares(v: View, block: Block, shares: Mapping[int, Share], gained: bool) -> None:
    """Says which joints' torques are not what the motion needs: a question where that is so of most and their unit is nothing but
    the usual one; ``gained``: a person said their gains. ``shares`` are of joints that go well with the need."""
    far = [k for k, s in shares.items() if not FAR[0] < s.ratio < FAR[1]]
    if 2 * len(far) > len(shares):
        text = (
            f"{block.name} are {_each(v, shares)} times what the motion needs by the model, in "
            f"{'N.m (N) by your gains' if gained else 'N.m (N)'}"
        )
        if gained or any(block.units):
            v.out.notes.append(f"torques: {text}: gains, signs or the model are wrong")
            return
        text += (
            f": if they are currents, or torques before the gears, say task.gains=[N.m for each of their units, one for each "
            f"joint], or task.gains={FIT}"
        )
        needless = led(v) and not any(v.sensor_names("torque")) and not any(v.sensor_names(MOTOR_TORQUE))
        if needless:
            v.out.notes.append(f"torques: {text}")
        else:
            v.out.ask(f"torques: {text}; if the model is that far off, take the mapping as it is")
        return
    odd = {k: s for k, s in shares.items() if s.fit > CERTAIN and not NEAR[0] < s.ratio < NEAR[1]}
    if odd:
        rest = {k: s for k, s in shares.items() if k not in odd}
        beside = f", those of others {_each(v, rest)}" if rest else ""
        v.out.notes.append(
            f"torques: {block.name} are {_each(v, odd)} times what the motion needs by the model, with which they go well"
            f"{beside}: a wrong scale of these torques, or wrong masses"
        )


def _each(v: View, shares: Mapping[int, Share]) -> str:
    return ", ".join(f"{s.ratio:.2g} ({v.joints[k].name})" for k, s in shares.items())
