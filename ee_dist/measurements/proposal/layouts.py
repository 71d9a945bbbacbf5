"""Which files beside one another are one trial, a file for each quantity (q.csv, tau.csv) or for each joint (elbow.csv)."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from ee_dist.measurements.errors import MeasurementError
from ee_dist.measurements.proposal.blocks import joint_in, joint_words
from ee_dist.measurements.proposal.words import OTHER, POSITION, TIME, Reading, read_name
from ee_dist.measurements.readers import read
from ee_dist.measurements.side_by_side import side_by_side
from ee_dist.measurements.table import Table

_WORD = re.compile(r"[^\W\d_]+|\d+")
_HUMP = re.compile(r"\d+|[A-Z]+(?![a-z])|[A-Z]?[^\W\d_A-Z]+|[^\W\d_]")
_BEGINS = re.compile(r"[a-z]+(?=[A-Z])")
_BETWEEN = frozenset(["dot", "ddot", "joint", "joints", "motor", "of", "the", "all"])
"""Words that may stand among those of a quantity and say nothing by themselves."""
_CLOCKS = frozenset(["simulation", "sim", "elapsed", "log", "system"])
"""Words before a time that say whose it is."""
_NUMBERED = re.compile(r"(?<![^\W_])(?:joint|motor|axis|servo|link|drive|dxl|actuator|j|m)[ _.\-]?\d+", re.IGNORECASE)


@dataclass(frozen=True)
class Layout:
    """``patterns``: the name of each kind of file, with {trial} for what tells trials apart; ``first``: those of the first;
    ``others``: files beside them that do not say what they hold, or nothing that is asked for."""

    patterns: Mapping[str, str]
    first: Mapping[str, Path]
    others: tuple[Path, ...] = ()


def put_together(files: Sequence[Path], joints: Sequence[str]) -> tuple[Layout, Table] | MeasurementError | None:
    """How the files are one trial each few, and the first of them; what is in the way where they could be; None for files that
    are nothing of the kind."""
    layouts = (
        (_quantities([f.stem for f in files]), _of_one_quantity),
        (_joints([f.stem for f in files], joints), _of_one_joint),
    )
    for spans, holds in layouts:
        found = _layout(files, spans)
        tables = None if found is None else _tables(found)
        if found is None or tables is None or not holds(tables, joints):
            continue
        found, tables = _without_idle(found, tables)
        try:
            return found, side_by_side(tables)
        except MeasurementError as error:
            return error
    return None


def files_of_joints(files: Sequence[Path], joints: Sequence[str]) -> tuple[Layout, dict[str, Table]] | None:
    """Files that hold one joint each, all joints of a trial; None for others."""
    found = _layout(files, _joints([f.stem for f in files], joints))
    tables = None if found is None else _tables(found)
    return None if found is None or tables is None or not _of_one_joint(tables, joints) else (found, tables)


def _quantities(stems: Sequence[str]) -> list[tuple[int, int] | None]:
    """Where in each name the quantity stands, behind a word that all of them begin with: dataQ, dataQref, dataTimeStamp."""
    begins = _BEGINS.match(stems[0]) if stems else None
    head = (
        begins[0] if begins and all(s.startswith(begins[0]) and s[begins.end() :][:1].isupper() for s in stems) else ""
    )
    spans = [_quantity(s[len(head) :]) for s in stems]
    return [None if span is None else (span[0] + len(head), span[1] + len(head)) for span in spans]


def _quantity(stem: str) -> tuple[int, int] | None:
    """Where in the name of a file the quantity stands; None where it says none, or in two places, or that of something else than
    joints (desiredEndEffectorPosition)."""
    words = [(m.start(), m.end(), m[0].lower()) for m in _humps(stem)]
    runs: list[list[int]] = []
    for k in (k for k, (_, _, w) in enumerate(words) if _tells(w)):
        if runs and all(words[i][2] in _BETWEEN for i in range(runs[-1][-1] + 1, k)):
            runs[-1].append(k)
        else:
            runs.append([k])
    # A letter by itself beside whole words is a setting of the trial: R0.05_T3_jointPosition.
    whole = [run for run in runs if len(run) > 1 or len(words[run[0]][2]) > 1] or runs
    if len(whole) != 1:
        return None
    first, last = whole[0][0], whole[0][-1]
    while last + 1 < len(words) and words[last + 1][2] in ("dot", "ddot"):
        last += 1
    while first and words[first - 1][2] in (_BETWEEN | _CLOCKS):
        first -= 1
    if first and words[first - 1][1] == words[first][0] and not words[first - 1][2].isdigit():
        return None
    return words[first][0], words[last][1]


def _humps(stem: str) -> list[re.Match[str]]:
    """The words of a name, those of camel case each by itself."""
    return [m for whole in _WORD.finditer(stem) for m in _HUMP.finditer(stem, whole.start(), whole.end())]


def _tells(word: str) -> bool:
    said = read_name(word)
    return said.kind is not None or said.command is not None


def _joints(stems: Sequence[str], joints: Sequence[str]) -> list[tuple[int, int] | None]:
    """Where in the name of each file a joint's stands, or a word for one with its number."""
    words = joint_words(joints)
    # As it is, the longest first: joint_a1 says by its words no more than a number.
    whole = re.compile(
        rf"(?<![^\W_])(?:{'|'.join(map(re.escape, sorted(joints, key=len, reverse=True)))})(?![^\W_])", re.IGNORECASE
    )
    out: list[tuple[int, int] | None] = []
    for stem in stems:
        if joints and (named := whole.search(stem)):
            out.append(named.span())
            continue
        joint = joint_in(stem, words) if len(joints) > 1 else None
        at = re.search(re.escape(joint), stem, re.IGNORECASE) if joint else None
        if at is None and joint:
            own = [m for m in _WORD.finditer(stem) if m[0].lower() in words[joint]]
            out.append((own[0].start(), own[-1].end()) if own else None)
            continue
        at = at or _NUMBERED.search(stem)
        out.append(at.span() if at else None)
    return out


def _layout(files: Sequence[Path], spans: Sequence[tuple[int, int] | None]) -> Layout | None:
    """Files by what they hold and by trial; None where some are missing, or what tells trials apart stands in two places, or most
    do not say what they hold."""
    groups: dict[tuple[Path, str, str], dict[str, Path]] = {}
    others = [file for file, span in zip(files, spans, strict=True) if span is None]
    if 2 * len(others) >= len(files):
        return None
    for file, span in zip(files, spans, strict=True):
        if span is None:
            continue
        what = file.stem[slice(*span)]
        group = groups.setdefault((file.parent, file.stem[: span[0]], file.stem[span[1] :]), {})
        if what in group:
            return None
        group[what] = file
    # One more file of a quantity that the others have already, of each trial: filtered, or not.
    if max(len(g) for g in groups.values()) > 2:
        others += [file for g in groups.values() if len(g) == 1 for file in g.values()]
        groups = {key: g for key, g in groups.items() if len(g) > 1}
    first = next(iter(groups.values()))
    if len(first) < 2 or any(g.keys() != first.keys() for g in groups.values()):
        return None
    before, behind = {key[1] for key in groups}, {key[2] for key in groups}
    if len(before) > 1 and len(behind) > 1:
        return None
    head = before.pop() if len(before) == 1 else "{trial}"
    tail = behind.pop() if len(behind) == 1 else "{trial}"
    return Layout({what: f"{head}{what}{tail}{file.suffix}" for what, file in first.items()}, first, tuple(others))


def _tables(found: Layout) -> dict[str, Table] | None:
    tables = {}
    for what, file in found.first.items():
        trials = read(file)
        if len(trials) != 1 or len(trials[0].tables) != 1:
            return None
        tables[what] = trials[0].tables[0]
    return tables


def _without_idle(found: Layout, tables: dict[str, Table]) -> tuple[Layout, dict[str, Table]]:
    """Without files of other rows than the rest whose quantity no model asks for, as an acceleration worked out later."""
    usual, _ = Counter(len(t) for t in tables.values()).most_common(1)[0]
    idle = [what for what, t in tables.items() if read_name(what).kind == OTHER and len(t) != usual]
    stay = [what for what in tables if what not in idle]
    layout = Layout(
        {what: found.patterns[what] for what in stay},
        {what: found.first[what] for what in stay},
        (*found.others, *(found.first[what] for what in idle)),
    )
    return layout, {what: tables[what] for what in stay}


def _of_one_quantity(tables: Mapping[str, Table], joints: Sequence[str]) -> bool:
    """Whether each file is of one quantity, by its name and those of its columns, positions among them. A trial that is called
    after what was commanded holds others too."""
    said = {what: read_name(what) for what in tables}
    kinds = [(r.kind, r.command) for r in said.values() if r.kind != OTHER]
    if len(set(kinds)) < len(kinds) or not any(r.kind == POSITION and not r.weak for r in said.values()):
        return False
    words = joint_words(joints)
    return all(_of_it(column, said[what], words) for what, t in tables.items() for column in t.columns)


def _of_one_joint(tables: Mapping[str, Table], joints: Sequence[str]) -> bool:
    """Whether each file is of one joint: as many as there are, with the same columns, and one position that was read."""
    if len(tables) != len(joints) or len({frozenset(t.columns) for t in tables.values()}) > 1:
        return False
    said = [read_name(c) for c in next(iter(tables.values())).columns]
    return sum(r.kind == POSITION and not r.command and not r.second for r in said) == 1


def _of_it(column: str, file: Reading, words: dict[str, frozenset[str]]) -> bool:
    """Whether a column may be of the quantity that its file is called after."""
    joint = joint_in(column, words)
    own = read_name(column, words[joint] if joint else frozenset())
    return own.kind in (None, TIME, OTHER, file.kind) or own.weak or file.kind is None
