"""Files into trials: one file is one or several, several files may be one, and rows are shared out where one file holds all."""

from __future__ import annotations

import re
from collections.abc import Mapping as Dictionary
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ee_dist.basics.quoted import quoted
from ee_dist.measurements.errors import MeasurementError
from ee_dist.measurements.folders import own_names
from ee_dist.measurements.mapping import Mapping
from ee_dist.measurements.one_joint_each import labelled, of_joints
from ee_dist.measurements.readers import read
from ee_dist.measurements.side_by_side import side_by_side
from ee_dist.measurements.table import Recorded, Table

FEWEST_ROWS = 2
MOST_TRIALS = 2000


def trials_of(files: Sequence[Path], mapping: Mapping) -> list[Recorded]:
    """All trials of the files, each with a name of its own. Raises MeasurementError."""
    if mapping.side_by_side:
        found = []
        for r in _joined(files, mapping, mapping.side_by_side):
            table = side_by_side({t.name: t for t in r.tables})
            found += _split(Recorded(r.name, (table,)), mapping)
    elif any(c.file for c in mapping.tables.values()):
        found = _joined(files, mapping, {name: c.file for name, c in mapping.tables.items()})
    else:
        found = []
        files = of_joints(files, mapping) if mapping.one_joint_each else files
        names = own_names(files)
        for file in files:
            several = read(file, mapping.reading)
            for r in [labelled(r, file, mapping) for r in several] if mapping.one_joint_each else several:
                found += _split(_named(r, names[file], len(files) > 1 and bool(r.name)), mapping)
    if len(found) > MOST_TRIALS:
        raise MeasurementError(f"{files[0]}: {len(found)} trials; at most {MOST_TRIALS} at once: name fewer files")
    return found


def _named(recorded: Recorded, own: str, both: bool) -> Recorded:
    return replace(recorded, name=f"{own} {recorded.name}" if both else recorded.name or own)


def _split(recorded: Recorded, mapping: Mapping) -> list[Recorded]:
    if mapping.split is None:
        return [recorded]
    if len(recorded.tables) > 1:
        raise MeasurementError(
            f"{mapping.source}: split: {recorded.tables[0].path} has several tables; split needs one"
        )
    table = recorded.tables[0]
    if mapping.split.restarts:
        from ee_dist.measurements.clocks import times_of

        times = times_of(table, mapping.time, str(mapping.source))[0]
        first = np.flatnonzero(np.r_[True, np.diff(times) < 0])
        labels = [str(k + 1) for k in range(len(first))]
    else:
        cells = table.texts(mapping.split.column)
        first = np.array([i for i, c in enumerate(cells) if i == 0 or c != cells[i - 1]])
        labels = [_short(cells[i]) for i in first]
        if len(set(labels)) < len(labels):
            again = next(v for k, v in enumerate(labels) if v in labels[:k])
            raise MeasurementError(
                f"{table}: column {quoted(mapping.split.column)} comes back to {quoted(again)}; "
                "the rows of a trial must stand together"
            )
    if len(first) > len(table) / FEWEST_ROWS:
        raise MeasurementError(
            f"{mapping.source}: split: makes {len(first)} trials of {len(table)} rows; expected a column that stays the "
            "same all through a trial"
        )
    ends = [*first[1:], len(table)]
    return [
        Recorded(f"{recorded.name} {label}", (table.part(slice(int(a), int(b))),))
        for a, b, label in zip(first, ends, labels, strict=True)
    ]


def _short(cell: str) -> str:
    """3.0 is trial 3."""
    try:
        return f"{float(cell):g}"
    except ValueError:
        return cell


def _joined(files: Sequence[Path], mapping: Mapping, shapes: Dictionary[str, str]) -> list[Recorded]:
    """Trials whose tables are files of their own, matched by what stands at {trial} in their names."""
    parts: dict[Path, tuple[str, str]] = {}
    for file in files:
        # That which says the most comes first: q_{trial}.csv is also like q_dot_run1.csv.
        for name, shape in sorted(shapes.items(), key=lambda item: -len(item[1])):
            # As many folders as the pattern names count.
            own = "/".join(file.absolute().parts[-1 - shape.count("/") :])
            found = _pattern(shape).fullmatch(own)
            if found:
                parts[file] = (found.groupdict().get("trial", ""), name)
                break
    if not parts:
        which = "side_by_side" if mapping.side_by_side else "tables"
        raise MeasurementError(
            f"{mapping.source}: {which}: none of the {len(files)} files is named like {', '.join(shapes.values())}"
        )
    # Where the names alone do not tell trials apart, each folder is one.
    apart = len(set(parts.values())) < len(parts)
    tables: dict[tuple[Path | None, str], dict[str, Table]] = {}
    for file, (trial, name) in parts.items():
        several = read(file, mapping.reading)
        if len(several) > 1 or len(several[0].tables) > 1:
            raise MeasurementError(f"{file}: holds several tables or trials; expected one for {quoted(name)}")
        key = (file.parent if apart else None, trial)
        tables.setdefault(key, {})[name] = replace(several[0].tables[0], name=name)
    folders = own_names([f for f, _ in tables if f is not None])
    out = []
    for (folder, trial), halves in tables.items():
        for name, shape in shapes.items():
            if name not in halves:
                there = next(iter(halves.values())).path
                raise MeasurementError(
                    f"{there}: its other half is missing: no {shape.replace('{trial}', trial)} beside it "
                    f"for {quoted(name)}; name the folder, or both files"
                )
        own = " ".join(w for w in (folders[folder] if folder else "", trial.strip("_- .")) if w)
        home = next(iter(halves.values())).path.absolute().parent.name
        out.append(Recorded(own or trial or home or "trial", tuple(halves[n] for n in shapes)))
    return out


def _pattern(shape: str) -> re.Pattern[str]:
    """What a file's name is like; without {trial} its folder is the trial."""
    return re.compile(re.escape(shape).replace(re.escape("{trial}"), "(?P<trial>[^/]*)"), re.IGNORECASE)
