"""Files beside one another: whether each is a trial, or trials are spread over several files, and how they are called."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ee_dist.basics.names import listed
from ee_dist.measurements.errors import MeasurementError
from ee_dist.measurements.not_recorded import recorded_in
from ee_dist.measurements.proposal.by_sensor import tilt_of
from ee_dist.measurements.proposal.layouts import put_together
from ee_dist.measurements.proposal.model import FEWEST_ROWS, Hints, Proposal
from ee_dist.measurements.proposal.of_all_trials import tell_of_all_trials
from ee_dist.measurements.proposal.one_by_one import behind_one_another, one_by_one
from ee_dist.measurements.proposal.stated import add_stated
from ee_dist.measurements.proposal.time import TimeChoice, time_of
from ee_dist.measurements.proposal.undriven import untaken_commands
from ee_dist.measurements.proposal.units import CALIBRATED, OF_RANGES
from ee_dist.measurements.proposal.words import TIME, read_name, role_of, tokens
from ee_dist.measurements.readers import read
from ee_dist.measurements.table import Recorded, Table
from ee_dist.robots.model import Robot

MOST_SHOWN = 12
SWAPPED = 10.0
"""Steps by which a time goes back at least where another trial begins."""
TILTS = ("roll", "pitch")
_CUT = re.compile(r"[_\-. ]+")
_TRIALS = frozenset(["episode", "episodes", "trial", "trials", "run", "runs", "demo", "traj", "trajectory", "rollout"])


def gathered(
    files: Sequence[Path], proposal_head: dict[str, Any], hints: Hints, joints: Sequence[str], notes: list[str],
    places: dict[str, float],
) -> Recorded:  # fmt: skip
    """One trial to look at, and into ``proposal_head`` what the mapping must say to get all: ``tables`` or ``side_by_side`` for
    trials of several files, ``one_joint_each`` for trials of one joint, ``split`` for several trials of one file; into ``notes``
    what is left out, into ``places`` where columns stood that not all trials have. Raises MeasurementError."""
    several = read(files[0])
    first = several[0]
    if len(first.tables) == 1 and (single := one_by_one(files, joints, hints)) is not None:
        proposal_head[single.key] = dict(single.shapes)
        _tell_left(single.others, notes)
        notes += single.notes
        places |= single.first
        return Recorded("", (single.table,))
    if len(files) > 1 and len(first.tables) == 1:
        if (some := _some_empty(files, first, hints)) is not None:
            places |= some[1]
            return Recorded(first.name, (some[0],))
        together = put_together(files, joints)
        if isinstance(together, tuple):
            proposal_head["side_by_side"] = dict(together[0].patterns)
            _tell_left(together[0].others, notes)
            return Recorded("", (together[1],))
        spread = _spread(files, first)
        if spread is not None:
            times = [time_of(table, hints) for _, table in spread.values()]
            _check_clocks([table for _, table in spread.values()], times)
            tables = []
            for (name, (pattern, table)), found in zip(spread.items(), times, strict=True):
                tables.append(replace(table, name=name))
                clock: dict[str, Any] = {"file": pattern}
                if found is not None and found.column is not None:
                    clock["time"] = {"column": found.column, "unit": found.unit}
                proposal_head.setdefault("tables", {})[name] = clock
            return Recorded(first.name, tuple(tables))
        if together is not None:
            raise together
    if len(first.tables) == 1:
        return _first_of_split(_long_enough(files, several, notes), proposal_head)
    return first


def _long_enough(files: Sequence[Path], several: Sequence[Recorded], notes: list[str]) -> Recorded:
    """The first trial of one table with enough rows to tell what its columns are, of those with the same columns as the first of
    ``several``, the trials of the first file; that one where none has. Into ``notes`` what was passed over."""
    columns = several[0].tables[0].columns.keys()
    short: list[tuple[str, int]] = []
    for k, file in enumerate(files):
        trials = read(file) if k else several
        alike = [t for t in trials if len(t.tables) == 1 and t.tables[0].columns.keys() == columns]
        if found := next((t for t in alike if len(t.tables[0]) >= FEWEST_ROWS), None):
            if short:
                rows = "; ".join(f"{name}: {count} rows" for name, count in short[:MOST_SHOWN])
                more = f" and {len(short) - MOST_SHOWN} more" if len(short) > MOST_SHOWN else ""
                notes.append(f"looked at {file.name}, since too few rows tell nothing of columns ({rows}{more})")
            return found
        short += [(f"{file.name} {t.name}" if len(trials) > 1 else file.name, len(t.tables[0])) for t in alike]
    return several[0]


def _tell_left(others: Sequence[Path], notes: list[str]) -> None:
    if left := sorted({f.name for f in others}):
        why = "since their names say nothing that is asked for, or the rest of their trial is missing"
        notes.append(f"left out, {why}: {listed(left[:MOST_SHOWN])}")


def _some_empty(files: Sequence[Path], first: Recorded, hints: Hints) -> tuple[Table, dict[str, float]] | None:
    """Trials of the same columns, of which some are empty in the first and not in all: joints that were not recorded there."""
    table = first.tables[0]
    if all(recorded_in(table, a) for a in table.addresses()):
        return None
    tables = [table]
    for file in files[1:]:
        found = read(file)
        if len(found) != 1 or len(found[0].tables) != 1 or found[0].tables[0].columns.keys() != table.columns.keys():
            return None
        tables.append(found[0].tables[0])
    time = time_of(table, hints)
    together, places = behind_one_another(tables, None if time is None else time.column)
    return (together, places) if any(not recorded_in(table, a) for a in places) else None


def _check_clocks(tables: Sequence[Table], times: Sequence[TimeChoice | None]) -> None:
    """Raises MeasurementError for files of one quantity each that say the time of their rows in another file, or nowhere."""
    timed = [t for t, found in zip(tables, times, strict=True) if found is not None or t.rate_hz]
    if len(timed) > 1 or len(tables) < 2 or len({len(t) for t in tables}) > 1:
        return
    raise MeasurementError(
        f"{tables[0].path.parent}: {listed([t.path.name for t in tables])} have {len(tables[0])} rows each, and "
        f"{f'only {timed[0].path.name}' if timed else 'none'} says when they were: call each after what it holds "
        "(q.csv, tau.csv, time.csv), or put their columns side by side into one file for each trial, with the time"
    )


def _spread(files: Sequence[Path], first: Recorded) -> dict[str, tuple[str, Table]] | None:
    """Files of two or more kinds, equally many, with a word of its own in each kind's names: (pattern, table) by word. Of
    files with the same columns those called commands are another kind than those called measurements, or than the equally many
    that are called neither. Loggers write columns in whatever order, so that only which there are counts; a file with nothing
    but some of another's columns is of its kind."""
    kinds: dict[tuple[bool | None, frozenset[str]], list[tuple[Path, Table]]] = {}
    named = [tokens(f.stem) for f in files]
    # joint_states of joint_states_cmd says nothing, where all are called so.
    everywhere = set.intersection(*map(set, named))
    roles = [role_of(" ".join(w for w in words if w not in everywhere)) for words in named]
    sent = roles.count(True)
    told = sent > 0 and (False in roles or 2 * sent == len(roles))
    for k, file in enumerate(files):
        found = [first] if not k else list(read(file))
        if len(found) != 1 or len(found[0].tables) != 1:
            return None
        table = found[0].tables[0]
        role, columns = roles[k] if told else None, frozenset(table.columns)
        # What is called the same in each of several folders is what it is called.
        within = len({f.stem for f in files}) == len(files)
        alike = [a for a in kinds if a[0] == role and within and (a[1] <= columns or columns <= a[1])]
        kind = alike[0] if alike else (role, columns)
        kinds.setdefault(kind, []).append((file, table))
    if len(kinds) < 2 or len({len(v) for v in kinds.values()}) != 1:
        return None
    stems = [{f.stem for f, _ in v} for v in kinds.values()]
    if all(len(s) == 1 for s in stems):
        # A folder for each trial, in which the files are always called the same.
        return {f.stem: (f"{f.stem}{{trial}}{f.suffix}", t) for (f, t), *_ in kinds.values()}
    words = [set.intersection(*({w.lower() for w in _CUT.split(f.stem)} for f, _ in v)) for v in kinds.values()]
    out: dict[str, tuple[str, Table]] = {}
    for k, members in enumerate(kinds.values()):
        own = words[k] - set().union(*(w for j, w in enumerate(words) if j != k))
        pattern = next((p for w in sorted(own) if (p := _pattern(members[0][0], w)) is not None), None)
        if pattern is None:
            raise MeasurementError(
                f"{members[0][0]}: the files differ in their columns; name the trials alike, such as run1_states.csv and "
                "run1_commands.csv, or import each kind by itself"
            )
        word, shape = pattern
        out[word] = (shape, members[0][1])
    return out


def _pattern(file: Path, word: str) -> tuple[str, str] | None:
    """The word and the name of the file with {trial} for the rest; None where the word stands in the middle."""
    name, low = file.name, file.name.lower()
    if low.startswith(word):
        return word, f"{name[: len(word)]}{{trial}}{file.suffix}"
    if low.endswith(word + file.suffix.lower()):
        return word, f"{{trial}}{name[len(name) - len(file.suffix) - len(word) :]}"
    return None


def _first_of_split(recorded: Recorded, head: dict[str, Any]) -> Recorded:
    """The first trial of a file that holds several: by a column that counts them, or by a time that starts again."""
    table = recorded.tables[0]
    for name in table.columns:
        words = set(read_name(name).family.split())
        if words & _TRIALS and words <= _TRIALS | {"index", "id", "number", "no", "nr"}:
            cells = table.texts(name)
            starts = [i for i, c in enumerate(cells) if i == 0 or c != cells[i - 1]]
            if 1 < len(starts) < len(cells) / 20 and len({cells[i] for i in starts}) == len(starts):
                head["split"] = {"column": name}
                return Recorded(recorded.name, (table.part(slice(0, starts[1])),))
    for name in table.addresses():
        if read_name(name).kind != TIME:
            continue
        try:
            steps = np.diff(table.numbers(name))
        except MeasurementError:
            continue
        back = np.flatnonzero(steps < 0)
        # Rows that were swapped go back by a step or two: that is no other trial, and is said where times are read.
        anew = steps[back] < -SWAPPED * np.median(steps)
        if 0 < len(back) < len(steps) / 20 and anew.all() and (np.delete(steps, back) > 0).all():
            head["split"] = "restarts"
            return Recorded(recorded.name, (table.part(slice(0, int(back[0]) + 1)),))
    return recorded


def proposal_for(files: Sequence[Path], robot: Robot, hints: Hints) -> Proposal:
    """A mapping for files and a robot. Raises MeasurementError."""
    from ee_dist.measurements.proposal.choose import propose

    head: dict[str, Any] = {}
    notes: list[str] = []
    places: dict[str, float] = {}
    recorded = gathered(files, head, hints, robot.motor_names, notes, places)
    if len(recorded.tables) > 1 and "tables" not in head:  # what is named as a file is to be named at each channel
        shown = [t for t in recorded.tables if len(t) >= FEWEST_ROWS]
        recorded = replace(recorded, tables=tuple(shown) or recorded.tables)
    proposal = propose(recorded, robot, hints)
    proposal.head = head | proposal.head
    proposal.notes[:0] = notes
    tell_of_all_trials(proposal, files, places, robot)
    add_stated(proposal, files, recorded, robot)
    used = {c.column for c in proposal.choices}
    left = [name for name in proposal.unused if name not in used]
    if left:
        more = f" and {len(left) - MOST_SHOWN} more" if len(left) > MOST_SHOWN else ""
        proposal.notes.append(f"columns not used: {', '.join(left[:MOST_SHOWN])}{more}")
    proposal.notes += untaken_commands(left, robot)
    proposal.notes += [CALIBRATED] * any(OF_RANGES in c.why for c in proposal.choices)
    empty = [a for t in recorded.tables for a in t.addresses() if a not in used and not recorded_in(t, a)]
    if empty:
        more = f" and {len(empty) - MOST_SHOWN} more" if len(empty) > MOST_SHOWN else ""
        proposal.notes.append(f"left out, for no cell holds a number: {', '.join(empty[:MOST_SHOWN])}{more}")
    tilts = [name for name in left if tilt_of(name)]
    if tilts and robot.free_base and not any(s.kind in TILTS for s in robot.sensors):
        wanted = ", ".join(f"{{name: {kind}, kind: {kind}}}" for kind in TILTS)
        proposal.notes.append(
            f"{listed(tilts)} would say how the base is tilted, and the description has no sensors of it, so that each trial "
            f"begins level: write 'sensors: [joints, {wanted}]' into it"
        )
    for said in (proposal.notes, proposal.questions):  # names of columns may have line breaks
        said[:] = [" ".join(text.split()) for text in said]
    return proposal
