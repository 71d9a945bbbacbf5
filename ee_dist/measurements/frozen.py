"""Rows in which a logger wrote its last reading again and again while the robot went on: they are no readings."""

from __future__ import annotations

from collections.abc import Mapping as AnyMapping
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ee_dist.basics.runs import runs
from ee_dist.measurements import signals
from ee_dist.measurements.clocks import Clocked
from ee_dist.measurements.mapping import Column, Mapping
from ee_dist.measurements.units import factor
from ee_dist.robots.model import Robot
from ee_dist.trials.log import GAP, Array

LONG_S, LONG = 0.25, 20
"""How long, and in how many rows, every reading stays what it was to the last digit: shorter is a late row or two."""
FAST = 0.1
"""Share of its highest speed from which a joint is in motion: a speed has an offset, too."""
BEFORE = 3
"""Rows before it by which that is told where no speed was measured, and rows either side that a jump is held against."""
CLEARLY = 1.5
"""Counts of its encoder in a row from which a joint is too quick for it to stand: one that creeps goes by one, and may stick at
the next."""
JUMP = 3.0
"""Times as far as in any row beside it that a joint goes in the first row after: it went on while nothing was written. One that
stuck goes on from where it stood, no faster than in the rows that follow."""


@dataclass(frozen=True)
class Frozen:
    """Rows of a table in which the last reading is repeated, and what says that the robot went on."""

    rows: slice
    seconds: float
    why: str

    def said(self, row: int) -> str:
        """``row``: the first of them in the file."""
        count = self.rows.stop - self.rows.start
        return f"all sensors repeat one reading for {count} rows from row {row} on, {self.seconds:.3g} s, {self.why}"


def frozen(mapping: Mapping, own: Clocked, table: str, robot: Robot) -> list[Frozen]:
    """Such runs of rows of a table. A robot at rest repeats readings too: its speeds are none, and it took some rows to stand."""
    sensors = {s.name: s for s in robot.sensors}
    of_table = {n: c for n, c in mapping.sensors.items() if isinstance(c, Column) and c.table == table}
    if len(of_table) < 2 or len(own.times_s) < LONG:
        return []
    every = [c for g, _, c in mapping.columns() if c.table == table and g in ("sensors", "torques")]
    same = np.all([np.diff(own.table.numbers(c.column, gaps=True)) == 0 for c in every], axis=0)
    changes = np.flatnonzero(~same)
    least = max(LONG, GAP * float(np.median(np.diff(changes)))) if len(changes) > 1 else np.inf
    # The reading that is repeated was one, but at the beginning, where nobody knows of when it is.
    long = [(a, b) for a, b in runs(same) if b - a >= least and own.times_s[b] - own.times_s[a] >= LONG_S]
    if not long:
        return []
    read: dict[str, dict[str, Array]] = {"position": {}, "velocity": {}}
    for name, c in of_table.items():
        if (kind := sensors[name].kind) in read:
            size = c.scale * factor(c.unit, sensors[name].unit, str(mapping.source))
            read[kind][sensors[name].target] = size * own.table.numbers(c.column, gaps=True)
    asked = [
        own.table.numbers(c.column, gaps=True) for g, _, c in mapping.columns() if g == "commands" and c.table == table
    ]
    found = []
    ends = [b for _, b in long if b + 1 < len(own.times_s)]
    for a, b in long:
        if why := _goes_on(robot, a, b, own.times_s, read["position"], read["velocity"], asked, ends):
            first = a + 1 if a else 0
            found.append(Frozen(slice(first, b + 1), float(own.times_s[b] - own.times_s[a]), why))
    return found


def _goes_on(
    robot: Robot, a: int, b: int, times_s: Array, positions: AnyMapping[str, Array], speeds: AnyMapping[str, Array],
    asked: Sequence[Array], ends: Sequence[int],
) -> str:  # fmt: skip
    """Why a joint whose readings stand from row ``a`` to ``b`` was in motion; empty where nothing says so. It was too quick for
    its encoder to stand for a row: of a coarse one, or a speed that is held till the next step of one, nothing is told. Where no
    speed was measured a joint must jump at the end, too, if the log goes on: friction holds one that turns.
    ``ends``: last rows of all such stretches; what follows them is no pace of a joint."""
    joints = [j for j in positions if not speeds or j in speeds]
    if not joints:
        return ""
    lively = signals.lively(np.stack([positions[j] for j in joints], axis=1))
    row_s = float(np.median(np.diff(times_s)))
    comes_back = b + 1 >= len(times_s) or any(_jumps(positions[joints[k]], a, b) for k in lively)
    for joint in (joints[k] for k in lively):
        steps = np.abs(np.diff(positions[joint]))
        finest = float(steps[steps > 0].min())
        unit = "rad/s" if robot.joint(joint).kind == "hinge" else "m/s"
        if speeds:
            speed, most = abs(float(speeds[joint][a])), float(np.nanmax(np.abs(speeds[joint])))
            why = f"while {joint} says that it goes at {speed:.3g} {unit}"
        elif comes_back and a >= BEFORE and any(np.ptp(c[a : b + 1]) > FAST * np.ptp(c) for c in asked):
            # A joint that is braked takes some rows to stand.
            speed, most = float(steps[a - BEFORE : a].min()) / row_s, float(np.delete(steps, ends).max()) / row_s
            why = f"to which {joint} went at {speed:.3g} {unit}, and commands go on"
        else:
            continue
        if speed > FAST * most and speed * row_s > CLEARLY * finest:
            return why
    return ""


def _jumps(position: Array, a: int, b: int) -> bool:
    """Whether a position (T,) that stands from row ``a`` to ``b`` goes on elsewhere than where it stood."""
    steps = np.abs(np.diff(position))
    beside = np.concatenate([steps[max(a - BEFORE, 0) : a], steps[b + 1 : b + 1 + BEFORE]])
    return bool(steps[b] > JUMP * beside.max(initial=0.0))
