"""Which block is the commands, of the kind that the drives obey."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ee_dist.basics.names import listed
from ee_dist.measurements import signals
from ee_dist.measurements.proposal.blocks import Block
from ee_dist.measurements.proposal.model import LIKELY, SURE, UNKNOWN, Choice
from ee_dist.measurements.proposal.speeds import speed_units
from ee_dist.measurements.proposal.still_commands import allowed_units, held, standing_still, stated_unit
from ee_dist.measurements.proposal.torque_scale import torque_units
from ee_dist.measurements.proposal.units import LOOSE, UnitChoice, by_ratio
from ee_dist.measurements.proposal.view import Scored, View
from ee_dist.measurements.proposal.words import CURRENT, DUTIES, POSITION, SPEED, TORQUE, VOLTAGES, read_name, tokens
from ee_dist.measurements.robot_channels import command_kinds
from ee_dist.measurements.units import UNITS
from ee_dist.trials.log import Array

CLOSE = 0.9
"""Correlation below which commands are likely at best, whatever they are called."""
AGAINST = (
    "the positions of {joints} run against these, and yet lie where they ask and not where their negatives would: they are late "
    "or early (half a period of a motion that repeats), or other joints' columns"
)
EXCHANGED = (
    "the positions of {joints} are exchanged, or these: the first run against what they are asked for, and lie where those of "
    "the other are asked to"
)
THERE = 0.1
"""Of the distance to its own command with its sign turned, that to another's at which a joint does what that one is told."""
OWN_COURSE = (
    "a course that the drives make of their goals? Taken as the commands it leaves out how they make it, and tells of the "
    "controllers alone"
)
NEARER = 0.5
"""Share of the lag behind the commands within which positions follow something else far more closely."""
WHAT = {"position": POSITION, "speed": SPEED}
"""What is asked of a drive by what it obeys."""
UNLESS = "put that right, or write unit and sign into the mapping if they are what was asked for"
MEND = "write the unit into the mapping, or take these commands out of it"
LAST = frozenset(["clipped", "saturated", "limited", "clamped"])
"""What became of a command on its way: of several that is what the drive obeyed."""


def add_commands(v: View) -> None:
    """The commands, or a question; none at all where torques were found, which a balance of forces does without."""
    kinds = command_kinds(v.robot)
    if not kinds:
        return
    if len(kinds) > 1:
        v.out.ask("commands: joints differ in what they obey (position, speed, torque); write them into the mapping")
        return
    kind, v = kinds.pop(), v.driven()
    score: Callable[[View, Block], Scored | None] = {
        "position": _as_position_command, "speed": _as_speed_command, "torque": _as_torque_command
    }[kind]  # fmt: skip
    # What neither is called a command nor goes with the motion is no rival.
    found = [s for b in v.blocks if not b.used and (s := score(v, b)) is not None and s.score >= 2]
    chosen = v.pick(sorted(found, key=lambda s: -s.score), 3.0)
    if kind != "torque":
        _ask_of_the_late(v, chosen, kind)
    names = list(v.robot.motor_names)
    if chosen is None:
        if any(c.group == "torques" for c in v.out.choices) and not found:
            v.out.notes.append(
                f"no commands were found: the measured torques are taken as what was asked for{_voltages(v, kind)}"
                if kind == "torque"
                else f"no commands were found: a balance of forces is the way to compare{_of_fewer(v)}"
            )
            return
        rivals = " or ".join(s.block.name for s in sorted(found, key=lambda s: -s.score)[:3])
        mute = [
            b.name
            for b in v.blocks
            if not b.used and b is not v.position.block and v.moves(b)
            if (b.reading.kind is None or b.reading.weak) and b.reading.command is not False
        ]
        asked = f": is it {' or '.join(mute[:3])}?" if mute else ";"
        told = (
            f"commands: {rivals}?" if rivals else f"commands: no columns look like {kind}s that were asked for{asked}"
        )
        v.out.ask(f"{told} write the right ones into the mapping{_voltages(v, kind) or _goals(v, kind)}")
        for n in names:
            v.out.choices.append(Choice("commands", n, {"column": "???"}, UNKNOWN, "not found"))
        return
    chosen.block.used = True
    if kind == "position":
        _tell_nearer(v, chosen.block)
    if kind == "torque":
        units = torque_units(v, chosen.block)
    else:
        units = _position_command_units(v, chosen.block) if kind == "position" else speed_units(v, chosen.block)
    if units.sure == UNKNOWN:
        v.out.ask(
            f"commands ({chosen.block.name}): {units.why}; {UNLESS if units.why.startswith('the positions of') else MEND}"
        )
    certain = chosen.block.reading.command and (kind == "torque" or _goes_with_the_motion(v, chosen.block, kind))
    level = SURE if certain else LIKELY
    v.add("commands", names, chosen.block, units, chosen.why, level)


def _of_fewer(v: View) -> str:
    """What to do with columns that are called commands, and are those of fewer joints than the robot has drives."""
    asked = {a for t in v.timed.tables for a in t.addresses() if read_name(a).command}
    taken = {c for b in v.blocks if b.used for c in b.columns}
    if not (asked := asked - taken):
        return ""
    return (
        f"; {listed(sorted(asked))}: called commands, and not one for each drive: fix joints that were told nothing and stood "
        "still ('fixed_joints' of the robot), and log which joint a command is of"
    )


def _voltages(v: View, kind: str) -> str:
    """What to do where drives obey torques, and voltages or duty cycles were asked for."""
    names = [a for t in v.timed.tables for a in t.addresses()] if kind == "torque" else []
    asked = [a for a in names if read_name(a).command and VOLTAGES & set(tokens(a))]
    # A voltage may be measured; a duty cycle is nothing but told.
    if not (asked := asked or [a for a in names if DUTIES & set(tokens(a))]):
        return ""
    what = "is a voltage or duty cycle" if len(asked) == 1 else "are voltages or duty cycles"
    return (
        f"; but {listed(asked)} {what} that a motor was led by: name it as the command, with 'scale:' the torque at rest (behind "
        "the gear) of one of its units, and give the drive the 'viscous:' of its back-EMF"
    )


def _goals(v: View, kind: str) -> str:
    """What to do where drives are described to obey something else, and columns are there that positions follow."""
    for b in v.blocks if kind != "position" else ():
        if b.used or b.reading.command is False or b.reading.kind not in (POSITION, None) or not v.moves(b):
            continue
        ahead = _lead(v, b, "position")
        if ahead.correlation >= CLOSE and ahead.lead_s > 0 and not np.array_equal(b.values, v.position.block.values):
            return (
                f"; but {_why(ahead, f'the positions follow {b.name} by')}, as they do where drives obey positions: then the "
                "robot's description has 'command: position' with kp and kd"
            )
    return ""


def _tell_nearer(v: View, chosen: Block) -> None:
    """A note on what positions follow far more closely than the commands, as they do a course that drives make of their goals."""
    mine = _lead(v, chosen, "position")
    for b in v.blocks:
        if b.used or not b.reading.command or b.reading.kind not in (POSITION, None) or not v.moves(b):
            continue
        ahead = _lead(v, b, "position")
        if ahead.correlation < max(CLOSE, mine.correlation) or not 0 <= ahead.lead_s <= NEARER * mine.lead_s:
            continue
        how = f"{_why(ahead, f'the positions follow {b.name} by')}, and {chosen.name} by {1e3 * mine.lead_s:.0f} ms"
        v.out.notes.append(f"{how}: {OWN_COURSE}")


def _lead(v: View, b: Block, kind: str) -> signals.Lead:
    """How commands run ahead of what they ask for: positions, or the change of these."""
    if kind == "position":
        return v.lead(b, v.position.block)
    values, step = v.on(v.position.block, b), v.step(v.position.block)
    if values is None:
        return signals.Lead(0.0, 0.0, 0.0)
    return signals.lead(values, signals.change(v.position.block.values, step), step)


def _goes_with_the_motion(v: View, b: Block, kind: str) -> bool:
    """Whether the motion confirms commands: it follows them closely, at one lag alone."""
    ahead = _lead(v, b, kind)
    return abs(ahead.correlation) >= CLOSE and not ahead.repeats


def _why(ahead: signals.Lead, what: str) -> str:
    again = "; the motion repeats itself, so that another lag fits as well" if ahead.repeats else ""
    return f"{what} {1e3 * abs(ahead.lead_s):.0f} ms (correlation {ahead.correlation:.3f}){again}"


def _as_position_command(v: View, b: Block) -> Scored | None:
    r = b.reading
    if r.command is False or not (r.kind in (POSITION, None) or r.weak) or not v.moves(b):
        return None
    if np.array_equal(b.values, v.position.block.values):
        return None
    ahead = _lead(v, b, "position")
    step, fit = v.step(v.position.block), abs(ahead.correlation)
    score = (3.0 if r.command else 0.0) + (r.kind == POSITION and not r.weak) - r.second
    score += 2 if fit > 0.9 else 1 if fit > 0.7 else -3 if fit < 0.5 else 0
    score += 1 if ahead.lead_s > 0 else 0
    why = _why(ahead, "the positions follow it by") if ahead.lead_s >= 0 else _behind(ahead)
    return Scored(b, score - 3 * _late(ahead, step), ["called a command", why] if r.command else [why])


def _late(ahead: signals.Lead, step_s: float) -> bool:
    return ahead.lead_s < -1.5 * step_s and abs(ahead.correlation) > 0.7


def _behind(ahead: signals.Lead, what: str = "positions") -> str:
    return f"it follows the {what} by {-1e3 * ahead.lead_s:.0f} ms, as no command should"


def _ask_of_the_late(v: View, chosen: Scored | None, kind: str) -> None:
    """A question on what is called a command and follows the positions, where nothing else is."""
    step = v.step(v.position.block)
    for b in v.blocks if chosen is None else [chosen.block]:
        r = b.reading
        if b.used or not r.command or not (r.kind in (WHAT[kind], None) or r.weak) or not v.moves(b):
            continue
        if _late(ahead := _lead(v, b, kind), step):
            swapped = v.position.block.name if kind == "position" else "the measured speeds"
            v.out.ask(
                f"commands ({b.name}): {_behind(ahead, f'{kind}s')}; are they swapped with {swapped}, or of another clock? write "
                "the right columns"
            )


def _position_command_units(v: View, b: Block) -> UnitChoice:
    """As the positions, unless its name or its ratio to them says otherwise."""
    if not v.units.entries:
        return UnitChoice((), UNKNOWN, "the unit of the positions is open")
    values = v.on(v.position.block, b)
    ahead = v.lead(b, v.position.block)
    entries, why, sure = [], "in the unit of the positions", v.units.sure
    turned: list[str] = []
    against: list[str] = []
    unshown: list[int] = []
    short: dict[str, float] = {}
    still = [] if values is None else standing_still(v, values)
    told_to_stay = held(v, b)
    shift = round(ahead.lead_s / v.step(v.position.block))
    for k, base in enumerate(v.units.entries):
        entry = dict(base)
        stated = stated_unit(b, k)
        x, y = values[:, [k]] if values is not None else None, v.position.block.values[:, [k]]
        if x is not None and k not in still and k not in told_to_stay and signals.moves(x) and signals.moves(y):
            r = (
                signals.relation(x[: len(x) - shift], y[shift:])
                if shift >= 0
                else signals.relation(x[-shift:], y[:shift])
            )
            if abs(r.correlation) > 0.8:
                allowed = allowed_units(v, k)
                unit = str(base["unit"])
                seen = by_ratio(r.slope, allowed, unit) if "scale" not in base else unit
                if seen is None and by_ratio(r.slope, allowed[:2], unit, LOOSE) == unit:
                    seen, short[v.joints[k].name], sure = unit, 1 / abs(r.slope), LIKELY
                if seen is None or (stated and stated != seen):
                    said = f", though its name says {stated}" if stated else ""
                    return UnitChoice((), UNKNOWN, f"{r.slope:.3g} times the positions{said}")
                if seen != unit:
                    entry, why = {"unit": seen}, f"{seen} by its ratio to the positions"
                if r.correlation < 0:
                    entry["sign"] = -1
                    size = UNITS[str(entry["unit"])][1] / UNITS[unit][1]
                    other = None if "scale" in base or values is None else _asked_of_another(size * values, y[:, 0], k)
                    if other is not None:
                        names = listed([v.joints[k].name, v.joints[other].name])
                        return UnitChoice((), UNKNOWN, EXCHANGED.format(joints=names))
                    same = "scale" not in base and _lie_where_asked(size * x[:, 0], y[:, 0])
                    (against if same else turned).append(v.joints[k].name)
            elif stated:
                entry = {"unit": stated}
            else:
                unshown.append(k)
        elif stated:
            entry = {"unit": stated}
        elif k not in still:
            unshown.append(k)
        entries.append(entry)
    if against:
        return UnitChoice((), UNKNOWN, AGAINST.format(joints=listed(against)))
    _as_the_others(v, entries, [*(k for k in still if not (b.units and b.units[k])), *unshown])
    if short:
        where = "" if len(short) == len(v.units.entries) else f" at {listed(short)}"
        share = " to ".join(dict.fromkeys(f"{s:.2g}" for s in (min(short.values()), max(short.values()))))
        why += f", which go {share} of the way{where}"
    if still:
        why += f"; {', '.join(v.joints[k].name for k in still)} does not follow, and shows no unit"
    if turned:
        why += f"; sign of {', '.join(turned)} turned: the positions run against the commands"
    if 0 < len(turned) < len(entries):
        # One encoder may be mounted the other way round, or one command be wrong: a person should look.
        sure = LIKELY
    return UnitChoice(tuple(entries), sure, why)


def _lie_where_asked(asked: Array, seen: Array) -> bool:
    """Whether positions (T,) that run against commands lie where these ask, and nowhere near where their negatives would: then no
    sign is wrong."""
    here, there = (abs(float(np.mean(sign * asked) - np.mean(seen))) for sign in (1.0, -1.0))
    return there > max(2.0 * here, float(np.ptp(seen)))


def _asked_of_another(asked: Array, seen: Array, joint: int) -> int | None:
    """The other joint, of those that are asked for (T, J), where the positions (T,) of one are, if that is far nearer than what
    the joint is asked for by itself with its sign turned."""
    off = signals.apart(asked, seen)
    off[joint] = np.inf
    other, mine = int(np.argmin(off)), float(signals.apart(-asked[:, [joint]], seen)[0])
    return other if off[other] < THERE * min(mine, float(np.ptp(seen))) else None


def _as_the_others(v: View, entries: list[dict[str, Any]], still: list[int]) -> None:
    """One family of columns has one unit: what stands still and shows none gets that of the others."""
    for k in still:
        units = {e["unit"] for i, e in enumerate(entries) if i not in still and v.joints[i].kind == v.joints[k].kind}
        if len(units) == 1 and "scale" not in entries[k]:
            entries[k]["unit"] = units.pop()


def _as_speed_command(v: View, b: Block) -> Scored | None:
    r = b.reading
    if r.command is False or not (r.kind in (SPEED, None) or r.weak) or not v.moves(b):
        return None
    if v.on(v.position.block, b) is None:
        return None
    ahead = _lead(v, b, "speed")
    fit = abs(ahead.correlation)
    score = (
        (3.0 if r.command else 0.0) + (r.kind == SPEED and not r.weak) + (2 if fit > 0.9 else 1 if fit > 0.7 else -2)
    )
    why = _why(ahead, "the speeds follow it by") if ahead.lead_s >= 0 else _behind(ahead, "speeds")
    return Scored(b, score - 3 * _late(ahead, v.step(v.position.block)), [why])


def _as_torque_command(v: View, b: Block) -> Scored | None:
    r = b.reading
    if r.kind not in (TORQUE, CURRENT) or r.command is False or r.weak:
        return None
    if r.command is None and not any(LAST & {*tokens(c)} for c in b.columns):
        # Of a force that is called neither, and is the only one, nobody says that it was measured; see the torques.
        only = r.kind == TORQUE and not r.second and v.moves(b) and not v.has("torques")
        return Scored(b, 3.0, ["the only force (torque) there is: taken as what was asked for"]) if only else None
    last = any(LAST & {*tokens(c)} for c in b.columns)
    why = ["called a commanded torque", *["called what came of it in the end"] * last]
    return Scored(b, 4.0 - 2 * r.second + (r.kind == TORQUE) + 1.5 * last, why)
