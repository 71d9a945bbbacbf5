"""Sensors that no block could fill, switches and supply, and what is not used."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ee_dist.basics.names import listed
from ee_dist.measurements.proposal.blocks import series_of
from ee_dist.measurements.proposal.by_sensor import column_of, tilt_of
from ee_dist.measurements.proposal.model import LIKELY, SURE, UNKNOWN, Choice
from ee_dist.measurements.proposal.view import View
from ee_dist.measurements.proposal.words import read_name, role_of, tokens
from ee_dist.measurements.units import UNITS
from ee_dist.robots.model import Sensor

ENABLED = frozenset(["enable", "enabled", "active", "released", "powered", "on"])
OTHER_SWITCHES = frozenset([
    "estop", "stop", "emergency", "error", "errors", "fault", "faults", "alarm", "warning", "protective", "collision", "brake",
    "brakes", "vacuum", "suction", "pump", "valve", "gripper", "hand", "tool", "light", "lights", "led", "lamp", "laser", "fan",
    "camera", "heater",
])  # fmt: skip
"""What else is switched on and off: 0 in such a column says nothing about whether drives obey."""
ROCKS = 0.1
"""rad by which a base that is bolted down does not tilt."""
SUPPLY = frozenset(["supply", "volt", "volts", "voltage", "vin", "vbat", "battery", "bus"])


def add_rest(v: View) -> None:
    """Sensors that no block could fill."""
    filled = {c.name for c in v.out.choices if c.group == "sensors"}
    for s in v.robot.sensors:
        if s.name not in filled:
            choice = by_its_name(v, s)
            if choice is not None:
                v.out.choices.append(choice)
            else:
                v.out.choices.append(Choice("sensors", s.name, {"column": "???"}, UNKNOWN, "not found"))
                v.out.ask(
                    f"{s.name} ({s.kind} of {s.target or 'the base'}): no column looks like it; write it into the mapping, "
                    "or take the sensor out of the robot's description"
                )


def by_its_name(v: View, sensor: Sensor) -> Choice | None:
    """The one column that is called as a sensor is, in the unit that it states or else in the sensor's."""
    tables = [t for t in v.timed.tables if role_of(t.name) is not True]
    found = [(t, hit) for t in tables if (hit := column_of(sensor, t.addresses())) is not None]
    if len(found) != 1:
        return None
    table, (column, unit) = found[0]
    place = {"table": table.name} if len(v.recorded.tables) > 1 else {}
    said = f"its name says {unit}" if unit else "unit assumed"
    entry = place | {"column": column, "unit": unit or sensor.unit}
    return Choice("sensors", sensor.name, entry, SURE if unit else LIKELY, f"called as the sensor is; {said}")


def add_switches(v: View) -> None:
    """What tells when drives obey, and the supply where the robot's drives depend on it; then what is not used at all."""
    wants_supply = any(d.supply_nominal_v > 0 for d in v.robot.drives)
    used = {(c.entry or {}).get("column") for c in v.out.choices} | v.taken
    left: list[str] = []
    for table in v.recorded.tables:
        place = {"table": table.name} if len(v.recorded.tables) > 1 else {}
        for name, values in series_of(table, filled=True).items():
            if name in used or name == table.clock:
                continue
            words = set(tokens(name))
            switch = bool(words & ENABLED) and not words & OTHER_SWITCHES
            if switch and set(np.unique(values)) <= {0.0, 1.0} and not v.has("enabled"):
                why = "0 and 1, and called so: commands count where it is 1"
                v.out.choices.append(Choice("enabled", "", place | {"column": name}, LIKELY, why))
            elif wants_supply and words & SUPPLY and not words & {"motor"} and not v.has("supply"):
                mean = float(np.mean(values))
                nominal = max(d.supply_nominal_v for d in v.robot.drives)
                unit = next((u for u in ("V", "mV") if 0.5 < mean * UNITS[u][1] / nominal < 2), None)
                if unit is not None:
                    why = f"called so, and about the nominal {nominal:g} V in {unit}"
                    v.out.choices.append(Choice("supply", "", place | {"column": name, "unit": unit}, LIKELY, why))
                else:
                    left.append(name)
            else:
                left.append(name)
    v.out.unused += left
    if not v.robot.free_base:
        v.out.notes += _not_bolted(v, left)


def _not_bolted(v: View, left: Sequence[str]) -> list[str]:
    """A line where columns that nobody uses say that a base tilts which is described as bolted down."""
    read = {a: x for t in v.timed.tables for a, x in series_of(t, filled=True).items() if a in left}
    tilts = [a for a in read if read_name(a).command is not True and tilt_of(a)]
    moved = [a for a in tilts if np.ptp(read[a]) > (ROCKS if np.abs(read[a]).max() < math.pi else math.degrees(ROCKS))]
    if not moved:
        return []
    return [
        f"{listed(moved)} {'says' if len(moved) == 1 else 'say'} that the base tilts, which is described as bolted down: if it "
        "stands on the floor, say free_base: true and list sensors of kind roll and pitch"
    ]
