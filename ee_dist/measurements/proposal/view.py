"""What the steps of a proposal share: the recording on even grids, the robot, what is settled so far, and the choices."""

from __future__ import annotations

import copy
import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ee_dist.measurements import signals
from ee_dist.measurements.alignment import match, one_clock
from ee_dist.measurements.held_readings import held_readings
from ee_dist.measurements.proposal.blocks import (
    BY_LIMB,
    BY_NAME,
    BY_SENSOR,
    Block,
    blocks_of,
    empty_cells,
    joint_in,
    joint_words,
)
from ee_dist.measurements.proposal.model import FEWEST_ROWS, LIKELY, SURE, UNKNOWN, Choice, Hints, Proposal
from ee_dist.measurements.proposal.time import TimeChoice
from ee_dist.measurements.proposal.units import UnitChoice
from ee_dist.measurements.proposal.words import POSITION, SPEED
from ee_dist.measurements.suspicious import round_of
from ee_dist.measurements.table import Recorded
from ee_dist.measurements.units import UNITS
from ee_dist.robots.model import Robot
from ee_dist.trials.log import Array

A_TURN, TURNS = 0.02, (2 * math.pi, 360.0)
"""Share by which a round may be off a whole turn and be one, and what these are."""
TIED = 1.0
"""Scores closer than this are no decision."""
ROUNDED = 0.6
"""Steps of the coarser column by which two that hold one reading may differ: it was rounded when it was written."""


@dataclass
class Scored:
    """A block for a role, with a score (2 and more is worth a thought) and the evidence."""

    block: Block
    score: float
    why: list[str]


class View:
    """One proposal in the making. ``position`` and ``units`` are the block of the positions and its units, once known;
    ``needed`` the torques (T, J) that the motion needs and its speeds; ``gained`` the blocks that the gains were applied to;
    ``taken`` the columns of channels, also of those whose joints are open; ``plans`` the blocks of positions that were asked
    for."""

    position: Scored
    units: UnitChoice

    def __init__(self, recorded: Recorded, robot: Robot, hints: Hints) -> None:
        self.recorded, self.robot, self.hints = recorded, robot, hints
        self.joints = [robot.joint(m) for m in robot.motor_names]
        self.out = Proposal()
        self.times: dict[str, TimeChoice] = {}
        self.blocks: list[Block] = []
        self.needed: tuple[Array, Array] | None = None
        self.gained: list[str] = []
        self.taken: set[str] = set()
        self.plans: list[Block] = []

    @property
    def timed(self) -> Recorded:
        """The tables that have a time."""
        return replace(self.recorded, tables=tuple(t for t in self.recorded.tables if t.name in self.times))

    def gathered(self) -> list[Block]:
        """The blocks of all tables that have a time."""
        known = {n: t.column for n, t in self.times.items() if t.column is not None}
        known |= {t.name: t.clock for t in self.recorded.tables if t.clock is not None}
        found = blocks_of(self.timed, self.robot.motor_names, self.hints.joints, known, self.robot.sensors)
        return [self.even(_going_on(b)) for b in found if len(b.values) >= FEWEST_ROWS]

    def driven(self) -> View:
        """The same without passive joints, which take no commands; its blocks are those not used yet."""
        places = [k for k, d in enumerate(self.robot.drives) if d.command != "none"]
        if len(places) == len(self.robot.drives):
            return self
        names, order, gains = self.robot.motor_names, self.hints.joints, self.hints.gains
        kept = [names[k] for k in places]
        if gains is not None and not isinstance(gains, str):
            gains = [g for j, g in zip(order or names, gains, strict=True) if j in kept]
        hints = replace(self.hints, joints=order and [j for j in order if j in kept], gains=gains)
        found = copy.copy(self)
        found.robot, found.hints = replace(self.robot, drives=tuple(self.robot.drives[k] for k in places)), hints
        found.joints = [self.joints[k] for k in places]
        block = self.position.block
        part = replace(
            block, columns=tuple(block.columns[k] for k in places), values=block.values[:, places],
            units=tuple(block.units[k] for k in places) if block.units else (),
        )  # fmt: skip
        found.position = replace(self.position, block=part)
        if self.units.entries:
            found.units = replace(self.units, entries=tuple(self.units.entries[k] for k in places))
        if self.needed is not None:
            found.needed = (self.needed[0][:, places], self.needed[1][:, places])
        taken = {(b.table.name, c) for b in self.blocks if b.used for c in b.columns}
        words = joint_words(names)
        idle = {*names} - {*kept}
        # What the same quantity is of a joint that takes no command is no command of the others.
        told = [b for b in self.blocks if b.reading.kind is not None or b.reading.command]
        taken |= {(b.table.name, c) for b in told for k, c in enumerate(b.columns) if k not in places}
        found.blocks = [
            b
            for b in found.gathered()
            if not taken & {(b.table.name, c) for c in b.columns}
            and not any(joint_in(c, words) in idle for c in b.columns)
        ]
        return found

    def even(self, block: Block) -> Block:
        """The block on an even grid of its own median step, and no longer than it need be; what sensors say by lines between
        their readings."""
        times = self.times[block.table.name].seconds
        step = float(np.median(np.diff(times))) if len(times) > 1 else 1.0
        count = int(min(float(times[-1] - times[0]) / step + 1, signals.MOST_ROWS)) if step > 0 else 0
        at = times[0] + step * np.arange(max(count, 1))
        sensed = block.reading.command is None and block.reading.kind in (POSITION, SPEED)
        rows = held_readings(block.values) if sensed else None
        read = slice(None) if rows is None else rows
        return replace(block, values=np.stack([np.interp(at, times[read], c[read]) for c in block.values.T], axis=1))

    def step(self, block: Block) -> float:
        times = self.times[block.table.name].seconds
        return float(np.median(np.diff(times)))

    def on(self, block: Block, other: Block) -> Array | None:
        """``other`` on the grid of ``block``; None where their clocks have nothing in common."""
        if other.table.name == block.table.name:
            return other.values
        a, b = self.times[block.table.name].seconds, self.times[other.table.name].seconds
        if not (block.table.clock is not None and other.table.clock is not None) and not one_clock(a, b):
            found = match(
                a[0] + self.step(block) * np.arange(len(block.values)), block.values,
                b[0] + self.step(other) * np.arange(len(other.values)), other.values, held=False,
            )  # fmt: skip
            if not found.clear:
                return None
            b = b + found.offset_s
        at = a[0] + self.step(block) * np.arange(len(block.values))
        own = b[0] + self.step(other) * np.arange(len(other.values))
        return np.stack([np.interp(at, own, c) for c in other.values.T], axis=1)

    def derivative(self, position: Block, speed: Block) -> signals.Relation:
        values = self.on(position, speed)
        if values is None:
            return signals.Relation(0.0, 0.0)
        return signals.derivative(position.values, values, self.step(position))

    def lead(self, command: Block, measured: Block) -> signals.Lead:
        values = self.on(measured, command)
        if values is None:
            return signals.Lead(0.0, 0.0, 0.0)
        return signals.lead(values, measured.values, self.step(measured), bool(command.reading.command))

    def planned_beside(self, plan: Block, measured: Block) -> bool:
        """Whether one block is smooth where the other, beside it in one table, carries noise."""
        return plan.table.name == measured.table.name and signals.planned_beside(plan.values, measured.values)

    def pick(self, found: list[Scored], least: float = 2.0) -> Scored | None:
        """The best, if it is good enough and clearly before the next. The same reading twice is no rival of itself: of counts
        and what a logger made of them, the one whose name states a unit is taken."""
        if not found or found[0].score < least:
            return None
        close = [s for s in found if found[0].score - s.score < TIED]
        if not all(_same_reading(s.block, found[0].block) for s in close):
            return None
        stated = [s for s in close if s.block.unit is not None and s.score >= least]
        return stated[0] if found[0].block.unit is None and stated else found[0]

    def moves(self, b: Block) -> bool:
        return any(signals.moves(c) for c in b.values.T)

    def order(self, block: Block) -> tuple[str, str]:
        """How sure the joints of a block are, and why."""
        if block.how == BY_LIMB:
            return LIKELY, "limb by its name, its joints counted from the base on"
        if not block.numbered:
            return SURE, {BY_NAME: "joint by its name", BY_SENSOR: "called as the robot's sensors are"}.get(
                block.how, ""
            )
        if self.hints.told is not None:
            return self.hints.told.sure, f"joints {block.how}, {self.hints.told.why}"
        if self.hints.joints is None:
            return LIKELY, f"joints {block.how}, in the robot's order"
        return SURE, "joints in the order you said"

    def entry(self, block: Block, k: int, more: dict[str, Any]) -> dict[str, Any]:
        place = {"table": block.table.name} if len(self.recorded.tables) > 1 else {}
        gaps = {"gaps": "interpolate"} if empty_cells(block.table, block.columns[k]) else {}
        anew = {"rolls_over": block.rounds[k]} if block.rounds and block.rounds[k] else {}
        return place | {"column": block.columns[k]} | more | anew | gaps

    def add(
        self, group: str, names: list[str], block: Block, units: UnitChoice, why: list[str], sure: str = SURE
    ) -> None:
        order, how = self.order(block)
        self.taken |= {*block.columns}
        found = (units.sure, sure, order)
        level = UNKNOWN if UNKNOWN in found else LIKELY if LIKELY in found else SURE
        # A mapping with an order that is open must not be taken as it stands.
        which = {"column": "???"} if order == UNKNOWN else {}
        text = "; ".join(w for w in (block.name * bool(which), *why, how, units.why) if w)
        for name, k in zip(names, range(len(self.joints)), strict=True):
            if not name:
                continue
            more = units.entries[k] if units.entries else {"unit": "???"}
            still = not signals.moves(block.values[:, k])
            empty = empty_cells(block.table, block.columns[k])
            how = "the last value holds" if group == "commands" else "filled by straight lines"
            filled = f"; {empty} of {len(block.table)} cells are empty, {how}" if empty else ""
            anew = f"; begins anew after {block.rounds[k]:g}" if block.rounds and block.rounds[k] else ""
            own = f"; {units.own[k]}" if k in units.own else ""
            self.out.choices.append(
                Choice(group, name, self.entry(block, k, more) | which, level, text + own + anew + filled, still)
            )

    def sensor_names(self, kind: str) -> list[str]:
        """The sensor of a kind at each driven joint, "" where there is none."""
        by_joint = {s.target: s.name for s in self.robot.sensors if s.kind == kind}
        return [by_joint.get(j.name, "") for j in self.joints]

    def metric(self) -> Array:
        """Positions (T, J) in rad or m."""
        out = np.empty_like(self.position.block.values)
        for k, e in enumerate(self.units.entries):
            size = UNITS[str(e["unit"])][1]
            out[:, k] = (e.get("scale", 1.0) * self.position.block.values[:, k] + e.get("offset", 0.0)) * size
        return out

    def has(self, group: str) -> bool:
        return any(c.group == group for c in self.out.choices)

    def gains(self) -> list[float]:
        """The gains in the order of the robot's drives, where they were said."""
        assert self.hints.gains is not None and not isinstance(self.hints.gains, str)
        order = list(self.hints.joints or self.robot.motor_names)
        return [float(self.hints.gains[order.index(m)]) for m in self.robot.motor_names]


def _same_reading(a: Block, b: Block) -> bool:
    """Whether two blocks are equal, or one is the other by a scale and an offset at each joint, to within its own steps."""
    if a.values.shape == b.values.shape and np.allclose(a.values, b.values):
        return True
    if a.table is not b.table or len(a.columns) != len(b.columns):
        return False
    pairs = [
        (a.table.numbers(x, gaps=True), a.table.numbers(y, gaps=True))
        for x, y in zip(a.columns, b.columns, strict=True)
    ]
    return all(_rounded(x, y) or _rounded(y, x) for x, y in pairs)


def _rounded(fine: Array, coarse: Array) -> bool:
    """Whether ``coarse`` (T,) is ``fine`` (T,) in another unit, in whole steps; empty cells (NaN) at the same rows."""
    good = np.isfinite(fine)
    if not np.array_equal(good, np.isfinite(coarse)):
        return False
    fine, coarse = fine[good], coarse[good]
    steps = np.diff(np.unique(coarse))
    if not signals.moves(fine) or not len(steps):
        return False
    slope, offset = np.polyfit(fine, coarse, 1)
    return bool(np.abs(coarse - slope * fine - offset).max() <= ROUNDED * steps.min())


def can_be(b: Block, kind: str) -> bool:
    return b.reading.kind in (kind, None) or b.reading.weak


def _going_on(block: Block) -> Block:
    """Positions of encoders that begin anew after a round that is no turn, as they went on."""
    if block.reading.kind not in (POSITION, None) or block.reading.command:
        return block
    found = [round_of(c) for c in block.values.T]
    rounds = tuple(0.0 if f is None or any(abs(f[2] / turn - 1) < A_TURN for turn in TURNS) else f[2] for f in found)
    if not any(rounds):
        return block
    went = [np.unwrap(c, period=size) if size else c for c, size in zip(block.values.T, rounds, strict=True)]
    return replace(block, values=np.stack(went, axis=1), rounds=rounds)
