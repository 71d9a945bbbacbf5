"""Columns gathered into blocks: one quantity for every joint of the robot."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ee_dist.measurements.errors import MeasurementError
from ee_dist.measurements.proposal.by_limb import called_by_limbs
from ee_dist.measurements.proposal.by_sensor import called_as_sensors
from ee_dist.measurements.proposal.other_names import other_names
from ee_dist.measurements.proposal.pairs import spelled_out
from ee_dist.measurements.proposal.places import hanging_together
from ee_dist.measurements.proposal.words import (
    OTHER,
    POSITION,
    SPEED,
    TIME,
    Reading,
    read_name,
    role_of,
    tokens,
    unit_word,
)
from ee_dist.measurements.proposal.wrench import of_a_wrench
from ee_dist.measurements.table import Recorded, Table
from ee_dist.robots.model import Sensor
from ee_dist.trials.log import Array

Mask = NDArray[np.bool_]
BY_NAME, BY_SENSOR, BY_NUMBER, BY_PLACE, ONLY = "by name", "by sensor", "by number", "by place", "only one"
BY_LIMB = "by limb"
EMPTY, IN_TURN = 0.2, 10
"""Share of a column's cells that may be empty and yet be filled by straight lines: what a logger skips now and then; and how
many in a row, of columns that are written in turn with others, as topics are that go into one table."""
APART = 0.1
"""Share of a column's rows in which one that is written in turn with it may have a number too."""
SILENT = Reading(None, None, None, None, "", False, False)
"""What a name says that says nothing."""
_GENERAL = frozenset(["joint", "link", "motor", "axis", "drive", "servo", "arm", "robot", "j"])


@dataclass
class Block:
    """Columns of one quantity, one for each joint. ``how`` says how the joints were found; ``values`` (T, J) are raw."""

    table: Table
    columns: tuple[str, ...]
    reading: Reading
    how: str
    values: Array
    units: tuple[str | None, ...] = ()
    used: bool = field(default=False)
    rounds: tuple[float, ...] = ()
    """The numbers after which each column begins anew, 0 where it does not; ``values`` go on."""

    @property
    def name(self) -> str:
        first, last = self.columns[0], self.columns[-1]
        short = (
            first if len(self.columns) == 1 else f"{first} to {last}" if len(self.columns) > 2 else f"{first}, {last}"
        )
        return f"{self.table.name}: {short}" if self.table.name else short

    @property
    def numbered(self) -> bool:
        """Whether only numbers or places tell its joints apart."""
        return self.how in (BY_NUMBER, BY_PLACE)

    @property
    def unit(self) -> str | None:
        return self.units[0] if len(set(self.units)) == 1 else None


NEARLY = 0.9
"""Share of numbers from which a column is one of numbers, with mistakes."""
_NUMBER = re.compile(r"\s*[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?\s*")


def joint_words(joints: Sequence[str]) -> dict[str, frozenset[str]]:
    """The words that tell each joint from the others."""
    all_words = {j: frozenset(tokens(j)) for j in joints}
    shared = frozenset.intersection(*all_words.values()) if len(joints) > 1 else frozenset()
    return {j: (w - shared - _GENERAL) or (w - shared) or w for j, w in all_words.items()}


def series_of(table: Table, filled: bool = False) -> dict[str, Array]:
    """Every column of finite numbers, by address; ``filled``: with those of which a few cells are empty, on lines between."""
    found: dict[str, Array] = {}
    for address in table.addresses():
        with contextlib.suppress(MeasurementError):
            found[address] = table.numbers(address, gaps=filled)
    there = {address: np.isfinite(values) for address, values in found.items()}
    for address, good in there.items():
        if good.all():
            continue
        rows, few = np.flatnonzero(good), good.mean() < 1 - EMPTY
        if len(rows) < 2 or (few and (np.diff(rows).max() > IN_TURN or not _in_turn(good, there.values()))):
            del found[address]
            continue
        found[address] = np.interp(np.arange(len(good)), rows, found[address][good])
    return found


def _in_turn(good: Mask, others: Iterable[Mask]) -> bool:
    """Whether some other column has its numbers in the rows (T,) in which this one has none."""
    return any(other.any() and (good & other).sum() <= APART * other.sum() for other in others)


def empty_cells(table: Table, column: str) -> int:
    """How many cells of a column of numbers are empty."""
    return int(np.isnan(table.numbers(column, gaps=True)).sum())


def blocks_of(
    recorded: Recorded, joints: Sequence[str], order: Sequence[str] | None, times: dict[str, str],
    sensors: Sequence[Sensor] = (),
) -> list[Block]:  # fmt: skip
    """All blocks of a recording. ``order`` is the joints in the order of the columns where the user said it; ``times`` is
    the column of the time by table; ``sensors`` are the robot's, by whose names columns may be called."""
    found: list[Block] = []
    for table in recorded.tables:
        series = {a: v for a, v in series_of(table, filled=True).items() if a != times.get(table.name)}
        words = joint_words(joints)
        named = {} if order is not None and _own_numbers(joints) else _named_in_full(list(series), joints)
        sensed = called_as_sensors(list(series), sensors, joints, table.name)
        limbs = {} if order is not None else called_by_limbs([a for a in series if a not in named], joints)
        named |= limbs | sensed
        pairs = spelled_out({_stem(a) for a in series})
        families: dict[tuple[str, bool], list[tuple[str, Reading, str | None]]] = {}
        nobodys = [a for a in series if a not in named and joint_in(a, words) is None]
        wrench = of_a_wrench(table.name, {a: read_name(a) for a in nobodys})
        for address in (a for a in series if a not in wrench):
            joint, stem = joint_in(address, words), _stem(address)
            said = stem if joint is None or joint_in(stem, words) else address
            reading = read_name(pairs.get(stem, said), words[joint] if joint else frozenset())
            if address in named:
                joint, full = named[address]
                reading = reading if stem in pairs and address not in sensed else full
            if reading.kind == TIME:
                continue
            families.setdefault((reading.family, address in named), []).append((address, reading, joint))
        mute: list[str] = []
        for members in families.values():
            block = _block(table, members, series, joints, order)
            if block is not None:
                first = members[0][0]
                how = BY_SENSOR if first in sensed else BY_LIMB if first in limbs else block.how
                found.append(replace(block, how=how))
            elif all(m[1].kind is None for m in members):
                mute += [m[0] for m in members]
        found += _by_place(table, [a for a in series if a in mute], series, joints, order)
        if order is not None:
            used = {c for b in found for c in b.columns} | wrench
            found += _by_other_names(table, [a for a in series if a not in used], series, joints, order)
    return [b for b in found if b.reading.kind != OTHER]


def unreadable(table: Table, joints: Sequence[str]) -> list[MeasurementError]:
    """What is wrong with columns called as others of the same quantity are that can be read, and with those of numbers but for a
    few cells."""
    words = joint_words(joints)
    read, failed = set(), list[tuple[str, bool, MeasurementError]]()
    for address in table.addresses():
        joint = joint_in(address, words)
        reading = read_name(address, words[joint] if joint else frozenset())
        if reading.kind in (TIME, OTHER) or not (reading.kind or reading.command):
            continue
        try:
            table.numbers(address, gaps=True)
            read.add(reading.family)
        except MeasurementError as error:
            failed.append((reading.family, _numbers_but_few(table, address), error))
    return [error for family, nearly, error in failed if nearly or family in read]


def _numbers_but_few(table: Table, address: str) -> bool:
    """Whether nearly all cells of a column are numbers."""
    try:
        return sum(bool(_NUMBER.fullmatch(c)) for c in table.texts(address)) > NEARLY * len(table)
    except MeasurementError:
        return False


def _stem(address: str) -> str:
    """``observation.state[2]`` is called observation.state."""
    return re.sub(r"\[[^\[\]]*\]$", "", address)


def joint_in(address: str, words: dict[str, frozenset[str]]) -> str | None:
    """The joint whose words all stand in a name, if it is one alone; the longest of several wins."""
    have = set(tokens(address))
    return _longest([j for j, w in words.items() if w and w <= have and any(not x.isdigit() for x in w)], words)


def _named_in_full(addresses: Sequence[str], joints: Sequence[str]) -> dict[str, tuple[str, Reading]]:
    """(joint, reading) of the columns in whose names a joint's name stands as it is, where all joints have such a column of one
    quantity: joints that differ by a number alone are told by it only then, as others may count from 0."""
    spelled = {j: tokens(j) for j in joints}
    shared = set.intersection(*(set(w) for w in spelled.values()))
    # q1 and q2 say that they are positions, too.
    telling = {w for w in shared if (said := read_name(w)).kind is not None or said.command is not None}
    families: dict[tuple[str, bool], list[tuple[str, str, Reading]]] = {}
    for address in addresses:
        joint = _longest([j for j, name in spelled.items() if _stands_in(name, tokens(address))], spelled)
        if joint is not None:
            stem = _stem(address)
            inside = stem if not _stands_in(spelled[joint], tokens(stem)) else address
            reading = read_name(inside, frozenset(spelled[joint]) - telling)
            # Between brackets a name often stands alone: finger_joint1 beside joint1 is another.
            alone = address.endswith(f"[{joint}]")
            families.setdefault((reading.family, alone), []).append((address, joint, reading))
    whole = [f for f in families.values() if len(f) == len(joints) == len({j for _, j, _ in f})]
    return {address: (joint, reading) for f in whole for address, joint, reading in f}


def _stands_in(name: Sequence[str], words: Sequence[str]) -> bool:
    """Whether the words of a name stand one behind the other among others."""
    return bool(name) and any(list(words[k : k + len(name)]) == list(name) for k in range(len(words)))


def in_full(address: str, joints: Sequence[str]) -> str | None:
    """The joint whose name stands in a column's as it is, if it is one alone; the longest of several wins."""
    spelled = {j: tokens(j) for j in joints}
    return _longest([j for j, name in spelled.items() if _stands_in(name, tokens(address))], spelled)


def _longest(hits: list[str], words: Mapping[str, Collection[str]]) -> str | None:
    """The one of most words, if it is one alone."""
    most = max((len(words[j]) for j in hits), default=0)
    hits = [j for j in hits if len(words[j]) == most]
    return hits[0] if len(hits) == 1 else None


def _own_numbers(joints: Sequence[str]) -> dict[str, int]:
    """The number of each joint, where joints differ by their last number alone; else none."""
    found = {j: [w for w in tokens(j) if w.isdigit()] for j in joints}
    texts = {tuple(w for w in tokens(j) if not w.isdigit()) for j in joints}
    if len(texts) > 1 or not all(found.values()):
        return {}
    numbers = {j: int(f[-1]) for j, f in found.items()}
    return numbers if len(set(numbers.values())) == len(numbers) else {}


def _block(
    table: Table, members: list[tuple[str, Reading, str | None]], series: dict[str, Array], joints: Sequence[str],
    order: Sequence[str] | None,
) -> Block | None:  # fmt: skip
    by_joint = {j: a for a, _, j in members if j is not None}
    named = [m for m in members if m[2] is not None]
    if len(by_joint) == len(joints) == len(named):
        columns, how = tuple(by_joint[j] for j in joints), BY_NAME
    elif len(joints) == 1 and len(members) == 1:
        columns, how = (members[0][0],), ONLY
    elif len(members) == len(order or joints) and len(joints) > 1:
        numbers = [_number(a, r) for a, r, _ in members]
        if any(n is None for n in numbers) or len(set(numbers)) < len(numbers):
            return None
        # A place in a list is no name.
        listed = any(re.search(r"\[\d+\]$", m[0]) for m in members)
        own = {} if order is not None or listed else _own_numbers(joints)
        if own and set(own.values()) == set(numbers):
            by_number = dict(zip(numbers, (m[0] for m in members), strict=True))
            columns, how = tuple(by_number[own[j]] for j in joints), BY_NAME
            return _made(table, columns, [{m[0]: m[1] for m in members}[c] for c in columns], how, series)
        ranked = [a for _, a in sorted(zip(numbers, (m[0] for m in members), strict=True))]
        placed = dict(zip(order or joints, ranked, strict=True))
        if any(j not in placed for j in joints):
            return None
        columns, how = tuple(placed[j] for j in joints), BY_NUMBER
    else:
        return None
    return _made(table, columns, [{m[0]: m[1] for m in members}[c] for c in columns], how, series)


def _number(address: str, reading: Reading) -> int | None:
    inside = re.search(r"\[([^\[\]]*\d[^\[\]]*)\]$", address)
    return int(re.findall(r"\d+", inside[1])[-1]) if inside else reading.number


def _made(
    table: Table, columns: tuple[str, ...], readings: Sequence[Reading], how: str, series: dict[str, Array]
) -> Block:
    """A block of columns; ``readings`` is what each name says, or what all do."""
    reading = readings[0]
    own = readings if len(readings) == len(columns) else [reading] * len(columns)
    units = tuple(unit_word(table.units.get(c) or "") or _said_unit(c, r) for c, r in zip(columns, own, strict=True))
    if reading.command is None and reading is not SILENT:
        # Tables of one trial may have the same columns: what was asked for in one file, what was measured in another.
        reading = replace(reading, command=role_of(table.name))
    return Block(table, columns, reading, how, np.stack([series[c] for c in columns], axis=1), units)


def _said_unit(column: str, reading: Reading) -> str | None:
    own = read_name(_stem(column)).unit
    # The a of pos_a is no ampere.
    return reading.unit if own is None or (own == "A" and reading.kind in (POSITION, SPEED)) else own


def _by_place(
    table: Table, mute: list[str], series: dict[str, Array], joints: Sequence[str], order: Sequence[str] | None
) -> list[Block]:
    """Blocks of columns whose names say nothing: runs of one column a joint, or joint after joint, or first the one and then the
    other, whichever hangs together."""
    size = len(order or joints)
    if size < 2:
        return [_made(table, (a,), [SILENT], ONLY, series) for a in mute]
    if not mute or len(mute) % size:
        return []
    places = [list(order or joints).index(j) for j in joints] if order is None or set(joints) <= set(order) else []
    if not places:
        return []
    found = []
    for role, own in _by_role(mute, size).items():
        reading = SILENT if role is None else replace(SILENT, command=role)
        for part in hanging_together(own, size, series):
            found.append(_made(table, tuple(part[p] for p in places), [reading], BY_PLACE, series))
    return found


def _by_role(mute: list[str], size: int) -> dict[bool | None, list[str]]:
    """Columns that say nothing else by whether they are called asked for, measured or neither, where each of these is so much of
    every joint; else all of them as called neither."""
    found: dict[bool | None, list[str]] = {}
    for address in mute:
        found.setdefault(read_name(_stem(address)).command, []).append(address)
    return found if all(len(own) % size == 0 for own in found.values()) else {None: mute}


def _by_other_names(
    table: Table, rest: list[str], series: dict[str, Array], joints: Sequence[str], order: Sequence[str]
) -> list[Block]:
    """Blocks of columns that name the joints otherwise than the robot does, in the order that the user said."""
    names, quantities = other_names(rest, len(order))
    if not set(joints) <= set(order):
        return []
    found = []
    for columns in quantities:
        placed = dict(zip(order, columns, strict=True))
        chosen = tuple(placed[j] for j in joints)
        own = frozenset(w for name in names for w in tokens(name))
        found.append(_made(table, chosen, [read_name(chosen[0], own)], BY_PLACE, series))
    return [b for b in found if b.reading.kind != TIME]
