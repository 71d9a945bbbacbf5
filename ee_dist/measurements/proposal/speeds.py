"""Which block is the measured speeds, and in which unit: the one in which they are the change of the positions."""

from __future__ import annotations

import math
import statistics
from collections.abc import Collection
from dataclasses import replace
from typing import Any

import numpy as np

from ee_dist.measurements import signals
from ee_dist.measurements.proposal.asked_for import was_asked_for
from ee_dist.measurements.proposal.blocks import Block
from ee_dist.measurements.proposal.model import LIKELY, SURE, UNKNOWN, Choice
from ee_dist.measurements.proposal.rest import by_its_name
from ee_dist.measurements.proposal.units import ANGLES, LENGTHS, UnitChoice, by_ratio
from ee_dist.measurements.proposal.view import Scored, View, can_be
from ee_dist.measurements.proposal.words import SPEED

AGREES = 0.8
"""Correlation from which a speed is the change of a position."""
USUAL = 0.05
"""Share by which a count of the positions may be off a radian and be one;"""
OFF = 0.1
"""Share by which speeds may be off the change of the positions and still be said to agree with the time."""
SPEEDS = {"hinge": ("rad/s", "deg/s", "rpm"), "slide": ("m/s", "mm/s")}


def add_speeds(v: View) -> None:
    """The speed sensors: a block that is the change of the positions, or an estimate where there is none."""
    names = v.sensor_names("velocity")
    if not any(names):
        return
    found = []
    for b in v.blocks:
        if b.used or not can_be(b, SPEED) or b.reading.command:
            continue
        r = v.derivative(v.position.block, b)
        # Of a rate that is filtered, or read coarsely, the name tells more than the signal; of a letter only beside it.
        called = b.reading.kind == SPEED and (not b.reading.weak or abs(r.correlation) > 0.6)
        score = (2.0 if called else 0.0) + (b.reading.command is False) - 1.5 * b.reading.second
        # Of two that change with the positions the better by a power of ten is the measured one.
        score -= 0.5 * math.log10(1 - abs(r.correlation) + 1e-6)
        score += 3 if abs(r.correlation) > 0.9 else 1 if abs(r.correlation) > 0.6 else -3
        found.append(Scored(b, score, [f"change of the positions (correlation {r.correlation:.3f})"]))
    found = _measured(v, found)
    chosen = v.pick(sorted(found, key=lambda s: -s.score), 3.0)
    positions = v.sensor_names("position")
    if chosen is None:
        able = [s.block.name for s in found if s.score >= 3]
        poor = [s for s in found if s.block.reading.kind == SPEED and not s.block.reading.weak and v.moves(s.block)]
        why = "no column: estimated from the position"
        if able:
            why = f"{' or '.join(able)} could be it: estimated from the position"
        elif poor:
            fit = abs(v.derivative(v.position.block, poor[0].block).correlation)
            why = f"{poor[0].block.name} hardly is the change of the positions (correlation {fit:.2f}): estimated from them"
        _estimate(v, names, positions, LIKELY if able or poor else SURE, [why] * len(names))
        return
    chosen.block.used = True
    odd = {**_odd(v, chosen.block), **_dead(v, chosen.block)}
    v.add(
        "sensors", [n * (k not in odd) for k, n in enumerate(names)], chosen.block,
        speed_units(v, chosen.block, odd), chosen.why,
    )  # fmt: skip
    _estimate(
        v, [n * (k in odd) for k, n in enumerate(names)], positions, LIKELY, [odd.get(k, "") for k in range(len(names))]
    )


def _measured(v: View, found: list[Scored]) -> list[Scored]:
    """Those that are not the rate of what was asked for, where another is there that is not; else those with noise, where it is
    told of the others that they have none."""
    good = [s for s in found if s.score >= 3]
    asked = [s for s in good if was_asked_for(v, s.block)] if len(good) > 1 else []
    if len(asked) == len(good):
        return found
    if not asked:
        silent = [s for s in good if s.block.reading.command is None]
        smooth = [s for s in silent if any(v.planned_beside(s.block, o.block) for o in good if o is not s)]
        for s in good:
            if smooth and s not in smooth:
                s.why.append(
                    f"carries noise, which {' and '.join(o.block.name for o in smooth)} does not: planned or smoothed"
                )
        return [s for s in found if s not in smooth]
    for s in good:
        if s not in asked:
            names = " and ".join(a.block.name for a in asked)
            s.why.append(f"{names} that of what was asked for")
    return [s for s in found if s not in asked]


def _estimate(v: View, names: list[str], positions: list[str], sure: str, why: list[str]) -> None:
    """Speeds that are estimated from the positions, for the sensors that have a name."""
    for k, (name, of) in enumerate(zip(names, positions, strict=True)):
        called = by_its_name(v, next(s for s in v.robot.sensors if s.name == name)) if name else None
        if called is not None:
            v.out.choices.append(called)
        elif name and of:
            # It is made of rows as far apart as the log's, or as the steps that these are brought to.
            apart_s = max(v.step(v.position.block), v.robot.time_step_s)
            entry = {"speed_of": of, "cutoff_hz": min(50.0, round(0.2 / apart_s, 3))}
            v.out.choices.append(Choice("sensors", name, entry, sure, why[k]))


def _compared(v: View, block: Block) -> list[signals.Relation] | None:
    """How the numbers go with the change of the positions, joint by joint; None where that is not known."""
    values = v.on(v.position.block, block)
    if values is None or not v.units.entries:
        return None
    return signals.each(*signals.speed_and_change(v.metric(), values, v.step(v.position.block)))


def _seen(v: View, k: int, r: signals.Relation) -> str | None:
    kinds = SPEEDS[v.joints[k].kind]
    return by_ratio(r.slope, kinds, kinds[0]) if abs(r.correlation) > AGREES else None


def _odd(v: View, block: Block) -> dict[int, str]:
    """Joints at which the speed is no unit's times the change of the position although it is at most others, and why: a
    gripper's position is often a share of its range. One such joint is no reason to ask about all."""
    relations = _compared(v, block) or []
    moving = signals.lively(block.values, v.position.block.values) if relations else []
    fine = [k for k in moving if _seen(v, k, relations[k])]
    if 2 * len(fine) <= len(moving):
        return {}
    return {
        k: f"{block.columns[k]} goes as {relations[k].slope:.3g} times the change of the position (correlation "
        f"{relations[k].correlation:.2f}), which is no unit: estimated from the position, which may be a share of a range"
        for k in moving
        if k not in fine and not (block.units and block.units[k])
    }


def _dead(v: View, block: Block) -> dict[int, str]:
    """Joints that move and whose speed reads one number all the time, and why that is none: compared, it would be most of what a
    model seems to get wrong."""
    return {
        k: f"{block.columns[k]} reads {block.values[0, k]:g} in every row while the joint moves: estimated from the position"
        for k in signals.lively(v.position.block.values)
        if not np.ptp(block.values[:, k])
    }


def _of_a_count(v: View, block: Block) -> str:
    """What one count of the positions is if the speeds are in the usual unit: no file says how many make a turn, and the speeds
    beside them do."""
    r, kinds = v.derivative(v.position.block, block), {j.kind for j in v.joints}
    if len(kinds) != 1 or r.correlation < AGREES or not r.slope:
        return ""
    (kind,) = kinds
    unit = (ANGLES if kind == "hinge" else LENGTHS)[0]
    if kind == "hinge" and abs(r.slope - 1) < USUAL:
        return f"; in {SPEEDS[kind][0]} they are the change of positions in {unit}, and in deg/s of positions in deg"
    turn = f", {2 * math.pi / r.slope:.4g} to a turn" if kind == "hinge" else ""
    return f"; in {SPEEDS[kind][0]} one of their numbers is {r.slope:.4g} {unit}{turn}: 'unit: {unit}, scale: {r.slope:.4g}'"


def speed_units(v: View, block: Block, odd: Collection[int] = ()) -> UnitChoice:
    """The unit in which the numbers are the change of the positions, with the sign that this takes; joints that are ``odd``
    are not asked about."""
    relations = _compared(v, block)
    if relations is None:
        return UnitChoice((), UNKNOWN, f"the unit of the positions is open{_of_a_count(v, block)}")
    sure, why = SURE, ""
    entries: list[dict[str, Any]] = []
    telling = signals.lively(v.position.block.values)
    every = [_seen(v, k, r) for k, r in enumerate(relations)]
    for k, (r, seen) in enumerate(zip(relations, every, strict=True)):
        kind = v.joints[k].kind
        base = SPEEDS[kind][0]
        if k in odd:
            entries.append({"unit": base})
            continue
        stated = block.units[k] if block.units and block.units[k] in SPEEDS[kind] else None
        if seen is None and (k not in telling or not signals.moves(block.values[:, k])):
            # Columns of one family have one unit, which those that move show.
            others = [u for i, u in enumerate(every) if u and i not in odd and v.joints[i].kind == kind]
            seen = stated or (others[0] if others else base)
        if stated and seen and stated != seen:
            return UnitChoice((), UNKNOWN, f"the name says {stated}, but beside the positions it is {seen}")
        if seen is None:
            sure = LIKELY if stated else UNKNOWN
            alike = _one_factor([relations[j].slope for j in telling if j not in odd], 1 / v.step(v.position.block))
            why = f"{stated or 'its unit'} could not be checked: {r.slope:.3g} times the change of the positions{alike}"
        entry: dict[str, Any] = {"unit": seen or stated or "???"}
        if r.correlation < -AGREES:
            entry["sign"] = -1
        entries.append(entry)
    _checks_time(v, entries, sure, [relations[k].slope for k in telling if k not in odd])
    return UnitChoice(
        tuple(entries) if sure != UNKNOWN else (), sure, why or f"{entries[0]['unit']} by its ratio to that change"
    )


def _one_factor(slopes: list[float], rate_hz: float) -> str:
    """What else it may be where the speeds of several joints are one number times the change of their positions, in rows that are
    said to come so often."""
    least, most = (f(map(abs, slopes), default=0.0) for f in (min, max))
    if len(slopes) < 2 or most > (1 + OFF) * least:
        return ""
    ratio = statistics.median(map(abs, slopes))
    long, right = "longer" if ratio > 1 else "shorter", f"task.rate_hz={rate_hz * ratio:.4g}"
    return (
        f", at all joints alike: the times may be {long} than they were by that (another rate: say {right} if rows came so "
        "often), or the speeds scaled"
    )


def _checks_time(v: View, entries: list[dict[str, Any]], sure: str, slopes: list[float]) -> None:
    """A speed that is the change of the position in units of ours, and as large, has checked the time, too."""
    large = bool(slopes) and abs(abs(statistics.median(slopes)) - 1) < OFF
    if sure == SURE and large and all(e["unit"] in ("rad/s", "m/s") for e in entries):
        for k, c in enumerate(v.out.choices):
            if c.group == "time" and c.sure == LIKELY:
                v.out.choices[k] = replace(c, sure=SURE, why=f"{c.why}; speeds agree")
