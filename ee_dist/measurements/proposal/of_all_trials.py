"""What a proposal says of all trials, though one of them was looked at: in how many a channel moves, or was recorded at all."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ee_dist.basics.names import listed
from ee_dist.measurements import signals
from ee_dist.measurements.errors import MeasurementError
from ee_dist.measurements.mapping_file import mapping_of
from ee_dist.measurements.not_recorded import COMPARED, recorded_in
from ee_dist.measurements.proposal.model import SURE, UNKNOWN, Choice, Proposal
from ee_dist.measurements.table import Recorded
from ee_dist.measurements.trials import trials_of
from ee_dist.robots.model import Robot
from ee_dist.trials.log import Array

HELD = ("sensors", "commands")
"""Channels that stand still in trials that do not have them; others a mapping may leave out."""


def tell_of_all_trials(proposal: Proposal, files: Sequence[Path], places: Mapping[str, float], robot: Robot) -> None:
    """Says of channels that stand still in the trial that was looked at in how many they move, and of those that some trials do
    not have (``places``: the number in the first row of each such column) where they are held there."""
    asked = [c for c in proposal.choices if c.still or _column(c) in places]
    if not asked:
        return
    trials = _trials(proposal, files)
    _leave_out_zeros(proposal, trials, robot)
    told = {c.name: c for c in proposal.choices if c.group == "commands" and _obeys(c.name, robot) == "position"}
    said = []
    for c in proposal.choices:
        if _column(c) in places:
            said.append(_not_everywhere(c, told.get(_position_of(c, robot)), trials, places, robot))
        else:
            said.append(_moving(c, trials) if c.still and c.entry else c)
    proposal.choices = said
    held = [c for c in proposal.choices if c.entry and "held" in c.entry and _position_of(c, robot)]
    pushed = [
        c.name for c in asked if c.group == "commands" and _column(c) in places and _obeys(c.name, robot) == "torque"
    ]
    if pushed:
        proposal.ask(
            f"commands: {listed(pushed)} obey torques, and which held them in trials that do not have them nobody knows: import "
            "the trials of each joint by themselves, with the others as 'fixed_joints' in the robot's description"
        )
    if held:
        at = listed(f"{_position_of(c, robot)} at {c.entry['held']:.4g} {c.entry['unit']}" for c in held if c.entry)
        proposal.notes.append(
            "not every trial has every joint: where one was not recorded it is taken to stand still where its own recording "
            f"begins, as far from its command as it usually is ({at}), an assumption: 'held' behind its columns says otherwise; "
            f"{COMPARED}"
        )
    left = [_column(c) for c in asked if _column(c) in places and c.group not in HELD]
    if left:
        proposal.notes.append(f"left out, since not all trials have them: {listed(left)}")


def _leave_out_zeros(proposal: Proposal, trials: Sequence[Recorded], robot: Robot) -> None:
    """Leaves out torques that are 0 in every row of all trials: a message has a place for each joint, also for those without a
    sensor. Of a drive that obeys torques it may be what was asked."""
    zeros = {
        c.name: _column(c)
        for c in proposal.choices
        if c.group == "torques" and c.still and _obeys(c.name, robot) != "torque" and _is_zero(c, trials)
    }
    if not zeros:
        return
    every = "every row" if len(trials) == 1 else f"every row of all {len(trials)} trials"
    why = f"0 in {every}, and so left out"
    proposal.choices = [
        replace(c, entry=None, sure=SURE, why=why) if c.group == "torques" and c.name in zeros else c
        for c in proposal.choices
    ]
    proposal.notes.append(f"left out, as it is 0 in {every}, and no torque was measured: {listed(zeros.values())}")


def _is_zero(choice: Choice, trials: Sequence[Recorded]) -> bool:
    """Whether a column holds numbers, and all are 0."""
    every = [values for t in trials if (values := _numbers(choice, t)) is not None and len(values)]
    return bool(every) and not any(values.any() for values in every)


def _trials(proposal: Proposal, files: Sequence[Path]) -> list[Recorded]:
    """All of them as the mapping would have them; none where they cannot be read, which is told as they are imported."""
    time = next((c.entry for c in proposal.choices if c.group == "time" and c.sure != UNKNOWN), None)
    with contextlib.suppress(MeasurementError):
        return trials_of(files, mapping_of(proposal.head | {"sensors": {}, "time": time}, Path("mapping.yaml")))
    return []


def _not_everywhere(
    choice: Choice, told: Choice | None, trials: Sequence[Recorded], places: Mapping[str, float], robot: Robot
) -> Choice:
    """A channel that some trials do not have, and where it is held there; ``told``: the command of the joint that it places."""
    if choice.group not in HELD or choice.entry is None:
        return replace(choice, entry=None, why=f"{choice.why}; not in all trials, and so left out")
    here = [t for t in trials if _numbers(choice, t) is not None]
    at = None if told is None or not here else _beside_its_command(choice, told, here[0])
    entry = choice.entry | {"held": _held(choice, places[_column(choice)], robot) if at is None else at}
    why = f"{choice.why}; recorded in {len(here)} of {len(trials)} trials, held in the others"
    return replace(choice, entry=entry, why=why)


def _beside_its_command(choice: Choice, told: Choice, trial: Recorded) -> float | None:
    """Where a joint was told to be at first, and as far from that as it was in the middle of its readings: one reading is off by
    what friction and teeth held it back."""
    seen, asked = _numbers(choice, trial), _numbers(told, trial)
    if seen is None or asked is None or len(seen) != len(asked) or not _same_unit(choice, told):
        return None
    seen, asked = _valued(choice, seen), _valued(told, asked)
    return float(f"{asked[0] + np.median(seen - asked):.6g}")


def _same_unit(one: Choice, other: Choice) -> bool:
    return (one.entry or {}).get("unit") == (other.entry or {}).get("unit")


def _moving(choice: Choice, trials: Sequence[Recorded]) -> Choice:
    """A channel that stands still in the trial that was looked at."""
    if len(trials) < 2:
        return replace(choice, why=f"{choice.why}; does not move in this file")
    moves = sum(signals.moves(values) for t in trials if (values := _numbers(choice, t)) is not None)
    return replace(choice, why=f"{choice.why}; moves in {moves or 'none'} of {len(trials)} trials")


def _column(choice: Choice) -> str:
    """The column of a channel; empty where it has none."""
    return str((choice.entry or {}).get("column", ""))


def _numbers(choice: Choice, trial: Recorded) -> Array | None:
    """What a trial has of a channel; None where that is nothing."""
    entry: dict[str, Any] = choice.entry or {}
    try:
        table = trial.table(str(entry.get("table", "")), "")
        if not recorded_in(table, str(entry["column"])):
            return None
        values = table.numbers(str(entry["column"]), gaps=True)
    except (KeyError, MeasurementError):
        return None
    return values[np.isfinite(values)]


def _held(choice: Choice, number: float, robot: Robot) -> float:
    """Where a channel stands, in the unit of its column: what stands still has no speed."""
    measured = choice.group == "sensors" and any(s.name == choice.name and s.kind == "velocity" for s in robot.sensors)
    if measured or (choice.group == "commands" and _obeys(choice.name, robot) == "speed"):
        return 0.0
    return float(f"{_valued(choice, np.array(number)):.6g}")


def _valued(choice: Choice, numbers: Array) -> Array:
    """The numbers of a column in its unit."""
    entry: dict[str, Any] = choice.entry or {}
    return np.asarray(entry.get("sign", 1.0) * entry.get("scale", 1.0) * numbers + entry.get("offset", 0.0))


def _obeys(joint: str, robot: Robot) -> str:
    return next((d.command for d in robot.drives if d.joint == joint), "")


def _position_of(choice: Choice, robot: Robot) -> str:
    """The joint whose position a channel is; empty for others."""
    own = (s.target for s in robot.sensors if s.name == choice.name and s.kind == "position")
    return next(own, "") if choice.group == "sensors" else ""
