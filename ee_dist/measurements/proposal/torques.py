"""Which block is the torques or motor currents, judged by what the motion needs."""

from __future__ import annotations

from itertools import permutations
from typing import Any

import numpy as np

from ee_dist.measurements import signals
from ee_dist.measurements.need import beside_need, torques_needed
from ee_dist.measurements.proposal.blocks import BY_PLACE, Block
from ee_dist.measurements.proposal.model import FIT, LIKELY, SURE, UNKNOWN, Choice
from ee_dist.measurements.proposal.units import UnitChoice
from ee_dist.measurements.proposal.view import Scored, View
from ee_dist.measurements.proposal.words import CURRENT, POSITION, SPEED, TORQUE
from ee_dist.measurements.units import UNITS
from ee_dist.robots.instruments import MOTOR_TORQUE
from ee_dist.trials.log import Array

ROUGHER = 1.15
"""What was measured is rougher than what was asked for, by this factor or more."""
LEAST_SEEN = 0.5
"""Correlation with what the motion needs from which a gain can be estimated."""
CLEARLY, WELL = 0.3, 0.3
"""Another order of the joints is asked for if it leaves less than this share of what the robot's leaves, and of all."""
BOTH_WAYS, OFTEN = 0.1, 0.05
"""A motion needs torques of both signs where this share of the largest is passed, either way, in this share of the time."""
FAR_OFF = 300.0
"""Times what the motion needs at a joint that friction does not explain: a unit of its own does."""


def _needed(v: View, places: list[int] | None = None) -> tuple[Array, Array] | None:
    """What the motion needs; ``places``: the column that each joint has instead of its own."""
    if not v.units.entries:
        return None
    q = v.metric()
    return torques_needed(v.robot, q if places is None else q[:, places], v.step(v.position.block))


def _beside_need(v: View, block: Block, places: list[int] | None = None) -> list[signals.Relation] | None:
    """How a block goes with what the motion needs, joint by joint, friction left aside; None where that is not known."""
    needed = v.needed if places is None else _needed(v, places)
    values = v.on(v.position.block, block)
    if needed is None or values is None:
        return None
    return beside_need(values if places is None else values[:, places], needed, v.step(v.position.block))


def _check_order(v: View, block: Block) -> None:
    """Asks for the order of the joints where torques go with the motion in another order than the robot's."""
    count = len(v.joints)
    if not block.numbered or v.hints.joints is not None or count < 2:
        return
    own = list(range(count))
    orders = [list(p) for p in permutations(own)] if count <= 3 else [own, own[::-1]]
    left = []
    for places in orders:
        relations = _beside_need(v, block, places)
        left.append(sum(1 - r.correlation**2 for r in relations) / count if relations else 1.0)
    best = int(np.argmin(left))
    if left[best] < min(CLEARLY * left[0], WELL):
        names = [v.joints[orders[best].index(k)].name for k in own]
        v.out.ask(
            f"joints: {block.name} leave {100 * left[best]:.0f} % of what the motion needs unexplained as those of "
            f"{', '.join(names)}, {100 * left[0]:.0f} % in the robot's order; say task.joints=[...] as the columns are"
        )


def add_torques(v: View) -> None:
    """The torque sensors and the torques of the drives, where a block is the one or the other."""
    sensed = [net or motor for net, motor in zip(v.sensor_names("torque"), v.sensor_names(MOTOR_TORQUE), strict=True)]
    found = []
    v.needed = _needed(v)
    for b in v.blocks:
        named = b.reading.kind in (TORQUE, CURRENT) and not b.reading.weak
        if named and not b.used and b.reading.command is not True and v.moves(b) and _unsigned(v, b):
            b.used = True
            v.out.notes.append(
                f"{b.name} never change sign, though the motion needs torques of both: they are sizes, as some servos report "
                "their currents, and are left out"
            )
        if b.used or b.reading.command or not v.moves(b) or not (named or (b.how == BY_PLACE and v.hints.gains)):
            continue
        score = (
            (3.0 if b.reading.kind == TORQUE else 2.0) + (1 if b.reading.command is False else 0) - 2 * b.reading.second
        )
        why = [f"called a {b.reading.kind}"] if named else []
        if not named:
            score, why = _as_current(v, b)
        found.append(Scored(b, score, why))
    chosen = v.pick(sorted(found, key=lambda s: -s.score))
    if chosen is None:
        if any(sensed):
            rivals = " or ".join(s.block.name for s in found[:3])
            v.out.ask(
                f"torques: {rivals or 'no columns'}{'?' if rivals else ' look like them'}; write them into the mapping"
            )
            for n in sensed:
                if n:
                    v.out.choices.append(Choice("sensors", n, {"column": "???"}, UNKNOWN, "not found"))
        return
    if chosen.block.reading.kind == CURRENT and v.hints.gains is None and not any(sensed) and _led(v):
        # A robot that is led by its commands is compared without torques.
        v.out.notes.append(
            f"motor currents ({chosen.block.name}) are left out; with task.gains=[N.m per A, one for each joint], or "
            f"task.gains={FIT}, they are the torques of a balance of forces"
        )
        return
    chosen.block.used = True
    units = torque_units(v, chosen.block)
    _check_order(v, chosen.block)
    level = LIKELY if chosen.block.how == BY_PLACE and chosen.block.reading.kind is None else SURE
    if any(sensed):
        v.add("sensors", sensed, chosen.block, units, chosen.why, level)
    v.add("torques", list(v.robot.motor_names), chosen.block, units, chosen.why, level)


def _unsigned(v: View, block: Block) -> bool:
    """Whether no column of a block ever changes its sign, while what the motion needs of some of these joints does."""
    values = v.on(v.position.block, block)
    if values is None or v.needed is None or ((values < 0).any() and (values > 0).any()):
        return False
    needed = v.needed[0]
    strong = np.abs(needed) > BOTH_WAYS * np.abs(needed).max(axis=0)
    moved = [k for k in range(len(v.joints)) if signals.moves(values[:, k])]
    return any(min((strong & (sign * needed > 0))[:, k].mean() for sign in (1, -1)) > OFTEN for k in moved)


def _led(v: View) -> bool:
    """Whether drives obey positions or speeds, and columns are called commands of such."""
    kinds = {d.command for d in v.robot.drives if d.command != "none"}
    asked = {b.reading.kind for b in v.blocks if b.reading.command and v.moves(b)}
    return bool(kinds) and kinds <= asked & {POSITION, SPEED}


def _as_current(v: View, block: Block) -> tuple[float, list[str]]:
    """Whether a block without a name is the measured currents: it goes with the torques that the motion needs, and it is
    no exact multiple of another, as what a controller computed would be."""
    values, relations = v.on(v.position.block, block), _beside_need(v, block)
    if values is None or relations is None:
        return 0.0, []
    fit = float(np.median([abs(r.correlation) for r in relations]))
    if fit < 0.5:
        return 0.0, []
    if v.hints.gains is not None and v.hints.gains != FIT:
        size = float(np.median([abs(r.slope) * abs(g) for r, g in zip(relations, v.gains(), strict=True)]))
        if not 0.3 < size < 3:
            return 1.0, [f"with your gains {size:.2g} times what the motion needs"]
    score, why = (
        3.0 + fit,
        f"goes with the torques that the motion needs (correlation {fit:.2f}), as large with your gains",
    )
    for other in v.blocks:
        if other is block or other.used or other.how != BY_PLACE or len(other.values) != len(block.values):
            continue
        alike = float(np.median([abs(r.correlation) for r in signals.each(block.values, other.values)]))
        if alike > 0.7:
            # Of what was asked for and what was measured the second is rougher.
            rougher = signals.roughness(block.values) / max(signals.roughness(other.values), 1e-30)
            score += 1 if rougher > ROUGHER else -2 if rougher < 1 / ROUGHER else 0
            word = "rougher" if rougher > 1 else "smoother"
            meant = "measured rather than asked for" if rougher > 1 else "asked for rather than measured"
            why += f"; much like {other.name} but {word} ({max(rougher, 1 / rougher):.2g} times): {meant}"
    return score, [why]


def _gains(v: View, relations: list[signals.Relation] | None) -> list[float]:
    """N.m (N) of each ampere, joint by joint: as said, or the least gains with which the currents are what the motion needs.
    None, and a question asked, where they cannot be estimated."""
    if v.hints.gains != FIT:
        return v.gains()
    weak = [j.name for j, r in zip(v.joints, relations or (), strict=False) if abs(r.correlation) < LEAST_SEEN]
    if not relations or weak:
        v.out.ask(
            f"torques: the gains of {', '.join(weak) or 'the motors'} cannot be estimated: their currents do not go with what "
            "the motion needs by the model; say task.gains=[N.m per A, one for each joint]"
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


def torque_units(v: View, block: Block) -> UnitChoice:
    """N.m or N; a current through the gain that was said. A sign turned against the motion's need is turned back."""
    kinds = ["N.m" if j.kind == "hinge" else "N" for j in v.joints]
    current = block.reading.kind == CURRENT or (block.reading.kind is None and v.hints.gains is not None)
    if current and v.hints.gains is None:
        v.out.ask(
            f"torques: {block.name} are motor currents; say task.gains=[N.m per A, one for each joint], or task.gains={FIT} to "
            "estimate them from the model's masses"
        )
        return UnitChoice((), UNKNOWN, "a current, whose gain no file can say")
    relations = _beside_need(v, block) if not block.reading.command else None
    gains = _gains(v, relations) if current else []
    if current and not gains:
        return UnitChoice((), UNKNOWN, "a current whose gain cannot be estimated")
    if current:
        v.gained.append(block.name)
    entries, turned, unclear, checked = [], [], [], 0
    sizes: dict[int, float] = {}
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
        if not current and relations is not None and k in telling and abs(relations[k].correlation) > 0.7:
            sizes[k] = UNITS[entry["unit"]][1] * abs(relations[k].slope)
            checked += 0.3 < sizes[k] < 3
        if relations is not None and k in telling and relations[k].correlation < -0.4:
            # Turned only where the size, too, is what the motion needs: a model far off can run against any torque.
            r = relations[k]
            size = abs(r.slope) * UNITS[entry["unit"]][1] * abs(float(entry.get("scale", 1.0)))
            if r.correlation < -0.9 and 0.5 < size < 2:
                entry["sign"] = -1
                turned.append(v.joints[k].name)
            elif r.correlation < -0.7 and 0.5 < size < 2:
                v.out.ask(
                    f"torques: {block.columns[k]} seems to run against what the motion of {v.joints[k].name} needs "
                    f"(correlation {r.correlation:.2f}); if it does, add 'sign: -1' to it in the mapping"
                )
            else:
                unclear.append(v.joints[k].name)
        entries.append(entry)
    # A unit is that of all joints: at one alone friction may be many times what a slow motion needs.
    middle = float(np.median(list(sizes.values()))) if sizes else 1.0
    if not 0.05 < middle < 20:
        return UnitChoice((), UNKNOWN, f"{middle:.3g} times what the motion needs in {entries[0]['unit']}")
    for k, size in sizes.items():
        if not 1 / FAR_OFF < size < FAR_OFF:
            unit = entries[k]["unit"]
            return UnitChoice((), UNKNOWN, f"{size:.3g} times what the motion needs in {unit} at {v.joints[k].name}")
    said = (
        "current times a gain estimated from what the motion needs"
        if v.hints.gains == FIT
        else "current times the gain you said"
    )
    why = said if current else f"{entries[0]['unit']}" + (
        ", as large as the motion needs" if checked else ", the usual unit; not checked")  # fmt: skip
    if turned:
        why += f"; sign turned at {', '.join(turned)}: it was against what the motion needs"
    if unclear:
        why += f"; sign at {', '.join(unclear)} not clear, kept as it is: the model needs the other, but not this much"
    stated_all = all(u in ("N.m", "mN.m", "N", "mN") for u in block.units) if block.units else False
    stated_all = stated_all or (current and v.hints.gains != FIT)
    return UnitChoice(tuple(entries), SURE if stated_all and not turned and not unclear else LIKELY, why)
