"""Columns that name a limb and count its joints: ``FR_0_target`` is asked of the first joint of the leg whose joints are FR_."""

from __future__ import annotations

from collections.abc import Sequence

from ee_dist.measurements.proposal.words import Reading, read_name, tokens

SIDES = frozenset(tokens("fl fr rl rr lf rf lr hl hr lh rh bl br lb rb front rear hind back left right l r"))
"""Words that tell one limb from another."""


def called_by_limbs(addresses: Sequence[str], joints: Sequence[str]) -> dict[str, tuple[str, Reading]]:
    """(joint, reading) of columns called by a limb and a number, where there is one for each joint and each limb is counted from
    0 or from 1. The joints of a limb are counted as the robot has them, from its base on."""
    limbs: dict[frozenset[str], list[str]] = {}
    for joint in joints:
        limbs.setdefault(SIDES & frozenset(tokens(joint)), []).append(joint)
    if len(limbs) < 2 or frozenset() in limbs or max(map(len, limbs.values())) < 2:
        return {}
    families: dict[str, list[tuple[frozenset[str], int, str, Reading]]] = {}
    for address in addresses:
        words = tokens(address)
        own, numbers = SIDES & frozenset(words), [int(w) for w in words if w.isdigit()]
        if own in limbs and len(numbers) == 1:
            reading = read_name(address, own)
            families.setdefault(reading.family, []).append((own, numbers[0], address, reading))
    found: dict[str, tuple[str, Reading]] = {}
    for members in families.values():
        placed: dict[str, tuple[str, Reading]] = {}
        for limb, its in limbs.items():
            counted = sorted(((n, a, r) for own, n, a, r in members if own == limb), key=lambda one: one[0])
            first = counted[0][0] if counted else 0
            if first in (0, 1) and [n for n, _, _ in counted] == list(range(first, first + len(its))):
                placed |= {a: (joint, reading) for joint, (_, a, reading) in zip(its, counted, strict=True)}
        if len(placed) == len(members) == len(joints):
            found |= placed
    return found
