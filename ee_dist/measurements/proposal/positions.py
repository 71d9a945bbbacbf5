"""Which block is the measured positions."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping

import numpy as np

from ee_dist.basics.names import listed
from ee_dist.measurements.proposal.blocks import BY_NAME, BY_SENSOR, Block, in_full, series_of
from ee_dist.measurements.proposal.by_sensor import said_of_base
from ee_dist.measurements.proposal.model import FEWEST_ROWS, UNKNOWN, Choice
from ee_dist.measurements.proposal.other_names import other_names
from ee_dist.measurements.proposal.units import counts
from ee_dist.measurements.proposal.view import TIED, Scored, View, can_be
from ee_dist.measurements.proposal.words import POSITION, SPEED, TIME, read_name, tokens

ITS_RATE = 0.95
"""Correlation with the change of others from which numbers are their rate, and so no positions."""
MORE = 2
"""Columns of a quantity beside those of the joints that may be called as these are."""


def ranked_positions(v: View) -> list[Scored]:
    """Blocks that could be the positions, the best first."""
    found = []
    rate_of: dict[tuple[str, ...], Block] = {}
    for b in v.blocks:
        r = b.reading
        if (r.kind not in (POSITION, None) and not r.weak) or not v.moves(b):
            continue
        if all(said_of_base(c, v.robot.sensors, v.robot.motor_names) for c in b.columns):
            continue
        score = 0.0
        why: list[str] = []
        if b.how == BY_SENSOR:
            score = 2.0
        elif r.kind == POSITION:
            score, why = (1.0, ["maybe a position by its letter"]) if r.weak else (2.0, ["called a position"])
        elif _called_by_joints(b):
            score, why = 2.0, ["called by the joints alone"]
        if r.command is False:
            score, why = score + 2, [*why, *["called measured"] * (b.how != BY_SENSOR)]
        elif r.command:
            score -= 4
        score -= r.second
        rates = [(v.derivative(b, s).correlation, s) for s in v.blocks if s is not b and can_be(s, SPEED)]
        best = max(rates, key=lambda x: x[0] if x[1].reading.command is not True else 0.0, default=(0.0, b))
        if best[0] > 0.9:
            rate_of[_key(b)] = best[1]
            score, why = score + 2 + best[0], [*why, f"its change is {best[1].name} (correlation {best[0]:.3f})"]
        found.append(Scored(b, score, why))
    found = [s for s in found if not _is_a_rate(v, s.block)] or found
    return _told_by_lead(v, sorted(found, key=lambda s: -s.score), rate_of)


def _is_a_rate(v: View, block: Block) -> bool:
    """Whether numbers that nobody calls positions are the change of others, in whatever unit: of a position, its plan and their
    rates, in columns without names, the last go with one another as the first do."""
    if block.how == BY_SENSOR or (block.reading.kind == POSITION and not block.reading.weak):
        return False
    of = (b for b in v.blocks if b is not block and can_be(b, POSITION) and v.moves(b))
    return any(v.derivative(b, block).correlation > ITS_RATE for b in of)


def _called_by_joints(block: Block) -> bool:
    """Whether columns are called as the joints are and say no more, in a table and a file that say nothing else of them."""
    silent = block.reading.kind is None and not block.reading.family and block.how == BY_NAME
    names = (block.table.name, block.table.path.stem)
    return silent and all(read_name(name).kind in (POSITION, TIME, None) for name in names)


def _told_by_lead(v: View, found: list[Scored], rate_of: Mapping[tuple[str, ...], Block]) -> list[Scored]:
    """Of two that could both be the positions, the one that follows the other was measured, and the one with noise where the
    other has none, or whose rate (``rate_of`` a table's columns) has it where that of the other has none: a fine encoder shows it
    there. Where these say opposite things neither is clearly the better, and a person is asked."""
    for one in found[:4]:
        for other in found[:4]:
            if one is other or one.block.reading.command is not None:
                continue
            ahead = v.lead(other.block, one.block)
            if ahead.correlation <= 0.9:
                continue
            # However much else speaks for a plan, that its change was logged, too, makes no measurement of it.
            noisy = other.block.reading.command is None and any(
                v.planned_beside(plan, measured) for plan, measured in _with_rates(other.block, one.block, rate_of)
            )
            near = noisy or abs(one.score - other.score) < TIED + 1
            if noisy:
                one.score += 1.5
                one.why.append(f"carries noise, which {other.block.name} does not: that is a plan")
            if near and ahead.lead_s > 1.5 * v.step(one.block):
                one.score += 1.5
                one.why.append(f"follows {other.block.name} by {1e3 * ahead.lead_s:.0f} ms")
    return sorted(found, key=lambda s: -s.score)


def _key(block: Block) -> tuple[str, ...]:
    return (block.table.name, *block.columns)


def _with_rates(a: Block, b: Block, rate_of: Mapping[tuple[str, ...], Block]) -> list[tuple[Block, Block]]:
    """Two blocks, and the rates of the two where each has one of its own."""
    rates = rate_of.get(_key(a)), rate_of.get(_key(b))
    own = rates[0] is not None and rates[1] is not None and rates[0] is not rates[1]
    return [(a, b), *([(rates[0], rates[1])] if own else [])]  # type: ignore[list-item]


def ask_for_positions(v: View) -> None:
    """Why no block is the positions, as a question."""
    ranked = ranked_positions(v)
    n = len(v.joints)
    names = ", ".join(v.robot.motor_names)
    if all(len(t) < FEWEST_ROWS for t in v.timed.tables):
        rows = max(len(t) for t in v.timed.tables)
        v.out.ask(
            f"{rows} rows are too few to tell what columns are (at least {FEWEST_ROWS}): name a longer record of the same "
            "columns with it, or write the mapping by hand"
        )
    elif len(ranked) > 1 and ranked[0].score >= 2:
        v.out.ask(f"positions: {ranked[0].block.name} or {ranked[1].block.name}? write the right one into the mapping")
    elif v.hints.joints is None and (some := _recorded(v)):
        rest = [m for m in v.robot.motor_names if m not in some]
        with_speed = _recorded(v, SPEED)
        turning = [m for m in rest if m in with_speed]
        if turning:
            v.out.ask(
                f"positions: the columns name {listed(some)} alone; of {listed(turning)} speeds were recorded. Add their "
                "integral as a column of positions, or write the mapping by hand: the sensors of a description may leave out "
                "a position"
            )
        else:
            v.out.ask(
                f"positions: the columns name {listed(some)} alone; of {listed(rest)} nothing was recorded. Those that stood "
                f"still are written into the description of the robot, each with its place (rad, m): 'fixed_joints: "
                f"{{{', '.join(f'{m}: 0.0' for m in rest)}}}'; one that moved unrecorded leaves the motion of the others unknown"
            )
    elif n > 1 and (count := _nameless(v)) and (v.hints.joints is not None or count % n):
        v.out.ask(_by_their_numbers(v, count))
    elif v.hints.joints is None and n > 1 and (called := _other_joints(v)):
        none = ", and '-' for what is none of them" if len(called) > n else ""
        v.out.ask(
            f"positions: the columns call the joints {', '.join(called)}; which are these of {names}? say task.joints=[...] with "
            f"the robot's names in that order{none}"
        )
    elif v.hints.joints is None and n > 1:
        fewer = _fewer(v)
        v.out.ask(
            f"no columns can be told to be the positions of {names}{fewer}; if they have no names, say task.joints=[...] "
            "with the joints in the order of the columns, else write them into the mapping; a joint that nobody recorded, and "
            "that stood still, a gripper's say, goes into the robot's description with its place: 'fixed_joints: {JOINT: 0.0}'"
        )
    else:
        mute = [b.name for b in v.blocks if v.moves(b) and b.reading.command is None and b.reading.kind is None]
        asked = f"; is it {' or '.join(mute[:3])}?" if mute else ";"
        v.out.ask(
            f"no columns are called the positions of {names}{asked} write the right ones into the mapping, with their unit"
        )
    for m in v.robot.sensors:
        v.out.choices.append(Choice("sensors", m.name, {"column": "???"}, UNKNOWN, "not found"))


def _nameless(v: View) -> int:
    """How many columns beside the time have numbers for names, where all have."""
    for table in v.timed.tables:
        if all(a.isdigit() for a in table.addresses()):
            return len([a for a in series_of(table, filled=True) if a != v.times[table.name].column])
    return 0


def _by_their_numbers(v: View, count: int) -> str:
    """Why the order of the joints does not tell which columns without names are theirs, and how a mapping names them."""
    size = len(v.hints.joints or v.joints)
    why = f"{count} beside the time are no multiple of {size}" if count % size else "none of these goes as positions do"
    table, joint = v.timed.tables[0], v.joints[0]
    sensor = v.sensor_names("position")[0] or f"position_{joint.name}"
    low, high = joint.stops
    series = {a: at for a, at in series_of(table, filled=True).items() if a != v.times[table.name].column}
    able = [a for a, at in series.items() if np.ptp(at) > 0 and low <= at.min() and at.max() <= high]
    unit = "rad" if joint.kind == "hinge" else "m"
    line = f'{sensor}: {{column: "{able[0] if able else 3}", unit: {unit}}}'
    return (
        "positions: the columns have no names, and the order of the joints (task.joints) tells them only where they come in runs "
        f"of all {size} joints: {why}; write which is which into the mapping, by its number from 1, such as '{line}'"
    )


def _fewer(v: View) -> str:
    """That positions of fewer joints were recorded than the robot has, where numbered columns say so."""
    for table in v.timed.tables:
        readings = [(a, read_name(a)) for a in series_of(table, filled=True)]
        counted = Counter(r.family for _, r in readings if r.kind == POSITION and r.number is not None)
        for family, count in counted.most_common(1):
            own = [a for a, r in readings if r.family == family]
            if 1 < count < len(v.joints):
                return f" ({len(v.joints)} joints; {own[0]} to {own[-1]} are {count})"
    return ""


def _recorded(v: View, kind: str = POSITION) -> list[str]:
    """The joints that have a column of that kind which bears their name, where others have none; at least half of such
    columns must name one, as those of another robot may by chance."""
    found: set[str] = set()
    other = 0
    for table in v.timed.tables:
        for address in series_of(table, filled=True):
            joint = in_full(address, v.robot.motor_names)
            said = read_name(address, frozenset(tokens(joint)) if joint else frozenset())
            # That a joint was told something does not say that it was read.
            if said.kind == kind and not said.command:
                found |= {joint} if joint else set()
                other += joint is None
    return [m for m in v.robot.motor_names if m in found] if other <= len(found) < len(v.joints) else []


def _other_joints(v: View) -> tuple[str, ...]:
    """What the columns of a table call the joints, where the robot calls them otherwise and there are as many of one quantity, or
    some more: a tool's place beside those of the joints."""
    for more in range(MORE + 1):
        for table in v.timed.tables:
            there = [a for a in series_of(table, filled=True) if a != v.times[table.name].column]
            names, columns = other_names(there, len(v.joints) + more)
            own = frozenset(w for name in names for w in tokens(name))
            same = {*names} == {"_".join(tokens(j)) for j in v.robot.motor_names}
            if names and not same and any(read_name(c[0], own).kind == POSITION for c in columns):
                return names
    return ()


def _of_joints(v: View) -> str:
    """The units that the joints of the robot can have."""
    slides = [j.kind == "slide" for j in v.joints]
    return "rad, deg, m or mm" if any(slides) and not all(slides) else "m or mm" if any(slides) else "rad or deg"


def add_positions(v: View) -> None:
    """The position sensors, with a question where their unit is open."""
    block = v.position.block
    names = v.sensor_names("position")
    if v.units.sure == UNKNOWN:
        units = "deg or task.unit=percent" if block.table.header.get("format") == "lerobot" else _of_joints(v)
        # No unit is right for counts: how many make a turn has to be said.
        cure = " into the mapping, with what one count is" if counts(block) else f"; say task.unit={units}"
        v.out.ask(f"positions ({block.name}): {v.units.why}{cure}")
    v.add("sensors", names, block, v.units, v.position.why)
