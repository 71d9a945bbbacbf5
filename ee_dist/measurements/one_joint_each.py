"""Files that hold one joint each and are recordings of their own: the mapping says how they are called."""

from __future__ import annotations

import fnmatch
from collections.abc import Mapping as Dictionary
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from ee_dist.basics.names import listed
from ee_dist.measurements.errors import MeasurementError
from ee_dist.measurements.mapping import Column, Mapping
from ee_dist.measurements.table import Recorded, Table


def label_of(file: Path, shapes: Dictionary[str, str]) -> str | None:
    """What goes before the names of a file's columns, by the longest of the names that its own is like."""
    for label, shape in sorted(shapes.items(), key=lambda item: -len(item[1])):
        own = "/".join(file.absolute().parts[-1 - shape.count("/") :])
        # A name may have signs in it that a pattern has, too.
        if shape.lower() == own.lower() or fnmatch.fnmatchcase(own.lower(), shape.replace("{trial}", "*").lower()):
            return label
    return None


def of_joints(files: Sequence[Path], mapping: Mapping) -> list[Path]:
    """The files that the mapping names, without what lies beside them. Raises MeasurementError where it names none."""
    shapes = mapping.one_joint_each
    found = [f for f in files if label_of(f, shapes) is not None]
    if not found:
        raise MeasurementError(
            f"{mapping.source}: one_joint_each: none of the {len(files)} files is named like {listed(shapes.values())}"
        )
    return found


def labelled(recorded: Recorded, file: Path, mapping: Mapping) -> Recorded:
    """A trial of such a file, in which ``pos`` is called ``L.pos``."""
    label = label_of(file, mapping.one_joint_each)
    assert label is not None
    time = mapping.time.column if isinstance(mapping.time, Column) else None
    return replace(recorded, tables=tuple(called_after(t, label, time) for t in recorded.tables))


def called_after(table: Table, label: str, time: str | None) -> Table:
    """The table with ``L.pos`` for ``pos``; its ``time`` is called alike in all files."""

    def called(column: str) -> str:
        return column if column == time else f"{label}.{column}"

    return replace(
        table,
        columns={called(c): cells for c, cells in table.columns.items()},
        units={called(c): unit for c, unit in table.units.items()},
        parts={called(c): names for c, names in table.parts.items()},
        twice=frozenset(map(called, table.twice)),
        clock=table.clock and called(table.clock),
    )
