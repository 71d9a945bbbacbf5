"""In which order numbered columns go through the joints of a robot that branches: what the data rule out, and what is left.

A chain has one order. Where joints branch, makers count limb by limb, simulators often level by level (all hips, then all
thighs), and a file lists them as it likes: to take one of these for granted gives columns to the wrong joints.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from ee_dist.basics.names import listed
from ee_dist.measurements import signals
from ee_dist.measurements.need import beside_need, torques_needed
from ee_dist.measurements.proposal.blocks import Block
from ee_dist.measurements.proposal.limbs import Exchanged, exchanged
from ee_dist.measurements.proposal.model import LIKELY, SHARE, UNKNOWN, Hints, Told
from ee_dist.measurements.proposal.torques import CLEARLY, WELL
from ee_dist.measurements.proposal.units import ANGLES, LENGTHS
from ee_dist.measurements.proposal.view import View
from ee_dist.measurements.proposal.words import POSITION, SPEED, TORQUE
from ee_dist.measurements.standing import reach_of
from ee_dist.measurements.units import UNITS
from ee_dist.robots.model import Robot
from ee_dist.trials.log import Array

WITHIN, OUT = 0.1, 0.2
"""Shares of its range by which a joint may be seen beyond its stops (a zero that is a little off), and beyond which it is another
joint where some order keeps all joints within the first. Commands say nothing of it: soft drives are led far beyond stops."""
FITS, WORSE = 0.8, 0.1
"""Correlation with named positions from which numbered speeds or commands tell their order, and what is no longer as good."""


@dataclass(frozen=True)
class Order:
    """The joints in the order of the columns, and what that order is called."""

    names: tuple[str, ...]
    called: str


@dataclass(frozen=True)
class _Way:
    """An order, how far beyond its stops it leads a joint (share of the range) in the unit that fits best, and what that is."""

    order: Order
    beyond: float = 0.0
    why: str = ""


def plausible(robot: Robot, written: Sequence[tuple[str, Sequence[str]]] = ()) -> list[Order]:
    """The orders that columns of a robot are likely to be in, that of its drives first; ``written``: what files call theirs, with
    all joints that they list. One alone where joints do not branch so that it matters."""
    own = robot.motor_names
    below: dict[str, list[tuple[str, str]]] = {}
    for j in robot.joints:
        below.setdefault(j.parent, []).append((j.name, j.child))

    def limbs(part: str) -> Iterator[str]:
        for name, child in below.get(part, ()):
            yield name
            yield from limbs(child)

    row, levels = [robot.root.name], []
    for part in row:
        for name, child in below.get(part, ()):
            levels.append(name)
            row.append(child)
    found = {own: "in the robot's own order"}
    deep, wide = (tuple(n for n in names if n in own) for names in (limbs(robot.root.name), levels))
    if deep == wide or set(deep) != set(own):
        return [Order(own, found[own])]
    called = {deep: "limb by limb", wide: "level by level"}
    found = {own: called.get(own, found[own])} | {n: c for n, c in called.items() if n != own}
    for what, names in written:
        kept = tuple(dict.fromkeys(n for n in names if n in own))
        if set(kept) == set(own):
            found.setdefault(kept, what)
    return [Order(names, what) for names, what in found.items()]


def told_by_data(v: View) -> Hints | None:
    """The hints with the order that the data leave, and why; or with a question, where they leave several. None where columns are
    named, someone said their order, or there is but one."""
    orders = plausible(v.robot, v.hints.written)
    block = v.position.block
    if v.hints.joints is not None or len(orders) < 2:
        return None
    if block.numbered:
        ways = _within_limits(v, orders)
        left = [w.order for w in ways if w.beyond <= OUT] or orders
    else:
        followers = [b for b in v.blocks if b.numbered and (b.reading.kind == SPEED or b.reading.command)]
        if not followers:
            return None
        block, ways = followers[0], []
        left = _with_positions(v, followers, orders)
        if not left:  # something else that is numbered
            return None
    # Limits are told apart at a glance; torques take the model's masses, and come second.
    held = _by_need(v, left) if len(left) > 1 else left
    if len(held) > 1:
        ways_out = " or ".join(f"'task.joints=[{','.join(o.names)}]' ({o.called})" for o in held)
        question = (
            f"joints: {block.name} are only numbered, and {v.robot.name} branches, so that they may go in several orders; "
            f"say {ways_out}, or another"
        )
        return replace(v.hints, joints=held[0].names, told=Told(UNKNOWN, "in an order that is open", question))
    if (wrong := _against_weight(v, held[0])) is not None:
        question = (
            f"joints: {block.name} are only numbered. Taken {held[0].called} ({listed(held[0].names)}), what controllers hold "
            f"would not go with the weight (cosine {wrong.went:.2f}); with limbs that are alike exchanged it does "
            f"({wrong.goes:.2f}): say 'task.joints=[{','.join(wrong.names)}]', or task.joints=[...] in the order that is right"
        )
        return replace(v.hints, joints=wrong.names, told=Told(UNKNOWN, "by the weight that is held", question))
    others = [o for o in orders if o is not held[0]]
    named = " and ".join(o.called for o in others)
    far = max((w for w in ways if w.order not in left), key=lambda w: w.beyond, default=None)
    if far is not None and len(left) == 1:
        why = f"{held[0].called}: {named} would leave the joints' limits"
        note = f"; {far.order.called} {far.why}"
    else:
        what = "the measured torques" if len(left) > 1 else "the positions"
        why, note = f"{held[0].called}: {named} would not go with {what}", ""
    return replace(
        v.hints,
        joints=held[0].names,
        told=Told(
            LIKELY, why,
            note=f"numbered columns are taken for the joints {held[0].called} ({listed(held[0].names)}){note}; which of limbs "
            "that are alike comes first is not seen: say task.joints=[...] if it is another",
        ),
    )  # fmt: skip


def _places(v: View, order: Order) -> list[int]:
    """The column that each joint has, of those in the robot's order."""
    return [order.names.index(m) for m in v.robot.motor_names]


def _placed(v: View, block: Block, order: Order) -> Block:
    """A block as it would be in an order; what is named stays."""
    if not block.numbered:
        return block
    places = _places(v, order)
    return replace(
        block, columns=tuple(block.columns[p] for p in places), values=block.values[:, places],
        units=tuple(block.units[p] for p in places) if block.units else (),
    )  # fmt: skip


def _within_limits(v: View, orders: Sequence[Order]) -> list[_Way]:
    """How far each order leads joints beyond their stops, in the first unit in which one of them keeps all within; all alike
    where none does. Where stops tell nothing, for encoders count the other way round, how far joints get from zero does."""
    if v.hints.unit == SHARE or v.position.block.table.header.get("format") == "lerobot":
        return [_Way(o) for o in orders]
    for mirrored in (False, True):
        for angle, length in product(ANGLES, LENGTHS):
            found = [_beyond(v, o, {"hinge": angle, "slide": length}, mirrored) for o in orders]
            if min(w.beyond for w in found) <= WITHIN:
                return found
    return [_Way(o) for o in orders]


def _beyond(v: View, order: Order, units: dict[str, str], mirrored: bool) -> _Way:
    block = _placed(v, v.position.block, order)
    worst = _Way(order)
    for k, joint in enumerate(v.joints):
        kind = UNITS[units[joint.kind]][0]
        said = v.hints.unit if v.hints.unit and UNITS[v.hints.unit][0] == kind else units[joint.kind]
        unit = (block.units[k] if block.units else None) or said
        own, size = UNITS.get(unit, ("", 1.0))
        if own != kind:
            return _Way(order, np.inf, f"{block.columns[k]} in {unit} would be {joint.name}")
        low, high = (-reach_of(joint), reach_of(joint)) if mirrored else joint.ends
        seen = block.values[:, k] * size
        for at, stop, by in ((seen.min(), low, low - seen.min()), (seen.max(), high, seen.max() - high)):
            share = float(by / (high - low)) if np.isfinite(high - low) and high > low else 0.0
            if share > worst.beyond:
                base = "rad" if joint.kind == "hinge" else "m"
                reach = f"{block.columns[k]} would be {joint.name} and reach {at:.3g} {base}, which ends at {stop:.3g}"
                worst = _Way(order, share, reach)
    return worst


def _with_positions(v: View, followers: Sequence[Block], orders: Sequence[Order]) -> list[Order]:
    """The orders in which numbered speeds and commands go with positions that have names; none where they do in no order."""
    fits = []
    for order in orders:
        own = []
        for b in followers:
            placed = _placed(v, b, order)
            if b.reading.kind == SPEED and not b.reading.command:
                own.append(abs(v.derivative(v.position.block, placed).correlation))
            elif b.reading.kind in (POSITION, None):
                own.append(abs(v.lead(placed, v.position.block).correlation))
        fits.append(float(np.mean(own)) if own else 0.0)
    best = max(fits)
    return [o for o, fit in zip(orders, fits, strict=True) if best >= FITS and fit > best - WORSE]


def _by_need(v: View, orders: list[Order]) -> list[Order]:
    """The one order in which measured torques are what the motion needs by the model, if there is one; else all."""
    torques = [
        b for b in v.blocks if b.numbered and b.reading.kind == TORQUE and not b.reading.command and not b.reading.weak
    ]  # fmt: skip
    if len(torques) != 1 or not any(signals.moves(c) for c in torques[0].values.T):
        return orders
    left, step = [], v.step(v.position.block)
    for order in orders:
        given = v.on(v.position.block, _placed(v, torques[0], order))
        needed = torques_needed(v.robot, _metric(v, order), step)
        if given is None or needed is None:
            return orders
        left.append(float(np.mean([1 - r.correlation**2 for r in beside_need(given, needed, step)])))
    best, second = np.sort(left)[:2]
    return [orders[int(np.argmin(left))]] if best < min(CLEARLY * second, WELL) else orders


def _against_weight(v: View, order: Order) -> Exchanged | None:
    """Whether position controllers hold the weight with limbs in another order."""
    commands = [b for b in v.blocks if b.numbered and b.reading.command and b.reading.kind in (POSITION, None)]
    if len(commands) != 1 or not v.position.block.numbered or any(d.command != "position" for d in v.robot.drives):
        return None
    places = [v.robot.motor_names.index(n) for n in order.names]
    asked = v.on(v.position.block, commands[0])
    if asked is None:
        return None
    position = _metric(v, order)[:, places]
    with np.errstate(divide="ignore", invalid="ignore"):
        size = np.nanmedian(position / v.position.block.values, axis=0)
    return exchanged(v.robot, order.names, position, asked * np.where(np.isfinite(size), size, 1.0))


def _metric(v: View, order: Order) -> Array:
    """Positions (T, J) in rad or m, in the unit that is stated or usual: a correlation does not ask for the size."""
    block = _placed(v, v.position.block, order)
    stated = block.units or (None,) * len(v.joints)
    return block.values * np.array([UNITS.get(u or v.hints.unit or "", ("", 1.0))[1] for u in stated])
