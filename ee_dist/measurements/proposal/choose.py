"""The proposal itself, step by step: time, positions, speeds, torques, commands, the rest."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from ee_dist.basics.names import listed
from ee_dist.measurements.errors import MeasurementError, SeveralColumnsError, nearest
from ee_dist.measurements.proposal.asked_for import plans_of
from ee_dist.measurements.proposal.blocks import unreadable
from ee_dist.measurements.proposal.commands import add_commands
from ee_dist.measurements.proposal.model import FIT, LIKELY, UNKNOWN, Choice, Hints, Proposal
from ee_dist.measurements.proposal.orders import told_by_data
from ee_dist.measurements.proposal.positions import add_positions, ask_for_positions, ranked_positions
from ee_dist.measurements.proposal.rate import rate_by_speeds
from ee_dist.measurements.proposal.rest import add_rest, add_switches
from ee_dist.measurements.proposal.speeds import add_speeds
from ee_dist.measurements.proposal.time import once_each_moment, time_flaw, time_of
from ee_dist.measurements.proposal.torques import add_torques
from ee_dist.measurements.proposal.units import position_units
from ee_dist.measurements.proposal.view import View
from ee_dist.measurements.proposal.words import CURRENT
from ee_dist.measurements.robot_channels import command_units
from ee_dist.measurements.table import DROP, Recorded
from ee_dist.robots.model import Robot


def propose(recorded: Recorded, robot: Robot, hints: Hints) -> Proposal:
    """A mapping for a trial and a robot. Raises MeasurementError for hints that are not the robot's."""
    _check_hints(robot, hints)
    if not hints.rate_hz:
        recorded = replace(recorded, tables=tuple(once_each_moment(t) for t in recorded.tables))
    v = View(recorded, robot, hints)
    flaws = _add_times(v)
    if not v.timed.tables:
        return _without_time(v, flaws)
    flaws += [error for t in v.timed.tables for error in unreadable(t, v.robot.motor_names)]
    v.blocks = v.gathered()
    position = v.pick(ranked_positions(v))
    if position is None:
        _time_choice(v, v.timed.tables[0].name)
        ask_for_positions(v)
        v.out.choices += [
            Choice("commands", m, {"column": "???"}, UNKNOWN, "not looked for yet") for m in command_units(robot)
        ]
        _tell_flaws(v, flaws)
        return v.out
    v.position = position
    if (found := told_by_data(v)) is not None:
        return propose(recorded, robot, found)
    if v.hints.told is not None:
        v.out.questions += [v.hints.told.question] * bool(v.hints.told.question)
        v.out.notes += [v.hints.told.note] * bool(v.hints.told.note)
    v.position.block.used = True
    _time_choice(v, v.position.block.table.name)
    v.units = position_units(v.position.block, v.joints, v.hints)
    add_positions(v)
    v.plans = plans_of(v)
    add_speeds(v)
    add_torques(v)
    add_commands(v)
    _tell_of_gains(v)
    add_rest(v)
    add_switches(v)
    _ask_the_rest(v)
    _tell_flaws(v, flaws)
    return v.out


def _tell_of_gains(v: View) -> None:
    """Why gains that were said were applied to nothing, unless a question on currents says it."""
    if v.hints.gains is None or v.gained:
        return
    if not v.units.entries:
        v.out.notes.append(
            "task.gains: not applied yet, for what the motion needs is not known before the unit of the positions is"
        )
        return
    torques = {str((c.entry or {}).get("column")) for c in v.out.choices if c.group == "torques"}
    taken = next((b for b in v.blocks if torques & {*b.columns}), None)
    if taken is not None and taken.reading.kind == CURRENT:
        return
    currents = [
        b.name for b in v.blocks if b.reading.kind == CURRENT and not b.reading.weak and v.moves(b) and not b.used
    ]
    why = "no columns can be told to be the motors' currents; write them into the mapping as torques"
    if taken is not None and currents:
        why = f"{taken.name} are torques themselves; to have {listed(currents)} instead, write them into the mapping as torques"
    v.out.notes.append(f"task.gains: applied to nothing, as {why}, with the gain as their scale")


def _without_time(v: View, flaws: list[MeasurementError]) -> Proposal:
    """All that can be found if rows come as often as speeds say, which is asked; else what is to be written."""
    rate = None if flaws else rate_by_speeds(v.recorded, v.robot, v.hints)
    if rate is None:
        cure = f"mend it or {DROP}, or say task.rate_hz=ROWS_A_SECOND"
        v.out.ask(f"{flaws[0]}; {cure}" if flaws else "no column rises like a time; say task.rate_hz=ROWS_A_SECOND")
        why = "not looked for without a time"
        v.out.choices.append(Choice("time", "", {"rate_hz": "???"}, UNKNOWN, "no column rises like a time"))
        v.out.choices += [Choice("sensors", s.name, {"column": "???"}, UNKNOWN, why) for s in v.robot.sensors]
        v.out.choices += [Choice("commands", m, {"column": "???"}, UNKNOWN, why) for m in command_units(v.robot)]
        return v.out
    hz, why = rate
    out = propose(v.recorded, v.robot, replace(v.hints, rate_hz=hz))
    out.choices = [replace(c, sure=LIKELY, why=f"no column; {why}") if c.group == "time" else c for c in out.choices]
    out.questions.insert(
        0, f"no column rises like a time; {why} if there are {hz:g} rows a second: say task.rate_hz={hz:g}"
    )
    return out


def _add_times(v: View) -> list[MeasurementError]:
    """Fills the times; what is wrong with those that could not be read."""
    flaws: list[MeasurementError] = []
    for table in v.recorded.tables:
        found = time_of(table, v.hints)
        if found is not None:
            v.times[table.name] = found
        elif flaw := time_flaw(table):
            flaws.append(flaw)
    return flaws


def _tell_flaws(v: View, flaws: list[MeasurementError]) -> None:
    """What could not be read comes first where something is open, as it may be why; else it is a note."""
    if v.out.questions:
        v.out.questions[:0] = [
            f"{flaw}" if isinstance(flaw, SeveralColumnsError) or DROP in str(flaw) else f"{flaw}; mend it or {DROP}"
            for flaw in flaws
        ]
    else:
        v.out.notes += [f"not read: {flaw}" for flaw in flaws]


def _ask_the_rest(v: View) -> None:
    """Nothing unknown goes without a question."""
    unknown = [c for c in v.out.choices if c.sure == UNKNOWN]
    if unknown and not v.out.questions:
        c = unknown[0]
        v.out.ask(f"{c.name} ({c.column}): {c.why.split('; ')[-1]}; write the unit into the mapping")


def _time_choice(v: View, table: str) -> None:
    t = v.times[table]
    if t.column is not None:
        entry: dict[str, Any] | None = {"column": t.column, "unit": t.unit}
    else:
        entry = {"rate_hz": v.hints.rate_hz} if v.hints.rate_hz else None
    v.out.choices.append(Choice("time", "", entry, t.sure, t.why))
    if t.sure == UNKNOWN:
        v.out.ask(f"time: {t.why}; write the column and its unit into the mapping")


def _check_hints(robot: Robot, hints: Hints) -> None:
    if hints.joints is not None:
        for j in hints.joints:
            if j not in robot.motor_names and j not in ("-", "_"):
                raise MeasurementError(
                    f"task.joints: {robot.name} has no driven joint {j!r}; {nearest(j, robot.motor_names)}"
                )
        missing = [m for m in robot.motor_names if m not in hints.joints]
        twice = [j for j in robot.motor_names if hints.joints.count(j) > 1]
        if missing or twice:
            which = (missing or twice)[0]
            raise MeasurementError(
                f"task.joints: {which} is missing or named twice; expected all of {', '.join(robot.motor_names)}"
            )
    if hints.gains is not None and hints.gains != FIT and len(hints.gains) != len(hints.joints or robot.motor_names):
        wanted = len(hints.joints or robot.motor_names)
        raise MeasurementError(
            f"task.gains: {len(hints.gains)} gains for {wanted} joints; expected one each, in N.m per A"
        )
