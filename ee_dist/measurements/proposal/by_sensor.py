"""Columns that are called as the robot's sensors are, with a path before the name or a unit behind it."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

from ee_dist.measurements.proposal.words import POSITION, SPEED, TORQUE, Reading, role_of, split_unit, tokens, unit_word
from ee_dist.measurements.units import UNITS
from ee_dist.robots.described import OF_BASE
from ee_dist.robots.instruments import MOTOR_TORQUE
from ee_dist.robots.model import Sensor

KINDS = {"position": POSITION, "velocity": SPEED, "torque": TORQUE, MOTOR_TORQUE: TORQUE}
OF_A_BASE = frozenset(
    ["imu", "base", "body", "trunk", "torso", "root", "orientation", "euler", "rpy", "attitude", "angle"]
)
"""Words beside what is said of a base, which say nothing by themselves."""
_PATH = re.compile(r"[./:\[\]]+")


def column_of(sensor: Sensor, addresses: Iterable[str]) -> tuple[str, str | None] | None:
    """(column, unit or None) of the one column that is called as a sensor is; what was asked for is none."""
    found = [(a, unit) for a in addresses if (unit := _called(a, sensor)) is not None]
    return (found[0][0], found[0][1] or None) if len(found) == 1 else None


def called_as_sensors(
    addresses: Sequence[str], sensors: Sequence[Sensor], joints: Sequence[str], table: str
) -> dict[str, tuple[str, Reading]]:
    """(joint, reading) of the columns of each quantity that has a sensor, and a column called so, at every joint."""
    out: dict[str, tuple[str, Reading]] = {}
    for kind, quantity in KINDS.items():
        of_joint = {s.target: s for s in sensors if s.kind == kind and s.target in joints}
        found = {j: column_of(s, addresses) for j, s in of_joint.items()}
        if role_of(table) is True or len(found) < len(joints) or None in found.values():
            continue
        for joint, column in found.items():
            assert column is not None
            out.setdefault(
                column[0], (joint, Reading(quantity, False, column[1], None, f"sensor {kind}", False, False))
            )
    return out


def _of_base(words: Sequence[str], kind: str) -> bool:
    """Whether a column is called after what a sensor of a kind says of the base (``imu_roll``, ``base.orientation.pitch``)."""
    return kind in OF_BASE and [w for w in words if w not in OF_A_BASE] == tokens(kind)


def tilt_of(address: str) -> bool:
    """Whether a column is called after a tilt of the base, and nothing else."""
    words = tokens(split_unit(address)[0])
    return any(_of_base(words, kind) and len(words) > 1 for kind in ("roll", "pitch"))


def said_of_base(address: str, sensors: Iterable[Sensor], joints: Iterable[str]) -> bool:
    """Whether a column is called as a sensor that says something of the base is, and as no joint."""
    words = tokens(split_unit(address)[0])
    bare = words[:-1] if words and unit_word(words[-1]) is not None else words
    of_joint = any(tokens(j) in (words, bare) for j in joints)
    return not of_joint and any(s.kind in OF_BASE and _called(address, s) is not None for s in sensors)


def _called(address: str, sensor: Sensor) -> str | None:
    """The unit that a column states ("" for none) if it is called as a sensor is; else None."""
    name, unit = split_unit(address)
    steps = [step for step in _PATH.split(name) if step]
    words, wanted = tokens(steps[-1]) if steps else [], tokens(sensor.name)
    if unit is None and words and unit_word(words[-1]) is not None and len(words) > 1:
        bare = words[:-1]
        if bare == wanted or _of_base(bare, sensor.kind):
            unit, words = unit_word(words[-1]), bare
    if role_of(" ".join(steps[:-1])) is True or (words != wanted and not _of_base(words, sensor.kind)):
        return None
    if unit is None:
        return ""
    same = unit in UNITS and sensor.unit in UNITS and UNITS[unit][0] == UNITS[sensor.unit][0]
    return unit if same else None
