"""The unit of a column from its name, its size beside the joint's limits, and its ratio to what it belongs to."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ee_dist.measurements.proposal.blocks import BY_SENSOR, Block
from ee_dist.measurements.proposal.model import LIKELY, SHARE, SURE, UNKNOWN, Hints
from ee_dist.measurements.standing import reach_of
from ee_dist.measurements.units import TURNS_ON, UNITS
from ee_dist.robots.model import Joint

ANGLES, LENGTHS = ("rad", "deg", "turn"), ("m", "mm", "cm")
BEYOND = 1.15
"""How far beyond its limits a joint may be seen (zero offsets, soft stops)."""
STILL = 0.02
"""A block whose joints all stay within this share of their reach does not show its unit."""
NEAR = 0.35
"""Ratios within this share of one between two units are that."""
LOOSE = 4.0
"""A soft drive goes only part of the way to its command: so far from one its ratio may be, and is no other unit yet."""
COUNTS = 360.0
"""Whole numbers beyond this may be the counts of an encoder where a joint has no end."""
GRIPPERS = ("gripper", "jaw", "finger", "claw")
OF_RANGES = "shares of each joint's range, taken to be that between the model's limits"
CALIBRATED = (
    f"positions in percent are {OF_RANGES}: a servo that was calibrated over less of it went less far than is read here, by that "
    "share (LeRobot's calibration file has its ends, range_min and range_max, 4096 to a turn): put them into the joint's limits, "
    "or mend 'scale' and 'offset' in the mapping"
)
"""What people are told of that."""


@dataclass(frozen=True)
class UnitChoice:
    """Entries for the mapping (unit, scale, offset), one a joint; how sure, and why; None where a person must say. ``own``: what
    is said of single joints besides, by their places."""

    entries: tuple[dict[str, Any], ...]
    sure: str
    why: str
    own: Mapping[int, str] = field(default_factory=dict)


def position_units(block: Block, joints: Sequence[Joint], hints: Hints) -> UnitChoice:
    """The unit of positions, the same for all joints but a gripper's."""
    if block.table.header.get("format") == "lerobot":
        return _lerobot(block, joints, hints)
    kinds = {j.kind for j in joints}
    if kinds == {"hinge", "slide"}:
        parts = _as_the_others(
            [position_units(_part(block, [k]), [j], _for_kind(hints, j)) for k, j in enumerate(joints)], block, joints
        )
        worst = next((p for s in (UNKNOWN, LIKELY) for p in parts if p.sure == s), parts[0])
        said = "; ".join(dict.fromkeys(f"{j.name}: {p.why}" for j, p in zip(joints, parts, strict=True)))
        why = worst.why if worst.sure == UNKNOWN else said
        # One that nobody knows leaves all open: what is not known of one joint is asked for.
        entries = tuple(e for p in parts for e in p.entries)
        return UnitChoice(entries if len(entries) == len(parts) else (), worst.sure, why)
    allowed = LENGTHS if kinds == {"slide"} else (*ANGLES, "mrad")
    reach = np.array([reach_of(j) if math.isfinite(j.ends[1]) else math.inf for j in joints])
    if hints.unit == SHARE:
        return _share(block, joints)
    if hints.unit:
        return _all(block, hints.unit, SURE, f"{hints.unit}, as you said")
    seen = np.abs(block.values).max(axis=0)
    # Only joints that move show a unit: one at rest fits all.
    fits = [u for u in allowed if u != "mrad" and (seen * UNITS[u][1] <= BEYOND * reach).all()]
    stated = block.unit
    if stated in allowed:
        size = UNITS[str(stated)][1]
        if (seen * size > 3 * reach).any():
            far = int(np.argmax(seen * size / reach))
            why = f"the name says {stated}, but then it reaches {seen[far] * size:.3g} where the joint ends at {reach[far]:.3g}"
            return UnitChoice((), UNKNOWN, why)
        return _all(block, str(stated), SURE, f"its name says {stated}")
    if stated is not None:
        return UnitChoice((), UNKNOWN, f"the name says {stated}, which is no unit of a joint's position")
    span = np.ptp(block.values, axis=0)
    # Of a joint that turns on and on, or has no stops in the file, a motion is large beside a turn or two.
    room = np.minimum(reach, [TURNS_ON if j.kind == "hinge" else math.pi for j in joints])
    lively = [u for u in fits if (span * UNITS[u][1] > STILL * room).any()]
    if allowed[0] in fits and not {*lively} & {*allowed[:2]}:
        if block.how == BY_SENSOR:
            return _all(
                block, allowed[0], LIKELY, f"no unit is stated: in {allowed[0]}, as the robot's sensors, a small motion"
            )
        if lively:
            return UnitChoice(
                (), UNKNOWN, f"numbers to {seen.max():.4g}: a small motion in {allowed[0]}, or {lively[0]}"
            )
    if not lively:
        why = f"numbers to {seen.max():.4g} fit no unit of {allowed[0]} within the joints' limits{counts(block)}"
        return UnitChoice((), UNKNOWN, why)
    best, turning = lively[0], reach > TURNS_ON
    if turning.any() and seen[turning].max() > COUNTS and counts(block):
        return UnitChoice((), UNKNOWN, f"numbers to {seen.max():.4g}{counts(block)}")
    if best == "rad" and "deg" in lively and turning.any() and seen[turning].max() > TURNS_ON:
        return UnitChoice((), UNKNOWN, f"numbers to {seen[turning].max():.4g}: degrees, or many turns in rad")
    excluded = [u for u in allowed[:2] if u not in lively]
    if best != allowed[0]:
        return _all(block, best, SURE if len(lively) == 1 or best == allowed[1] else LIKELY,
                    f"numbers to {seen.max():.4g}: more than the joints reach in {allowed[0]}")  # fmt: skip
    if excluded:
        return _all(block, best, SURE, f"within the joints' limits in {best}, hardly a motion in {excluded[0]}")
    return _all(
        block,
        best,
        LIKELY,
        f"within the joints' limits in {best}, and the usual unit; {lively[1]} would be a small motion",
    )


def _for_kind(hints: Hints, joint: Joint) -> Hints:
    """A unit that was said is that of the joints that it fits, where some turn and some slide."""
    other = LENGTHS if joint.kind == "hinge" else (*ANGLES, "mrad")
    return replace(hints, unit=None) if hints.unit in other else hints


def _as_the_others(parts: Sequence[UnitChoice], block: Block, joints: Sequence[Joint]) -> list[UnitChoice]:
    """Of joints that turn and joints that slide, those that stand still, and so show no unit, are in rad and m where all that
    others show is."""
    shown = {e["unit"] for p in parts for e in p.entries}
    if not shown or not shown <= {"rad", "m"} or not all(set(e) == {"unit"} for p in parts for e in p.entries):
        return list(parts)
    span = np.ptp(block.values, axis=0)
    found = []
    for k, (part, joint) in enumerate(zip(parts, joints, strict=True)):
        unit = "rad" if joint.kind == "hinge" else "m"
        room = reach_of(joint) if math.isfinite(joint.ends[1]) else math.inf
        seen = float(np.abs(block.values[:, k]).max())
        if not part.entries and span[k] <= STILL * min(room, TURNS_ON) and seen <= BEYOND * room:
            why = f"stands still: in {unit}, as the others are in {' and '.join(sorted(shown))}"
            part = UnitChoice(({"unit": unit},), LIKELY, why)
        found.append(part)
    return found


def counts(block: Block) -> str:
    """What whole numbers may be: the counts of an encoder."""
    # As the file holds them: those of the block may stand between rows.
    seen = np.concatenate([block.table.numbers(c, gaps=True) for c in block.columns])
    seen = seen[np.isfinite(seen)]
    if not (seen == np.round(seen)).all() or not np.abs(seen).max() > COUNTS:
        return ""
    return ", all of them whole: counts? of 4096 a turn and 2048 at zero write 'unit: turn, scale: 0.000244140625, offset: -0.5'"


def _part(block: Block, keep: list[int]) -> Block:
    return replace(block, columns=tuple(block.columns[k] for k in keep), values=block.values[:, keep],
                   units=tuple(block.units[k] for k in keep) if block.units else ())  # fmt: skip


def _all(block: Block, unit: str, sure: str, why: str) -> UnitChoice:
    return UnitChoice(({"unit": unit},) * len(block.columns), sure, why)


def _lerobot(block: Block, joints: Sequence[Joint], hints: Hints) -> UnitChoice:
    """Hobby-servo arms are logged in degrees or in shares of each joint's calibrated range, -100 to 100; grippers 0 to 100."""
    arm = [k for k, c in enumerate(block.columns) if not any(g in c.lower() for g in GRIPPERS)]
    seen = float(np.abs(block.values[:, arm]).max()) if arm else 0.0
    if hints.unit == SHARE:
        return _share(block, joints)
    if hints.unit in ("deg", "rad"):
        return _with_gripper(
            block, joints, hints.unit, SURE, f"{hints.unit}, as you said; zero is taken to be the model's zero"
        )
    if seen <= 2 * math.pi:
        return _with_gripper(block, joints, "rad", LIKELY, f"numbers to {seen:.3g}: too small for degrees or shares")
    if seen > 100.5:
        why = f"numbers to {seen:.4g}: more than the 100 of a share; zero is taken to be the model's zero"
        return _with_gripper(block, joints, "deg", SURE, why)
    return UnitChoice((), UNKNOWN, f"numbers to {seen:.4g}: degrees, or -100 to 100 of each joint's range")


def _with_gripper(block: Block, joints: Sequence[Joint], unit: str, sure: str, why: str) -> UnitChoice:
    plain = {"unit": unit}
    entries = tuple(
        _of_range(j, 0.0) if any(g in c.lower() for g in GRIPPERS) and unit == "deg" else plain
        for c, j in zip(block.columns, joints, strict=True)
    )
    if any(e is not plain for e in entries):
        why += "; the gripper 0 to 100 of its range"
    return UnitChoice(entries, sure, why)


def _share(block: Block, joints: Sequence[Joint]) -> UnitChoice:
    """-100 to 100 (a gripper 0 to 100) as the range between the model's limits."""
    for j in joints:
        low, high = j.ends
        if not math.isfinite(high - low) or high <= low:
            return UnitChoice(
                (), UNKNOWN, f"a share of the range of {j.name}, which has no limits in the robot's description"
            )
    entries = tuple(
        _of_range(j, 0.0 if any(g in c.lower() for g in GRIPPERS) else -100.0)
        for c, j in zip(block.columns, joints, strict=True)
    )
    return UnitChoice(entries, LIKELY, OF_RANGES)


def _of_range(joint: Joint, low: float) -> dict[str, Any]:
    scale = (joint.upper - joint.lower) / (100.0 - low)
    return {"unit": "rad" if joint.kind == "hinge" else "m", "scale": scale, "offset": joint.lower - low * scale}


def by_ratio(ratio: float, allowed: Sequence[str], reference: str, near: float = NEAR) -> str | None:
    """The unit in which numbers are ``ratio`` times what they are in ``reference``, to within the share ``near``."""
    found = [(abs(math.log(abs(ratio) * UNITS[u][1] / UNITS[reference][1])), u) for u in allowed] if ratio else []
    return min(found)[1] if found and min(found)[0] < math.log(1 + near) else None
