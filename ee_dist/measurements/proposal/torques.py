"""Which block is the torques or motor currents, judged by what the motion needs."""

from __future__ import annotations

from itertools import permutations

import numpy as np

from ee_dist.basics.names import listed
from ee_dist.measurements import signals
from ee_dist.measurements.proposal.asked_for import called_like_a_plan, goes_with_a_plan
from ee_dist.measurements.proposal.blocks import BY_PLACE, Block
from ee_dist.measurements.proposal.model import FIT, LIKELY, SURE, UNKNOWN, Choice
from ee_dist.measurements.proposal.torque_scale import beside_need_of, need_of, torque_units
from ee_dist.measurements.proposal.torque_shares import FAR, led
from ee_dist.measurements.proposal.view import Scored, View
from ee_dist.measurements.proposal.words import CURRENT, TORQUE
from ee_dist.robots.instruments import MOTOR_TORQUE
from ee_dist.trials.log import Array

ROUGHER = 1.15
"""What was measured is rougher than what was asked for, by this factor or more."""
CLEARLY, WELL = 0.3, 0.3
"""Another order of the joints is asked for if it leaves less than this share of what the robot's leaves, and of all."""
BOTH_WAYS, OFTEN = 0.1, 0.05
"""A motion needs torques of both signs where this share of the largest is passed, either way, in this share of the time that
the joint moves; it moves both ways from this share of its highest speed on. While it rests its weight alone is seen."""
GOES, HALF = 0.8, 0.5
"""Correlation with what the motion needs from which numbers without a name go with it, if it leaves less than this share of what
the positions leave unexplained."""
SHOWN = 4
BEYOND = 5.0
"""Times what drives give at most, the median of joints, from which numbers are not what they gave: servos report mA."""


def _check_order(v: View, block: Block) -> None:
    """Asks for the order of the joints where torques go with the motion in another order than the robot's."""
    count = len(v.joints)
    if not block.numbered or v.hints.joints is not None or count < 2:
        return
    own = list(range(count))
    orders = [list(p) for p in permutations(own)] if count <= 3 else [own, own[::-1]]
    left = []
    for places in orders:
        relations = beside_need_of(v, block, places)
        left.append(sum(1 - r.correlation**2 for r in relations) / count if relations else 1.0)
    best = int(np.argmin(left))
    if left[best] < min(CLEARLY * left[0], WELL):
        names = [v.joints[orders[best].index(k)].name for k in own]
        v.out.ask(
            f"joints: {block.name} leave {100 * left[best]:.0f} % of what the motion needs unexplained as those of "
            f"{', '.join(names)}, {100 * left[0]:.0f} % in the robot's order; say task.joints=[...] as the columns are"
        )


MANY = 6
"""Joints that do not all push one way only."""


def add_torques(v: View) -> None:
    """The torque sensors and the torques of the drives, where a block is the one or the other."""
    sensed = [net or motor for net, motor in zip(v.sensor_names("torque"), v.sensor_names(MOTOR_TORQUE), strict=True)]
    found = []
    v.needed = need_of(v)
    for b in v.blocks:
        named = b.reading.kind in (TORQUE, CURRENT) and not b.reading.weak
        if named and not b.used and b.reading.command is not True and v.moves(b) and _unsigned(v, b):
            b.used = True
            v.out.notes.append(
                f"{b.name} never change sign, though the motion needs torques of both: they are sizes, as some servos report "
                "their currents, and are left out"
            )
        if b.used or b.reading.command or not v.moves(b) or not (named or b.how == BY_PLACE):
            continue
        if called_like_a_plan(v, b) if named else goes_with_a_plan(v, b):
            continue
        score = (
            (3.0 if b.reading.kind == TORQUE else 2.0) + (1 if b.reading.command is False else 0) - 2 * b.reading.second
        )
        why = [f"called a {b.reading.kind}"] if named else []
        if not named:
            score, why = _as_current(v, b) if v.hints.gains else _as_torques(v, b)
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
        else:
            _tell_rivals(v, [s for s in found if s.score >= 2])
        return
    current, untold = chosen.block.reading.kind == CURRENT, v.hints.gains is None and not any(sensed)
    beyond = _beyond_the_drives(v, chosen.block) if untold and not current else ""
    if untold and led(v) and (current or beyond):
        # A robot that is led by its commands is compared without torques.
        what = f"motor currents ({chosen.block.name}) are" if current else f"{chosen.block.name} {beyond}: no N.m, and"
        v.out.notes.append(
            f"{what} left out; with task.gains=[N.m per {'A' if current else 'one'}, one for each joint], or "
            f"task.gains={FIT}, they are the torques of a balance of forces"
        )
        return
    if beyond:
        v.out.ask(
            f"torques: {chosen.block.name} {beyond}: currents? say task.gains=[N.m per one, one for each joint] or "
            f"task.gains={FIT}; or write 'unit: N.m' into the mapping, if the drive gives more than its description says"
        )
    chosen.block.used = True
    units = torque_units(v, chosen.block)
    _check_order(v, chosen.block)
    level = LIKELY if chosen.block.how == BY_PLACE and chosen.block.reading.kind is None else SURE
    if any(sensed):
        v.add("sensors", sensed, chosen.block, units, chosen.why, level)
    v.add("torques", list(v.robot.motor_names), chosen.block, units, chosen.why, level)


def _beyond_the_drives(v: View, block: Block) -> str:
    """What numbers without a unit reach that drives cannot give, by what their file states; empty where they may be N.m (N)."""
    stated = {d.joint: d.torque_limit for d in v.robot.drives if np.isfinite(d.torque_limit)}
    guessed = v.robot.assumed_joints("torque_limit")
    most = np.nanmax(np.abs(block.values), axis=0)
    times = {
        k: float(most[k]) / stated[j.name]
        for k, j in enumerate(v.joints)
        if most[k] > 0 and j.name in stated and j.name not in guessed
    }
    if any(block.units) or not times or float(np.median(list(times.values()))) <= BEYOND:
        return ""
    worst = max(times, key=lambda k: times[k])
    name = v.joints[worst].name
    return f"reach {most[worst]:.3g} at {name}, where its drive gives {stated[name]:.3g} at most"


def _tell_rivals(v: View, found: list[Scored]) -> None:
    """Torques of which none is clearly the one are not dropped in silence."""
    if not found:
        return
    names = " or ".join(s.block.name + _beside_text(v, s.block) for s in sorted(found, key=lambda s: -s.score)[:SHOWN])
    how = "write those that were measured into the mapping as torques, for a balance of forces"
    if led(v) or any(d.command == "torque" for d in v.robot.drives):
        v.out.notes.append(f"torques: {names}? left out; {how}")
    else:
        v.out.ask(f"torques: {names}? {how}")


def _beside_text(v: View, block: Block) -> str:
    if block.reading.kind == CURRENT:
        return " (currents)"
    sizes = [abs(r.slope) for r in beside_need_of(v, block) or () if abs(r.correlation) > GOES]
    return f" ({float(np.median(sizes)):.2g} times what the motion needs)" if sizes else ""


def _unsigned(v: View, block: Block) -> bool:
    """Whether no column of a block ever changes its sign, while what the motion needs of some of these joints does."""
    values = v.on(v.position.block, block)
    if values is None or ((values < 0).any() and (values > 0).any()):
        return False
    if v.needed is None:
        # What stands on a floor needs nobody knows what, but not one sign at all of many joints that move to and fro.
        return int(sum(signals.moves(c) for c in values.T)) >= MANY and float(np.abs(values).min()) == 0.0
    given = (k for k in range(len(v.joints)) if signals.moves(values[:, k]))
    return any(_both_signs(*(x[:, k] for x in v.needed)) for k in given)


def _both_signs(needed: Array, speed: Array) -> bool:
    """Whether a joint that moves both ways needs torques (T,) of both signs for it; its friction does in any case."""
    going = np.abs(speed) > BOTH_WAYS * np.abs(speed).max()
    strong = needed[going] / max(float(np.abs(needed).max()), 1e-30)
    ways = (speed[going] > 0).any() and (speed[going] < 0).any()
    return bool(ways and min((sign * strong > BOTH_WAYS).mean() for sign in (1, -1)) > OFTEN)


def _as_torques(v: View, block: Block) -> tuple[float, list[str]]:
    """Whether a block without a name is torques, without gains: at half the joints or more it goes with what the motion needs,
    better than with the positions, and is as large; if it is not as large, they may be currents, which is noted."""
    values, relations = v.on(v.position.block, block), beside_need_of(v, block)
    if values is None or relations is None:
        return 0.0, []
    places = signals.each(values, v.position.block.values)
    with_need = [
        k for k in signals.lively(v.position.block.values)
        if abs(relations[k].correlation) > GOES
        and 1 - relations[k].correlation ** 2 < HALF * (1 - places[k].correlation ** 2)
    ]  # fmt: skip
    if len(with_need) < 2 or 2 * len(with_need) < len(v.joints):
        return 0.0, []
    sizes = [abs(relations[k].slope) for k in with_need]
    where = listed(v.joints[k].name for k in with_need)
    if not FAR[0] < float(np.median(sizes)) < FAR[1]:
        v.out.notes.append(
            f"{block.name} go with the torques that the motion needs at {where}, but are {float(np.median(sizes)):.2g} times as "
            f"large: if they are motor currents, say task.gains=[N.m per A, one for each joint], or task.gains={FIT}"
        )
        return 0.0, []
    fit = float(np.mean([abs(relations[k].correlation) for k in with_need]))
    return 2.0 + fit, [f"goes with the torques that the motion needs at {where} (correlation {fit:.2f}), and as large"]


def _as_current(v: View, block: Block) -> tuple[float, list[str]]:
    """Whether a block without a name is the measured currents: it goes with the torques that the motion needs, and it is
    no exact multiple of another, as what a controller computed would be."""
    values, relations = v.on(v.position.block, block), beside_need_of(v, block)
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
