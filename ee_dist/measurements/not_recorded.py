"""Joints that were not recorded in a trial, while others were: they stand still where the mapping says that they stood."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ee_dist.basics.names import listed
from ee_dist.basics.quoted import quoted
from ee_dist.measurements.errors import MeasurementError
from ee_dist.measurements.mapping import Column, Mapping
from ee_dist.measurements.table import Recorded, Table
from ee_dist.robots.model import Robot

COMPARED = "nothing of it is compared there"
"""What a channel that nobody recorded in a trial is in a comparison, as whoever reads its errors is told."""


@dataclass(frozen=True)
class Stood:
    """The joints whose positions were not recorded in a trial, all sensors that were not, and a line on them for its report."""

    joints: frozenset[str] = frozenset()
    sensors: tuple[str, ...] = ()
    line: str = ""


def recorded_in(table: Table, column: str) -> bool:
    """Whether a table has a column with something in it."""
    if column not in table:
        return False
    try:
        return bool(np.isfinite(table.numbers(column, gaps=True)).any())
    except MeasurementError:  # a text, or what is to be told where it is read
        return True


def with_those_that_stood(trials: Sequence[Recorded], mapping: Mapping, robot: Robot) -> list[tuple[Recorded, Stood]]:
    """Every trial with a column for each channel that it has none of, or an empty one, and whose place the mapping states. Raises
    MeasurementError for a column that is in no trial: its name is wrong."""
    where = str(mapping.source)
    held = [(group, name, c) for group, name, c in mapping.columns() if c.held is not None]
    absent = {
        (k, c.table, c.column)
        for k, trial in enumerate(trials)
        for _, _, c in held
        if not recorded_in(trial.table(c.table, where), c.column)
    }
    for group, name, c in held:
        if trials and all((k, c.table, c.column) in absent for k in range(len(trials))):
            raise MeasurementError(
                f"{where}: {group}: {name}: column {quoted(c.column)} is in no trial, or empty in all: 'held' says where a joint "
                "stood in trials that do not have it; write one that never moved as 'fixed_joints' into the robot's description"
            )
    found = []
    for k, trial in enumerate(trials):
        own = [(group, name, c) for group, name, c in held if (k, c.table, c.column) in absent]
        if own and _read(mapping) <= {name for group, name, _ in own if group == "sensors"}:
            raise MeasurementError(
                f"{where}: sensors: none of their columns is in trial {quoted(trial.name)}, or all are empty: leave its file out"
            )
        found.append((_filled(trial, [c for _, _, c in own]), _stood(own, robot)))
    return found


def _read(mapping: Mapping) -> set[str]:
    """The sensors that are read from columns."""
    return {name for name, c in mapping.sensors.items() if isinstance(c, Column)}


def _filled(trial: Recorded, columns: Sequence[Column]) -> Recorded:
    tables = []
    for k, table in enumerate(trial.tables):
        own = [c for c in columns if c.table == table.name or (not c.table and k == 0)]
        still = {c.column: np.full(len(table), _number_for(c)) for c in own}
        tables.append(replace(table, columns=table.columns | still) if still else table)
    return replace(trial, tables=tuple(tables))


def _number_for(column: Column) -> float:
    """What stands in a cell of a column whose value is the held one."""
    assert column.held is not None
    return (column.held - column.offset) / (column.sign * column.scale)


def _stood(channels: Sequence[tuple[str, str, Column]], robot: Robot) -> Stood:
    """The joints that do not move because nobody recorded them, each with its place."""
    if not channels:
        return Stood()
    sensors = {s.name: s for s in robot.sensors}
    places: dict[str, str] = {}
    for group, name, c in channels:
        if group == "sensors" and name in sensors and sensors[name].kind == "position":
            places[sensors[name].target] = f"{c.held:.4g} {c.unit}"
    others = [f"{group} {name}".strip() for group, name, _ in channels if _joint(group, name, robot) not in places]
    told = [f"{joint} at {place}" for joint, place in places.items()]
    line = f"not recorded in this trial, and taken to stand still: {listed([*told, *others])}; {COMPARED}"
    return Stood(frozenset(places), tuple(name for group, name, _ in channels if group == "sensors"), line)


def _joint(group: str, name: str, robot: Robot) -> str:
    return next((s.target for s in robot.sensors if s.name == name), "") if group == "sensors" else name
