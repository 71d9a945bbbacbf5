"""Logs in which one joint each was moved and read: whose they are, whether they are one recording, and how all of them are looked
at together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ee_dist.basics.names import listed
from ee_dist.measurements.errors import MeasurementError
from ee_dist.measurements.one_joint_each import called_after, label_of
from ee_dist.measurements.proposal.blocks import in_full, joint_in, joint_words
from ee_dist.measurements.proposal.layouts import files_of_joints
from ee_dist.measurements.proposal.model import Hints
from ee_dist.measurements.proposal.time import time_of
from ee_dist.measurements.proposal.words import POSITION, read_name
from ee_dist.measurements.readers import read
from ee_dist.measurements.side_by_side import one_recording, side_by_side
from ee_dist.measurements.table import Table
from ee_dist.trials.log import Array

TOGETHER, APART = "side_by_side", "one_joint_each"
"""The keys of a mapping for files that are one recording, and for those that are recordings of their own."""


@dataclass(frozen=True)
class OneByOne:
    """``table`` is what a proposal looks at, ``key`` says in a mapping what the files are, ``shapes`` how those of each joint are
    called; ``first`` is the number in the first row of each column that other trials do not have; ``others`` lie beside them."""

    key: str
    shapes: Mapping[str, str]
    table: Table
    notes: tuple[str, ...]
    first: Mapping[str, float]
    others: tuple[Path, ...] = ()


def one_by_one(files: Sequence[Path], joints: Sequence[str], hints: Hints) -> OneByOne | None:
    """What files are whose columns name no joint, each of one joint by its name; None for others. Raises MeasurementError."""
    if len(joints) < 2:
        return None
    whole = files_of_joints(files, joints)
    layout, tables = whole or (None, {})
    shapes = dict(layout.patterns) if layout else _named_after_joints(files, joints)
    if not shapes or (layout is None and not all(_of_one(f, joints) for f in files)):
        return None
    others = layout.others if layout else ()
    tables = tables or {label: _table(next(f for f in files if label_of(f, shapes) == label)) for label in shapes}
    every = len(tables) == len(joints) and (layout is not None or len(files) == len(joints))
    together = one_recording(tables) if every else False
    if together is not False:
        return OneByOne(TOGETHER, shapes, side_by_side(tables), (_as_one(together, len(tables)),), {}, others)
    times = [time_of(t, hints) for t in tables.values()]
    columns = {None if t is None else t.column for t in times}
    if len(columns) > 1:
        which = listed(f.name for f in files)
        raise MeasurementError(f"{files[0].parent}: the times of {which} are called otherwise in each; call them alike")
    time = columns.pop()
    table, first = behind_one_another([called_after(t, label, time) for label, t in tables.items()], time)
    return OneByOne(APART, shapes, table, _as_several(len(files) - len(others), every), first, others)


def behind_one_another(tables: Sequence[Table], time: str | None) -> tuple[Table, dict[str, float]]:
    """The rows of several trials as those of one table, so that what each joint does is seen; a column stands still, at its first
    number, where a trial has none of it. And these first numbers, of columns that are not in all trials."""
    read = [_numbers(t) for t in tables]
    names = list(dict.fromkeys(name for own in read for name in own if name != time))
    first = {name: float(next(own[name][np.isfinite(own[name])][0] for own in read if name in own)) for name in names}
    columns: dict[str, Any] = {}
    if time is not None:
        columns[time] = _going_on([own[time] for own in read])
    for name in names:
        columns[name] = np.concatenate(
            [own.get(name, np.full(len(t), first[name])) for own, t in zip(read, tables, strict=True)]
        )
    units = {name: unit for t in tables for name, unit in t.units.items()}
    table = Table(tables[0].path, columns, header=dict(tables[0].header), units=units, rate_hz=tables[0].rate_hz)
    return table, {name: at for name, at in first.items() if not all(name in own for own in read)}


def _numbers(table: Table) -> dict[str, Array]:
    """The columns in which there are numbers, by address."""
    found = {}
    for address in table.addresses():
        try:
            values = table.numbers(address, gaps=True)
        except MeasurementError:
            continue
        if np.isfinite(values).any():
            found[address] = values
    return found


def _going_on(times: Sequence[Array]) -> Array:
    """(T,) times that begin a step behind where those before end."""
    found = [times[0]]
    for own in times[1:]:
        step = float(np.median(np.diff(own))) if len(own) > 1 else 1.0
        found.append(own - own[0] + found[-1][-1] + step)
    return np.concatenate(found)


def _named_after_joints(files: Sequence[Path], joints: Sequence[str]) -> dict[str, str]:
    """What the files of each joint are called, in the order of the joints; empty where a name holds no joint's."""
    own: dict[str, list[Path]] = {}
    for file in files:
        joint = in_full(file.stem, joints)
        if joint is None:
            return {}
        own.setdefault(joint, []).append(file)
    # A pattern for several files has the name as the robot has it.
    if any(len(several) > 1 and not all(j.lower() in f.stem.lower() for f in several) for j, several in own.items()):
        return {}
    return {j: own[j][0].name if len(own[j]) == 1 else f"*{j}*" for j in joints if j in own}


def _table(file: Path) -> Table:
    return read(file)[0].tables[0]


def _of_one(file: Path, joints: Sequence[str]) -> bool:
    """Whether a file holds one column of positions that were read, and columns that name another joint than its own nowhere."""
    trials = read(file)
    if len(trials) != 1 or len(trials[0].tables) != 1:
        return False
    joint, words = in_full(file.stem, joints), joint_words(joints)
    columns = list(trials[0].tables[0].addresses())
    said = [read_name(c, words[joint] if joint else frozenset()) for c in columns]
    positions = sum(r.kind == POSITION and not r.command and not r.second for r in said)
    return positions == 1 and all(joint_in(c, words) in (None, joint) for c in columns)


def _as_one(sure: bool | None, count: int) -> str:
    why = "their rows have the same times" if sure else "they have as many rows and no times, so that nothing tells"
    return (
        f"the {count} files of one joint each are taken as one recording in which all joints go at once: {why}; where they were "
        f"recorded one after another, write '{APART}' for '{TOGETHER}' in the mapping, and behind each column 'held: PLACE', "
        "where its joint stood while others were recorded"
    )


def _as_several(count: int, every: bool) -> tuple[str, ...]:
    why = "their rows do not have the same times" if every else "there is not one of each joint"
    told = (
        f"the {count} files of one joint each are taken as recordings one after another, each a trial, since {why}; were they "
        f"one recording in which all joints went at once, write '{TOGETHER}' for '{APART}' in the mapping"
    )
    return (told,) if count > 1 else ()
