"""What files state about their trials: numbers that are one all through a trial, such as a controller's gain."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ee_dist.basics.names import listed
from ee_dist.effects.groups import ALL_JOINTS, DRIVEN_JOINTS
from ee_dist.effects.targets import powered
from ee_dist.measurements.errors import MeasurementError
from ee_dist.measurements.proposal.model import LIKELY, Choice, Proposal
from ee_dist.measurements.proposal.words import tokens
from ee_dist.measurements.readers import read
from ee_dist.measurements.table import LARGEST, Recorded
from ee_dist.robots.model import Robot

HEADER, COLUMN = "header", "column"
KEYS = {"position_gain": "kp", "speed_gain": "kd"}
"""The field of a drive that such an effect changes."""
FARTHEST = (1 / 50, 5.0)
"""Times a guessed gain that a stated one may be and yet be in its unit: guesses are off by ten, the numbers of a servo's
register by hundreds."""
GAINS = {"kp": "position_gain", "pgain": "position_gain", "kd": "speed_gain", "dgain": "speed_gain"}
"""The effect that a controller's gain of a trial is told as, by what the number is called."""
FILLING = frozenset(["gain", "gains", "position", "joint", "motor", "servo", "drive", "controller", "pid", "value"])
"""Words that say no more than that it is a gain of a drive."""
LEAST, MOST = 1e-9, 1e9
"""What a gain may be, in whatever unit a file states it."""
LEAST_ROWS = 20
_AT = re.compile(r"\[(\d+)\]$")
"""The place of a number in a list of them."""
SHOWN = 4


def add_stated(proposal: Proposal, files: Sequence[Path], first: Recorded, robot: Robot) -> None:
    """Settings for gains that differ between the trials of ``files``, a note for one that does not, and for whatever else
    differs. Raises MeasurementError for a file that cannot be read."""
    used, order = {(c.entry or {}).get("column") for c in proposal.choices}, _order(proposal, robot)
    named = [key for key in dict(_numbers(first)) if key[1] not in used]
    # Other files are read for what may differ only: columns that stand still are many, and mostly mean nothing.
    named = [(place, name) for place, name in named if place == HEADER or _gain(name, robot, order) is not None]
    if not named or "split" in proposal.head:
        return
    trials = [
        dict(_numbers(r)) for k, f in enumerate(files) for r in ([first] if k == 0 and len(files) == 1 else read(f))
    ]
    differ = []
    known: dict[str, dict[str, float]] = {}
    for place, name in named:
        values, found = [t.get((place, name), math.nan) for t in trials], _gain(name, robot, order)
        if not np.isfinite(values).all():
            continue
        if len(set(values)) == 1:
            if found is not None and not _known(known, proposal, robot, found, name, values[0]):
                _tell(
                    proposal,
                    f"{_AT.sub('', name)} is {values[0]:g} in all trials: the description's gain is taken for it; say it as "
                    "settings of the mapping where it is not, or where other files, with other gains, are to be compared with "
                    "the same model",
                )
        elif found is None or not LEAST <= min(values) <= max(values) <= MOST or (place == HEADER and _AT.search(name)):
            differ.append(f"{name} ({_listed(values)})")
        else:
            proposal.choices += _settings(found, place, name, values, robot)
    if known:
        known = _together(known, robot)
        proposal.head["gains"] = known
        proposal.notes.append(_offered(known, robot))
    if differ:
        proposal.notes.append(
            f"differs between trials, and is not used: {', '.join(differ)}; settings of the mapping can say what it changes"
        )


def _tell(proposal: Proposal, note: str) -> None:
    """Once, if it is the same of several joints."""
    if note not in proposal.notes:
        proposal.notes.append(note)


def _known(
    known: dict[str, dict[str, float]],
    proposal: Proposal,
    robot: Robot,
    found: tuple[str, str],
    name: str,
    value: float,
) -> bool:
    """Whether a gain that is one in all trials is of drives whose gain was only assumed: it goes to ``known`` if it can be in the
    unit of the assumed one, and is told otherwise. What somebody vouches for is not overruled by a column that is called so."""
    effect, target = found
    key = KEYS[effect]
    guessed = {
        d.joint: getattr(d, key) for d in robot.drives if d.joint in _at(target, robot) and (d.joint, key) in robot.assumed
    }  # fmt: skip
    if not guessed:
        return False
    if not all(FARTHEST[0] <= value / g <= FARTHEST[1] for g in guessed.values()):
        _tell(
            proposal,
            f"{_AT.sub('', name)} is {value:g} in all trials, where the description only assumes {key} "
            f"{_listed([*guessed.values()])}: too far off to be taken for the same unit; if it is, write '{key}: {value:g}' at "
            f"the drives of the description and take {key} off 'assumed'",
        )
        return True
    for joint in [ALL_JOINTS] if len(guessed) == len(robot.drives) else guessed:
        known.setdefault(joint, {})[key] = value
    proposal.unused[:] = [column for column in proposal.unused if column != name]
    return [*guessed] == [*_at(target, robot)]


def _offered(known: dict[str, dict[str, float]], robot: Robot) -> str:
    """What is done with gains that were only assumed, and how to keep them."""
    keys = [k for k in KEYS.values() if any(k in gains for gains in known.values())]
    stated = " and ".join(f"{k} {_listed([g[k] for g in known.values() if k in g])}" for k in keys)
    guessed = " and ".join(
        f"{k} {_listed([getattr(d, k) for d in robot.drives if (d.joint, k) in robot.assumed])}" for k in keys
    )
    entries = dict.fromkeys(", ".join(f"{k}: {v:g}" for k, v in gains.items()) for gains in known.values())
    where = "every drive" if [*known] == [ALL_JOINTS] else f"the drives of {listed(known)}"
    off = " and ".join(keys)
    return (
        f"the log states {stated}, where the description only assumes {guessed}: the recorded robot gets those of the log "
        f"('gains' of the mapping), which compare, explain and improve then use, in N.m/rad and N.m.s/rad (N/m and N.s/m); to "
        f"keep them write {{{'} or {'.join(entries)}}} at {where} of the description and take {off} off 'assumed'; "
        "if they are in other units, take 'gains' out of the mapping"
    )


def _settings(found: tuple[str, str], place: str, name: str, values: Sequence[float], robot: Robot) -> Iterator[Choice]:
    """A factor on the description's gain of each trial: on that of all its drives at once, where it is the same of all."""
    effect, target = found
    described = {d.joint: getattr(d, KEYS[effect]) for d in robot.drives if d.joint in _at(target, robot)}
    known = {j: _in_the_unit(g, (j, KEYS[effect]) in robot.assumed, values) for j, g in described.items()}
    if not all(known.values()):
        # The usual value, of those as usual the smallest, stands for the description's gain.
        usual, _ = min(Counter(values).items(), key=lambda item: (-item[1], item[0]))
        how = (
            f"the description's gain, {_listed([*described.values()])}, which need not be in one unit with it, is taken for that "
            f"at {usual:g}: where it is that of another, change the scale"
        )
        alike = {target: (usual, how)}
    elif len({(g, known[j]) for j, g in described.items()}) == 1:
        alike = {target: next((g, known[j]) for j, g in described.items())}
    else:
        alike = {j: (g, known[j]) for j, g in described.items()}
    for whose, (reference, how) in alike.items():
        entry = {"effect": effect, "target": whose, "factor": {place: name, "scale": 1.0 / reference}}
        why = f"called a gain, and differs between trials ({_listed(values)}); {how}"
        yield Choice("settings", f"{effect} at {whose}", entry, LIKELY, why)


def _in_the_unit(gain: float, guessed: bool, values: Sequence[float]) -> str:
    """Why a description's ``gain`` is in the unit of the stated ``values``, so that each is so many times that; empty where
    nothing tells."""
    taken = "taken for the same unit: the factor is the stated gain over that"
    if min(values) <= gain <= max(values):
        place = "one of these" if gain in values else "between these"
        return f"the description's gain, {gain:g}, is {place}, and {taken}"
    if guessed and all(FARTHEST[0] <= v / gain <= FARTHEST[1] for v in values):
        return f"the description only assumes {gain:g}, {taken}; where they are in other units, change the scale"
    return ""


def _numbers(recorded: Recorded) -> Iterator[tuple[tuple[str, str], float]]:
    """((place, name), value) of each number that is the same all through a trial."""
    for table in recorded.tables:
        for name, value in table.header.items():
            # A whole number of JSON may have hundreds of digits.
            if _is_number(value):
                yield (HEADER, name), float(value)
            elif isinstance(value, list) and value and all(map(_is_number, value)) and _gain_words(name):
                yield from (((HEADER, f"{name}[{k}]"), float(v)) for k, v in enumerate(value))
    if len(recorded.tables) != 1 or len(recorded.tables[0]) < LEAST_ROWS:
        return
    (table,) = recorded.tables
    for name in table.addresses():
        if name == table.clock or not _gain_words(name):
            continue
        try:
            seen = table.numbers(name)
        except MeasurementError:
            continue
        if np.isfinite(seen).all() and (seen == seen[0]).all():
            yield (COLUMN, name), float(seen[0])


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) <= LARGEST


def _order(proposal: Proposal, robot: Robot) -> dict[int, str]:
    """The joint of each place in a list of one number a joint: that of the positions, where these were found in one; else as the
    robot has them."""
    joints = {s.name: s.target for s in robot.sensors if s.kind == "position"}
    places = [(_AT.search(c.column), joints.get(c.name)) for c in proposal.choices if c.group == "sensors"]
    found = {int(at[1]): joint for at, joint in places if at is not None and joint is not None}
    return found if len(found) == len(robot.drives) else dict(enumerate(robot.motor_names))


def _together(known: dict[str, dict[str, float]], robot: Robot) -> dict[str, dict[str, float]]:
    """The same said once where it is of all joints."""
    every = [known.get(m) for m in robot.motor_names]
    return {ALL_JOINTS: every[0]} if every[0] and all(gains == every[0] for gains in every) else known


def _at(target: str, robot: Robot) -> tuple[str, ...]:
    """The driven joints that a gain of this target is of."""
    return powered(robot) if target in (ALL_JOINTS, DRIVEN_JOINTS) else (target,)


def _gain_words(name: str) -> tuple[str, list[str]] | None:
    """What a gain is called by, and the words of the name that are left."""
    words = tokens(name)
    for key in GAINS:
        if key in words:
            return key, [w for w in words if w != key and w not in FILLING]
    for short in ("p", "d"):
        if short in words and {"gain", "gains"} & set(words):
            return f"{short}gain", [w for w in words if w != short and w not in FILLING]
    return None


def _gain(name: str, robot: Robot, order: Mapping[int, str]) -> tuple[str, str] | None:
    """(effect, target) of a number that is called a gain of one drive, or of all; None where it is not, or no drive has one.
    ``order``: the joint of each place in a list."""
    at = _AT.search(name)
    found = _gain_words(name[: at.start()] if at else name)
    if found is None:
        return None
    key, rest = found
    effect = GAINS[key]
    able = [
        d.joint for d in robot.drives if d.command == "position" and (d.kp if effect == "position_gain" else d.kd) > 0
    ]
    if at and not rest:
        joint = order.get(int(at[1]))
        return (effect, joint) if joint in able else None
    if not rest:
        # Joints that nothing drives have no gains that could be meant.
        driven = powered(robot)
        if not driven or len(able) < len(driven):
            return None
        whole = ALL_JOINTS if len(driven) == len(robot.drives) else DRIVEN_JOINTS
        return effect, driven[0] if len(driven) == 1 else whole
    of_joint = [j for j in able if [w for w in tokens(j) if w not in FILLING] == rest]
    return (effect, of_joint[0]) if len(of_joint) == 1 else None


def _listed(values: Sequence[float]) -> str:
    distinct = sorted(set(values))
    more = f" and {len(distinct) - SHOWN} more" if len(distinct) > SHOWN else ""
    return ", ".join(f"{v:g}" for v in distinct[:SHOWN]) + more
