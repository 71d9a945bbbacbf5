"""What torques are in: N.m, or amperes times a gain; how large they are beside what the motion needs, and with which sign."""

from __future__ import annotations

from typing import Any

import numpy as np

from ee_dist.measurements import signals
from ee_dist.measurements.need import beside_need, torques_needed
from ee_dist.measurements.proposal.blocks import Block
from ee_dist.measurements.proposal.model import FIT, LIKELY, SURE, UNKNOWN
from ee_dist.measurements.proposal.torque_shares import FAR, Share, tell_shares
from ee_dist.measurements.proposal.units import UnitChoice
from ee_dist.measurements.proposal.view import View
from ee_dist.measurements.proposal.words import CURRENT, TORQUE
from ee_dist.measurements.suspicious import fit_nowhere
from ee_dist.measurements.units import UNITS
from ee_dist.trials.log import Array

LEAST_SEEN = 0.5
"""Correlation with what the motion needs from which a gain can be estimated."""
FAR_OFF = 300.0
"""Times what the motion needs at a joint that friction does not explain: a unit of its own does."""


def need_of(v: View, places: list[int] | None = None) -> tuple[Array, Array] | None:
    """What the motion needs; ``places``: the column that each joint has instead of its own."""
    if not v.units.entries:
        return None
    q = v.metric()
    return torques_needed(v.robot, q if places is None else q[:, places], v.step(v.position.block))


def beside_need_of(v: View, block: Block, places: list[int] | None = None) -> list[signals.Relation] | None:
    """How a block goes with what the motion needs, joint by joint, friction left aside; None where that is not known."""
    needed = v.needed if places is None else need_of(v, places)
    values = v.on(v.position.block, block)
    if needed is None or values is None:
        return None
    return beside_need(values if places is None else values[:, places], needed, v.step(v.position.block))


def _gains(v: View, relations: list[signals.Relation] | None) -> list[float]:
    """N.m (N) of each ampere, joint by joint: as said, or the least gains with which the currents are what the motion needs.
    None, and a question asked, where they cannot be estimated."""
    if v.hints.gains != FIT:
        return v.gains()
    weak = [j.name for j, r in zip(v.joints, relations or (), strict=False) if abs(r.correlation) < LEAST_SEEN]
    if not relations or weak:
        seen = [j.name in weak for j in v.joints]
        others = [
            f"{1 / abs(r.slope):.4g} at {j.name}"
            for j, r, no in zip(v.joints, relations or (), seen, strict=False)
            if not no
        ]
        v.out.ask(
            f"torques: the gains of {', '.join(weak) or 'the motors'} cannot be estimated: their currents do not go with what "
            "the motion needs by the model; say task.gains=[N.m per A, one for each joint]"
            + (f"; estimated of the others: {', '.join(others)}" if others else "")
        )
        return []
    # Noise in a current flattens none of this: the need is regressed on nothing that was measured but the motion.
    found = [float(f"{1 / abs(r.slope):.4g}") for r in relations]
    fits = ",".join(f"current_gain@{m}" for m in v.robot.motor_names)
    v.out.notes.append(
        f"gains estimated with the model's masses: {', '.join(f'{g:g}' for g in found)} N.m (N) for each ampere; how sure "
        f"they are tells task=improve 'effect=[{fits}]'"
    )
    return found


def _in_thousandths(relations: list[signals.Relation] | None, telling: list[int], block: Block) -> bool:
    """Whether columns of one family, whose unit nothing says, are mN.m (mN): at most joints hundreds of times the need."""
    sizes = [abs(relations[k].slope) for k in telling if abs(relations[k].correlation) > 0.7] if relations else []
    return bool(sizes) and not any(block.units) and float(np.median(sizes)) > 200


def _takes_gains(v: View, block: Block) -> bool:
    """Whether gains that were said are those of numbers that nobody calls currents: no name states a unit of theirs, and no
    others are called currents."""
    if v.hints.gains is None or block.reading.command or any(block.units):
        return False
    others = [b for b in v.blocks if b.reading.kind == CURRENT and not b.reading.command and not b.reading.weak]
    return block.reading.kind is None or not any(v.moves(b) for b in others)


def torque_units(v: View, block: Block) -> UnitChoice:
    """N.m or N; a current through the gain that was said. A sign turned against the motion's need is turned back."""
    kinds = ["N.m" if j.kind == "hinge" else "N" for j in v.joints]
    current = block.reading.kind == CURRENT or _takes_gains(v, block)
    if current and v.hints.gains is None:
        v.out.ask(
            f"torques: {block.name} are motor currents; say task.gains=[N.m per A, one for each joint], or task.gains={FIT} to "
            "estimate them from the model's masses"
        )
        return UnitChoice((), UNKNOWN, "a current, whose gain no file can say")
    relations = beside_need_of(v, block) if not block.reading.command else None
    gains = _gains(v, relations) if current else []
    if current and not gains:
        return UnitChoice((), UNKNOWN, "a current whose gain cannot be estimated")
    if current:
        v.gained.append(block.name)
    entries, checked = [], 0
    own: dict[int, str] = {}
    shares: dict[int, Share] = {}
    # What a joint that hardly moves is given is friction alone.
    telling = signals.lively(v.position.block.values)
    thousandth = not current and _in_thousandths(relations, telling, block)
    for k, unit in enumerate(kinds):
        stated = block.units[k] if block.units else None
        entry: dict[str, Any] = {"unit": stated if stated in ("N.m", "mN.m", "N", "mN") else unit}
        if current:
            # Estimated gains are of the numbers as they stand, whatever their unit.
            size = 1e-3 if stated == "mA" and v.hints.gains != FIT else 1.0
            entry = {"unit": unit, "scale": gains[k] * size}
        elif thousandth and stated is None:
            entry["unit"] = f"m{unit}"
        factor = UNITS[entry["unit"]][1] * float(entry.get("scale", 1.0))
        seen = None if relations is None or k not in telling else relations[k]
        fit, size = (0.0, 0.0) if seen is None else (seen.correlation * np.sign(factor), abs(seen.slope * factor))
        if not (current and v.hints.gains == FIT) and abs(fit) > 0.7:
            shares[k] = Share(float(np.sign(fit) * size), abs(fit))
            checked += FAR[0] < size < FAR[1]
        if fit < -0.4:
            # Turned only where the size, too, is what the motion needs: a model far off can run against any torque.
            if fit < -0.9 and 0.5 < size < 2:
                entry["sign"] = -1
                own[k] = "sign turned: it was against what the motion needs"
                shares = {i: Share(size, s.fit) if i == k else s for i, s in shares.items()}
            elif fit < -0.7 and 0.5 < size < 2:
                v.out.ask(
                    f"torques: {block.columns[k]} seems to run against what the motion of {v.joints[k].name} needs "
                    f"(correlation {fit:.2f}); if it does, add 'sign: -1' to it in the mapping"
                )
            else:
                own[k] = (
                    "sign not clear, kept as it is: the model needs the other, but not this much (or the joint turns the other "
                    "way than described, which explain asks for)"
                )
        entries.append(entry)
    tell_shares(v, block, shares, current)
    # A unit is that of all joints: at one alone friction may be many times what a slow motion needs.
    sizes = {} if current else {k: abs(s.ratio) for k, s in shares.items()}
    middle = float(np.median(list(sizes.values()))) if sizes else 1.0
    if not 0.05 < middle < 20:
        return UnitChoice((), UNKNOWN, f"{middle:.3g} times what the motion needs in {entries[0]['unit']}")
    for k, size in sizes.items():
        if not 1 / FAR_OFF < size < FAR_OFF:
            unit = entries[k]["unit"]
            return UnitChoice((), UNKNOWN, f"{size:.3g} times what the motion needs in {unit} at {v.joints[k].name}")
    what = "current" if block.reading.kind != TORQUE else "what is called a torque"
    said = (
        f"{what} times a gain estimated from what the motion needs"
        if v.hints.gains == FIT
        else f"{what} times the gain you said"
    )
    # That they fit nowhere is no check that was left out.
    unlike = relations is not None and fit_nowhere([relations[k] for k in telling])
    usual = ", the usual unit; " + ("they go with what the motion needs at no joint" if unlike else "not checked")
    why = said if current else entries[0]["unit"] + (", as large as the motion needs" if checked else usual)
    stated_all = all(u in ("N.m", "mN.m", "N", "mN") for u in block.units) if block.units else False
    stated_all = stated_all or (current and v.hints.gains != FIT)
    return UnitChoice(tuple(entries), SURE if stated_all and not own else LIKELY, why, own)
