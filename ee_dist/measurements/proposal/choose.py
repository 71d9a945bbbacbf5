"""The proposal itself: which block is the positions, which the speeds, the commands, the torques."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import permutations
from typing import Any

import numpy as np

from ee_dist.measurements.alignment import match, one_epoch
from ee_dist.measurements.errors import MeasurementError, nearest
from ee_dist.measurements.proposal import signals
from ee_dist.measurements.proposal.blocks import BY_NAME, BY_NUMBER, BY_PLACE, Block, blocks_of, series_of
from ee_dist.measurements.proposal.model import LIKELY, SURE, UNKNOWN, Choice, Hints, Proposal
from ee_dist.measurements.proposal.time import TimeChoice, time_of
from ee_dist.measurements.proposal.units import LOOSE, UnitChoice, by_ratio, position_units
from ee_dist.measurements.proposal.words import CURRENT, POSITION, SPEED, TORQUE, tokens
from ee_dist.measurements.robot_channels import command_kind
from ee_dist.measurements.table import Recorded
from ee_dist.measurements.units import UNITS
from ee_dist.robots.inverse_dynamics import joint_torques
from ee_dist.robots.model import Robot, RobotError
from ee_dist.trials.log import Array

SPEEDS = {"hinge": ("rad/s", "deg/s", "rpm"), "slide": ("m/s", "mm/s")}
WINDOW_S = 0.06
"""Of the means through which torques are compared with what the motion needs."""
ENABLED = frozenset(["enable", "enabled", "active", "released", "powered", "on"])
SUPPLY = frozenset(["supply", "volt", "volts", "voltage", "vin", "vbat", "battery", "bus"])
ROUGHER = 1.15
CLEARLY, WELL = 0.3, 0.3
"""Another order of the joints is asked for if it leaves less than this share of what the robot's leaves, and of all."""
TIED = 1.0
"""Scores closer than this are no decision."""


@dataclass
class Scored:
    block: Block
    score: float
    why: list[str]


def propose(recorded: Recorded, robot: Robot, hints: Hints) -> Proposal:
    """A mapping for a trial and a robot. Raises MeasurementError for hints that are not the robot's."""
    return _Proposer(recorded, robot, hints).run()


class _Proposer:
    def __init__(self, recorded: Recorded, robot: Robot, hints: Hints) -> None:
        self.recorded, self.robot, self.hints = recorded, robot, hints
        self.joints = [robot.joint(m) for m in robot.motor_names]
        self.out = Proposal()
        self.times: dict[str, TimeChoice] = {}
        self.needed: tuple[Array, Array] | None = None
        _check_hints(robot, hints)

    def run(self) -> Proposal:
        for table in self.recorded.tables:
            found = time_of(table, self.hints)
            if found is not None:
                self.times[table.name] = found
        known = {n: t.column for n, t in self.times.items() if t.column is not None}
        known |= {t.name: t.clock for t in self.recorded.tables if t.clock is not None}
        timed = replace(self.recorded, tables=tuple(t for t in self.recorded.tables if t.name in self.times))
        if not timed.tables:
            self.out.ask("no column rises like a time; say task.rate_hz=ROWS_A_SECOND")
            return self.out
        order = self.hints.joints
        self.blocks = [
            self._even(b) for b in blocks_of(timed, self.robot.motor_names, order, known) if len(b.values) > 20
        ]
        self.position = self._pick(self._positions())
        if self.position is None:
            self._no_positions()
            return self.out
        self.position.block.used = True
        self.main = self.times[self.position.block.table.name]
        self._time_choice(self.position.block.table.name)
        self.units = position_units(self.position.block, self.joints, self.hints)
        self._sense_positions()
        self._speeds()
        self._torques()
        self._commands()
        self._rest()
        self._switches()
        return self.out

    # -- arrays ------------------------------------------------------------------------------------------------------

    def _even(self, block: Block) -> Block:
        """The block on an even grid of its own median step, and no longer than it need be."""
        times = self.times[block.table.name].seconds
        step = float(np.median(np.diff(times))) if len(times) > 1 else 1.0
        count = min(int((times[-1] - times[0]) / step) + 1, signals.MOST_ROWS) if step > 0 else 0
        at = times[0] + step * np.arange(max(count, 1))
        return replace(block, values=np.stack([np.interp(at, times, c) for c in block.values.T], axis=1))

    def _step(self, block: Block) -> float:
        times = self.times[block.table.name].seconds
        return float(np.median(np.diff(times)))

    def _on(self, block: Block, other: Block) -> Array | None:
        """``other`` on the grid of ``block``; None where their clocks have nothing in common."""
        if other.table.name == block.table.name:
            return other.values
        a, b = self.times[block.table.name].seconds, self.times[other.table.name].seconds
        if not (block.table.clock is not None and other.table.clock is not None) and not one_epoch(a, b):
            found = match(
                a[0] + self._step(block) * np.arange(len(block.values)), block.values,
                b[0] + self._step(other) * np.arange(len(other.values)), other.values, held=False,
            )  # fmt: skip
            if not found.clear:
                return None
            b = b + found.offset_s
        at = a[0] + self._step(block) * np.arange(len(block.values))
        own = b[0] + self._step(other) * np.arange(len(other.values))
        return np.stack([np.interp(at, own, c) for c in other.values.T], axis=1)

    def _derivative(self, position: Block, speed: Block) -> signals.Relation:
        values = self._on(position, speed)
        if values is None:
            return signals.Relation(0.0, 0.0)
        return signals.derivative(position.values, values, self._step(position))

    def _lead(self, command: Block, measured: Block) -> signals.Lead:
        values = self._on(measured, command)
        if values is None:
            return signals.Lead(0.0, 0.0, 0.0, 0.0)
        return signals.lead(values, measured.values, self._step(measured))

    # -- which block is what -----------------------------------------------------------------------------------------

    def _positions(self) -> list[Scored]:
        found = []
        for b in self.blocks:
            r = b.reading
            if (r.kind not in (POSITION, None) and not r.weak) or not self._moves(b):
                continue
            score = 0.0
            why: list[str] = []
            if r.kind == POSITION:
                score, why = (1.0, ["maybe a position by its letter"]) if r.weak else (2.0, ["called a position"])
            if r.command is False:
                score, why = score + 2, [*why, "called measured"]
            elif r.command:
                score -= 4
            score -= r.second
            rates = [(self._derivative(b, s).correlation, s) for s in self.blocks if s is not b and _can_be(s, SPEED)]
            best = max(rates, key=lambda x: x[0] if x[1].reading.command is not True else 0.0, default=(0.0, b))
            if best[0] > 0.9:
                score, why = score + 2 + best[0], [*why, f"its change is {best[1].name} (correlation {best[0]:.3f})"]
            found.append(Scored(b, score, why))
        return self._told_by_lead(sorted(found, key=lambda s: -s.score))

    def _told_by_lead(self, found: list[Scored]) -> list[Scored]:
        """Of two that could both be the positions, the one that follows the other was measured."""
        for one in found[:4]:
            for other in found[:4]:
                if one is other or abs(one.score - other.score) >= TIED + 1 or one.block.reading.command is not None:
                    continue
                ahead = self._lead(other.block, one.block)
                if ahead.correlation > 0.9 and ahead.lead_s > 1.5 * self._step(one.block):
                    one.score += 1.5
                    one.why.append(f"follows {other.block.name} by {1e3 * ahead.lead_s:.0f} ms")
        return sorted(found, key=lambda s: -s.score)

    def _pick(self, found: list[Scored], least: float = 2.0) -> Scored | None:
        """The best, if it is good enough and clearly before the next; equal numbers are no rivals."""
        if not found or found[0].score < least:
            return None
        for rival in found[1:]:
            same = rival.block.values.shape == found[0].block.values.shape and np.allclose(
                rival.block.values, found[0].block.values
            )
            if found[0].score - rival.score < TIED and not same:
                return None
        return found[0]

    def _moves(self, b: Block) -> bool:
        return any(signals.moves(c) for c in b.values.T)

    def _no_positions(self) -> None:
        """Why no block is the positions, as a question."""
        ranked = self._positions()
        n = len(self.joints)
        names = ", ".join(self.robot.motor_names)
        if len(ranked) > 1 and ranked[0].score >= 2:
            self.out.ask(
                f"positions: {ranked[0].block.name} or {ranked[1].block.name}? write the right one into the mapping"
            )
        elif self.hints.joints is None and n > 1:
            self.out.ask(
                f"no columns can be told to be the positions of {names}; if they have no names, say task.joints=[...] "
                "with the joints in the order of the columns, else write them into the mapping"
            )
        else:
            self.out.ask(f"no columns look like the positions of {names}; write them into the mapping")
        for m in self.robot.sensors:
            self.out.choices.append(Choice("sensors", m.name, {"column": "???"}, UNKNOWN, "not found"))

    def _order(self, block: Block) -> tuple[str, str]:
        """How sure the joints of a block are, and why."""
        if block.how in (BY_NUMBER, BY_PLACE) and self.hints.joints is None:
            return LIKELY, f"joints {block.how}, in the robot's order"
        if block.how in (BY_NUMBER, BY_PLACE):
            return SURE, "joints in the order you said"
        return SURE, "joint by its name" if block.how == BY_NAME else ""

    # -- channels ----------------------------------------------------------------------------------------------------

    def _time_choice(self, table: str) -> None:
        t = self.times[table]
        if t.column is not None:
            entry: dict[str, Any] | None = {"column": t.column, "unit": t.unit}
        else:
            entry = {"rate_hz": self.hints.rate_hz} if self.hints.rate_hz else None
        self.out.choices.append(Choice("time", "", entry, t.sure, t.why))
        if t.sure == UNKNOWN:
            self.out.ask(f"time: {t.why}; write the column and its unit into the mapping")

    def _entry(self, block: Block, k: int, more: dict[str, Any]) -> dict[str, Any]:
        place = {"table": block.table.name} if len(self.recorded.tables) > 1 else {}
        return place | {"column": block.columns[k]} | more

    def _add(
        self, group: str, names: list[str], block: Block, units: UnitChoice, why: list[str], sure: str = SURE
    ) -> None:
        order, how = self._order(block)
        level = UNKNOWN if UNKNOWN in (units.sure, sure) else LIKELY if LIKELY in (units.sure, sure, order) else SURE
        text = "; ".join(w for w in (*why, how, units.why) if w)
        for name, k in zip(names, range(len(self.joints)), strict=True):
            if not name:
                continue
            more = units.entries[k] if units.entries else {"unit": "???"}
            still = "; does not move" if not signals.moves(block.values[:, k]) else ""
            self.out.choices.append(Choice(group, name, self._entry(block, k, more), level, text + still))

    def _sensor_names(self, kind: str) -> list[str]:
        """The sensor of a kind at each driven joint, "" where there is none."""
        by_joint = {s.target: s.name for s in self.robot.sensors if s.kind == kind}
        return [by_joint.get(j.name, "") for j in self.joints]

    def _sense_positions(self) -> None:
        assert self.position is not None
        block = self.position.block
        names = self._sensor_names("position")
        if self.units.sure == UNKNOWN:
            units = "deg or task.unit=percent" if block.table.header.get("format") == "lerobot" else "rad, deg, m or mm"
            self.out.ask(f"positions ({block.name}): {self.units.why}; say task.unit={units}")
        self._add("sensors", names, block, self.units, self.position.why)

    def _speeds(self) -> None:
        names = self._sensor_names("velocity")
        if not any(names):
            return
        assert self.position is not None
        found = []
        for b in self.blocks:
            if b.used or not _can_be(b, SPEED) or b.reading.command:
                continue
            r = self._derivative(self.position.block, b)
            score = (
                (2.0 if b.reading.kind == SPEED and not b.reading.weak else 0.0)
                + (b.reading.command is False)
                - b.reading.second
            )
            score += 3 if abs(r.correlation) > 0.9 else 1 if abs(r.correlation) > 0.6 else -3
            found.append(Scored(b, score, [f"change of the positions (correlation {r.correlation:.3f})"]))
        chosen = self._pick(sorted(found, key=lambda s: -s.score), 3.0)
        positions = self._sensor_names("position")
        if chosen is None:
            for name, of in zip(names, positions, strict=True):
                if name and of:
                    entry = {"speed_of": of, "cutoff_hz": min(50.0, round(0.2 / self._step(self.position.block), 3))}
                    self.out.choices.append(
                        Choice("sensors", name, entry, SURE, "no column: estimated from the position")
                    )
            return
        chosen.block.used = True
        self._add("sensors", names, chosen.block, self._speed_units(chosen.block), chosen.why)

    def _speed_units(self, block: Block) -> UnitChoice:
        """The unit in which the numbers are the change of the positions, with the sign that this takes."""
        assert self.position is not None
        values = self._on(self.position.block, block)
        if values is None or not self.units.entries:
            return UnitChoice((), UNKNOWN, "the unit of the positions is open")
        width = max(3, round(0.04 / self._step(self.position.block)))
        truth = signals.change(self._metric(), self._step(self.position.block))
        sure, why = SURE, ""
        entries: list[dict[str, Any]] = []
        for k, r in enumerate(signals.each(signals.smooth(signals.smooth(values, width), width), truth)):
            kind = self.joints[k].kind
            base = SPEEDS[kind][0]
            seen = by_ratio(r.slope, SPEEDS[kind], base) if abs(r.correlation) > 0.8 else None
            stated = block.units[k] if block.units and block.units[k] in SPEEDS[kind] else None
            if seen is None and not signals.moves(values[:, k]):
                seen = stated or (entries[-1]["unit"] if entries else base)
            if stated and seen and stated != seen:
                return UnitChoice((), UNKNOWN, f"the name says {stated}, but beside the positions it is {seen}")
            if seen is None:
                sure = LIKELY if stated else UNKNOWN
                why = f"{stated or 'its unit'} could not be checked: {r.slope:.3g} times the change of the positions"
            entry: dict[str, Any] = {"unit": seen or stated or "???"}
            if r.correlation < -0.8:
                entry["sign"] = -1
            entries.append(entry)
        self._checks_time(entries, sure)
        return UnitChoice(
            tuple(entries) if sure != UNKNOWN else (), sure, why or f"{entries[0]['unit']} by its ratio to that change"
        )

    def _checks_time(self, entries: list[dict[str, Any]], sure: str) -> None:
        """A speed that is the change of the position in units of ours has checked the unit of the time, too."""
        if sure == SURE and all(e["unit"] in ("rad/s", "m/s") for e in entries):
            for k, c in enumerate(self.out.choices):
                if c.group == "time" and c.sure == LIKELY:
                    self.out.choices[k] = replace(c, sure=SURE, why=f"{c.why}; speeds agree")

    def _metric(self) -> Array:
        """Positions (T, J) in rad or m."""
        assert self.position is not None
        out = np.empty_like(self.position.block.values)
        for k, e in enumerate(self.units.entries):
            size = UNITS[str(e["unit"])][1]
            out[:, k] = (e.get("scale", 1.0) * self.position.block.values[:, k] + e.get("offset", 0.0)) * size
        return out

    # -- torques -----------------------------------------------------------------------------------------------------

    def _needed(self, places: list[int] | None = None) -> tuple[Array, Array] | None:
        """Torques (T, J) that the motion needs by the model without friction, and its speeds; None where it cannot say.
        ``places``: the column that each joint has instead of its own."""
        if not self.units.entries or self.robot.free_base:
            return None
        assert self.position is not None
        step = self._step(self.position.block)
        q = signals.smooth(self._metric(), max(3, round(WINDOW_S / step)))
        q = q if places is None else q[:, places]
        v = signals.change(q, step, WINDOW_S)
        try:
            found = joint_torques(self.robot, q, v, signals.change(v, step, WINDOW_S))
        except (RobotError, np.linalg.LinAlgError):
            return None
        return (found, v) if np.isfinite(found).all() else None

    def _beside_need(self, block: Block, places: list[int] | None = None) -> list[signals.Relation] | None:
        """How a block goes with what the motion needs, joint by joint, friction left aside; None where that is not known."""
        needed = self.needed if places is None else self._needed(places)
        if needed is None:
            return None
        assert self.position is not None
        values = self._on(self.position.block, block)
        if values is None:
            return None
        need, speed = needed
        values = values if places is None else values[:, places]
        width = max(3, round(WINDOW_S / self._step(self.position.block)))
        for _ in range(3):
            values = signals.smooth(values, width)
        found = []
        for k in range(values.shape[1]):
            v = speed[:, k]
            friction = np.stack([v, np.tanh(v / (0.05 * np.abs(v).max() + 1e-12))], axis=1)
            found.append(signals.beside(values[:, k], need[:, k], friction))
        return found

    def _check_order(self, block: Block) -> None:
        """Asks for the order of the joints where torques go with the motion in another order than the robot's."""
        count = len(self.joints)
        if block.how not in (BY_NUMBER, BY_PLACE) or self.hints.joints is not None or count < 2:
            return
        own = list(range(count))
        orders = [list(p) for p in permutations(own)] if count <= 3 else [own, own[::-1]]
        left = []
        for places in orders:
            relations = self._beside_need(block, places)
            left.append(sum(1 - r.correlation**2 for r in relations) / count if relations else 1.0)
        best = int(np.argmin(left))
        if left[best] < min(CLEARLY * left[0], WELL):
            names = [self.joints[orders[best].index(k)].name for k in own]
            self.out.ask(
                f"joints: {block.name} leave {100 * left[best]:.0f} % of what the motion needs unexplained as those of "
                f"{', '.join(names)}, {100 * left[0]:.0f} % in the robot's order; say task.joints=[...] as the columns are"
            )

    def _torques(self) -> None:
        sensed = self._sensor_names("torque")
        found = []
        self.needed = self._needed()
        for b in self.blocks:
            named = b.reading.kind in (TORQUE, CURRENT) and not b.reading.weak
            if (
                b.used
                or b.reading.command
                or not self._moves(b)
                or not (named or (b.how == BY_PLACE and self.hints.gains))
            ):
                continue
            score = (
                (3.0 if b.reading.kind == TORQUE else 2.0)
                + (1 if b.reading.command is False else 0)
                - 2 * b.reading.second
            )
            why = [f"called a {b.reading.kind}"] if named else []
            if not named:
                score, why = self._as_current(b)
            found.append(Scored(b, score, why))
        chosen = self._pick(sorted(found, key=lambda s: -s.score))
        if chosen is None:
            if any(sensed):
                rivals = " or ".join(s.block.name for s in found[:3])
                self.out.ask(
                    f"torques: {rivals or 'no columns'}{'?' if rivals else ' look like them'}; write them into the mapping"
                )
                for n in sensed:
                    if n:
                        self.out.choices.append(Choice("sensors", n, {"column": "???"}, UNKNOWN, "not found"))
            return
        chosen.block.used = True
        units = self._torque_units(chosen.block)
        self._check_order(chosen.block)
        level = LIKELY if chosen.block.how == BY_PLACE and chosen.block.reading.kind is None else SURE
        if any(sensed):
            self._add("sensors", sensed, chosen.block, units, chosen.why, level)
        self._add("torques", list(self.robot.motor_names), chosen.block, units, chosen.why, level)

    def _as_current(self, block: Block) -> tuple[float, list[str]]:
        """Whether a block without a name is the measured currents: it goes with the torques that the motion needs, and it is
        no exact multiple of another, as what a controller computed would be."""
        assert self.position is not None
        values, relations = self._on(self.position.block, block), self._beside_need(block)
        if values is None or relations is None:
            return 0.0, []
        fit = float(np.median([abs(r.correlation) for r in relations]))
        if fit < 0.5:
            return 0.0, []
        if self.hints.gains is not None:
            size = float(np.median([abs(r.slope) * abs(g) for r, g in zip(relations, self._gains(), strict=True)]))
            if not 0.3 < size < 3:
                return 1.0, [f"with your gains {size:.2g} times what the motion needs"]
        score, why = (
            3.0 + fit,
            f"goes with the torques that the motion needs (correlation {fit:.2f}), as large with your gains",
        )
        for other in self.blocks:
            if other is block or other.used or other.how != BY_PLACE or len(other.values) != len(block.values):
                continue
            alike = float(np.median([abs(r.correlation) for r in signals.each(block.values, other.values)]))
            if alike > 0.7:
                # Of what was asked for and what was measured the second is rougher.
                rougher = signals.roughness(block.values) / max(signals.roughness(other.values), 1e-30)
                score += 1 if rougher > ROUGHER else -2 if rougher < 1 / ROUGHER else 0
                word = "rougher" if rougher > 1 else "smoother"
                meant = "measured rather than asked for" if rougher > 1 else "asked for rather than measured"
                why += f"; much like {other.name} but {word} ({max(rougher, 1 / rougher):.2g} times): {meant}"
        return score, [why]

    def _gains(self) -> list[float]:
        """The gains in the order of the robot's drives."""
        assert self.hints.gains is not None
        order = list(self.hints.joints or self.robot.motor_names)
        return [float(self.hints.gains[order.index(m)]) for m in self.robot.motor_names]

    def _torque_units(self, block: Block) -> UnitChoice:
        """N.m or N; a current through the gain that was said. A sign turned against the motion's need is turned back."""
        assert self.position is not None
        kinds = ["N.m" if j.kind == "hinge" else "N" for j in self.joints]
        current = block.reading.kind == CURRENT or (block.reading.kind is None and self.hints.gains is not None)
        if current and self.hints.gains is None:
            self.out.ask(f"torques: {block.name} are motor currents; say task.gains=[N.m per A, one for each joint]")
            return UnitChoice((), UNKNOWN, "a current, whose gain no file can say")
        relations = self._beside_need(block) if not block.reading.command else None
        entries, turned, unclear, checked = [], [], [], 0
        for k, unit in enumerate(kinds):
            stated = block.units[k] if block.units else None
            entry: dict[str, Any] = {"unit": stated if stated in ("N.m", "mN.m", "N", "mN") else unit}
            if current:
                gain = self._gains()[k]
                entry = {"unit": unit, "scale": gain * (1e-3 if stated == "mA" else 1.0)}
            elif relations is not None and abs(relations[k].correlation) > 0.7:
                checked += 1
                size = UNITS[entry["unit"]][1] * abs(relations[k].slope)
                if size > 200 and stated is None:
                    entry["unit"] = f"m{unit}"
                elif not 0.05 < size < 20:
                    return UnitChoice((), UNKNOWN, f"{size:.3g} times what the motion needs in {entry['unit']}")
            if relations is not None and relations[k].correlation < -0.4:
                # Turned only where the size, too, is what the motion needs: a model far off can run against any torque.
                r = relations[k]
                size = abs(r.slope) * UNITS[entry["unit"]][1] * abs(float(entry.get("scale", 1.0)))
                if r.correlation < -0.9 and 0.5 < size < 2:
                    entry["sign"] = -1
                    turned.append(self.joints[k].name)
                elif r.correlation < -0.7 and 0.5 < size < 2:
                    self.out.ask(
                        f"torques: {block.columns[k]} seems to run against what the motion of {self.joints[k].name} needs "
                        f"(correlation {r.correlation:.2f}); if it does, add 'sign: -1' to it in the mapping"
                    )
                else:
                    unclear.append(self.joints[k].name)
            entries.append(entry)
        why = "current times the gain you said" if current else f"{entries[0]['unit']}" + (
            ", as large as the motion needs" if checked else ", the usual unit; not checked")  # fmt: skip
        if turned:
            why += f"; sign turned at {', '.join(turned)}: it was against what the motion needs"
        if unclear:
            why += (
                f"; sign at {', '.join(unclear)} not clear, kept as it is: the model needs the other, but not this much"
            )
        stated_all = all(u in ("N.m", "mN.m", "N", "mN") for u in block.units) if block.units else False
        return UnitChoice(
            tuple(entries), SURE if (current or stated_all) and not turned and not unclear else LIKELY, why
        )

    # -- commands ----------------------------------------------------------------------------------------------------

    def _commands(self) -> None:
        kinds = {command_kind(d) for d in self.robot.drives}
        if len(kinds) > 1:
            self.out.ask(
                "commands: joints differ in what they obey (position, speed, torque); write them into the mapping"
            )
            return
        kind = kinds.pop()
        score: Callable[[Block], Scored | None] = {
            "position": self._as_position_command, "speed": self._as_speed_command, "torque": self._as_torque_command
        }[kind]  # fmt: skip
        # What neither is called a command nor goes with the motion is no rival.
        found = [s for b in self.blocks if not b.used and (s := score(b)) is not None and s.score >= 2]
        chosen = self._pick(sorted(found, key=lambda s: -s.score), 3.0)
        names = list(self.robot.motor_names)
        if chosen is None:
            if any(c.group == "torques" for c in self.out.choices) and not found:
                self.out.notes.append("no commands were found: a balance of forces is the way to compare")
                return
            rivals = " or ".join(s.block.name for s in sorted(found, key=lambda s: -s.score)[:3])
            told = f"commands: {rivals}?" if rivals else f"commands: no columns look like {kind}s that were asked for;"
            self.out.ask(f"{told} write the right ones into the mapping")
            for n in names:
                self.out.choices.append(Choice("commands", n, {"column": "???"}, UNKNOWN, "not found"))
            return
        chosen.block.used = True
        if kind == "torque":
            units = self._torque_units(chosen.block)
        else:
            units = (
                self._position_command_units(chosen.block) if kind == "position" else self._speed_units(chosen.block)
            )
        if units.sure == UNKNOWN:
            self.out.ask(f"commands ({chosen.block.name}): {units.why}; write the unit into the mapping")
        level = SURE if chosen.block.reading.command else LIKELY
        self._add("commands", names, chosen.block, units, chosen.why, level)

    def _as_position_command(self, b: Block) -> Scored | None:
        assert self.position is not None
        r = b.reading
        if r.command is False or not (r.kind in (POSITION, None) or r.weak) or not self._moves(b):
            return None
        if np.array_equal(b.values, self.position.block.values):
            return None
        ahead = self._lead(b, self.position.block)
        step, fit = self._step(self.position.block), abs(ahead.correlation)
        score = (3.0 if r.command else 0.0) + (r.kind == POSITION and not r.weak) - r.second
        score += 2 if fit > 0.9 else 1 if fit > 0.7 else -3 if fit < 0.5 else 0
        late = ahead.lead_s < -1.5 * step and fit > 0.7
        score += 1 if ahead.lead_s > 0 else 0
        if ahead.lead_s >= 0:
            why = f"the positions follow it by {1e3 * ahead.lead_s:.0f} ms (correlation {ahead.correlation:.3f})"
        else:
            why = f"it follows the positions by {-1e3 * ahead.lead_s:.0f} ms, as no command should"
        if late and r.command:
            self.out.ask(
                f"commands ({b.name}): {why}; are they swapped with {self.position.block.name}? write the right columns"
            )
        return Scored(b, score - 3 * late, ["called a command", why] if r.command else [why])

    def _position_command_units(self, b: Block) -> UnitChoice:
        """As the positions, unless its name or its ratio to them says otherwise."""
        assert self.position is not None
        if not self.units.entries:
            return UnitChoice((), UNKNOWN, "the unit of the positions is open")
        values = self._on(self.position.block, b)
        ahead = self._lead(b, self.position.block)
        entries, why, sure = [], "in the unit of the positions", self.units.sure
        shift = round(ahead.lead_s / self._step(self.position.block))
        for k, base in enumerate(self.units.entries):
            entry = dict(base)
            stated = b.units[k] if b.units and b.units[k] in ("rad", "deg", "mrad", "turn", "m", "mm", "cm") else None
            if values is not None and signals.moves(values[:, k]) and signals.moves(self.position.block.values[:, k]):
                x, y = values[:, [k]], self.position.block.values[:, [k]]
                r = (
                    signals.relation(x[: len(x) - shift], y[shift:])
                    if shift >= 0
                    else signals.relation(x[-shift:], y[:shift])
                )
                if abs(r.correlation) > 0.8:
                    allowed = ("rad", "deg", "turn") if self.joints[k].kind == "hinge" else ("m", "mm", "cm")
                    unit = str(base["unit"])
                    seen = by_ratio(r.slope, allowed, unit) if "scale" not in base else unit
                    if seen is None and by_ratio(r.slope, allowed[:2], unit, LOOSE) == unit:
                        seen, why = unit, f"in the unit of the positions, which go {1 / abs(r.slope):.2g} of the way"
                        sure = LIKELY
                    if seen is None or (stated and stated != seen):
                        said = f", though its name says {stated}" if stated else ""
                        return UnitChoice((), UNKNOWN, f"{r.slope:.3g} times the positions{said}")
                    if seen != unit:
                        entry, why = {"unit": seen}, f"{seen} by its ratio to the positions"
                    if r.correlation < 0:
                        entry["sign"] = -1
                        why += "; sign turned: the positions run against it"
            elif stated:
                entry = {"unit": stated}
            entries.append(entry)
        return UnitChoice(tuple(entries), sure, why)

    def _as_speed_command(self, b: Block) -> Scored | None:
        r = b.reading
        if r.command is False or not (r.kind in (SPEED, None) or r.weak) or not self._moves(b):
            return None
        assert self.position is not None
        values = self._on(self.position.block, b)
        if values is None:
            return None
        step = self._step(self.position.block)
        ahead = signals.lead(values, signals.change(self.position.block.values, step), step)
        fit = abs(ahead.correlation)
        score = (
            (3.0 if r.command else 0.0)
            + (r.kind == SPEED and not r.weak)
            + (2 if fit > 0.9 else 1 if fit > 0.7 else -2)
        )
        return Scored(
            b, score, [f"the speeds follow it by {1e3 * ahead.lead_s:.0f} ms (correlation {ahead.correlation:.3f})"]
        )

    def _as_torque_command(self, b: Block) -> Scored | None:
        r = b.reading
        if r.kind not in (TORQUE, CURRENT) or r.command is not True or r.weak:
            return None
        return Scored(b, 4.0 - 2 * r.second + (r.kind == TORQUE), ["called a commanded torque"])

    # -- what is left ------------------------------------------------------------------------------------------------

    def _rest(self) -> None:
        """Sensors that no block could fill."""
        filled = {c.name for c in self.out.choices if c.group == "sensors"}
        for s in self.robot.sensors:
            if s.name not in filled:
                exact = [(t, a) for t in self.recorded.tables for a in t.addresses() if a == s.name]
                if len(exact) == 1:
                    place = {"table": exact[0][0].name} if len(self.recorded.tables) > 1 else {}
                    entry = place | {"column": exact[0][1], "unit": s.unit}
                    self.out.choices.append(
                        Choice("sensors", s.name, entry, LIKELY, "a column of that name; unit assumed")
                    )
                else:
                    self.out.choices.append(Choice("sensors", s.name, {"column": "???"}, UNKNOWN, "not found"))
                    self.out.ask(
                        f"{s.name} ({s.kind} of {s.target or 'the base'}): no column looks like it; write it into the mapping, "
                        "or take the sensor out of the robot's description"
                    )

    def _switches(self) -> None:
        """What tells when drives obey, and the supply where the robot's drives depend on it; then what is not used at all."""
        wants_supply = any(d.supply_nominal_v > 0 for d in self.robot.drives)
        used = {(c.entry or {}).get("column") for c in self.out.choices}
        left: list[str] = []
        for table in self.recorded.tables:
            place = {"table": table.name} if len(self.recorded.tables) > 1 else {}
            for name, values in series_of(table).items():
                if name in used or name == table.clock:
                    continue
                words = set(tokens(name))
                if words & ENABLED and set(np.unique(values)) <= {0.0, 1.0} and not self._has("enabled"):
                    why = "0 and 1, and called so: commands count where it is 1"
                    self.out.choices.append(Choice("enabled", "", place | {"column": name}, LIKELY, why))
                elif wants_supply and words & SUPPLY and not words & {"motor"} and not self._has("supply"):
                    mean = float(np.mean(values))
                    nominal = max(d.supply_nominal_v for d in self.robot.drives)
                    unit = next((u for u in ("V", "mV") if 0.5 < mean * UNITS[u][1] / nominal < 2), None)
                    if unit is not None:
                        why = f"called so, and about the nominal {nominal:g} V in {unit}"
                        self.out.choices.append(
                            Choice("supply", "", place | {"column": name, "unit": unit}, LIKELY, why)
                        )
                    else:
                        left.append(name)
                else:
                    left.append(name)
        if left:
            more = f" and {len(left) - 12} more" if len(left) > 12 else ""
            self.out.notes.append(f"columns not used: {', '.join(left[:12])}{more}")

    def _has(self, group: str) -> bool:
        return any(c.group == group for c in self.out.choices)


def _can_be(b: Block, kind: str) -> bool:
    return b.reading.kind in (kind, None) or b.reading.weak


def _check_hints(robot: Robot, hints: Hints) -> None:
    if hints.joints is not None:
        for j in hints.joints:
            if j not in robot.motor_names and j not in ("-", "_"):
                raise MeasurementError(
                    f"task.joints: {robot.name} has no driven joint {j!r}; {nearest(j, robot.motor_names)}"
                )
        missing = [m for m in robot.motor_names if m not in hints.joints]
        if missing or len({j for j in hints.joints if j in robot.motor_names}) < len(robot.motor_names):
            which = missing[0] if missing else "a joint"
            raise MeasurementError(
                f"task.joints: {which} is missing or named twice; expected all of {', '.join(robot.motor_names)}"
            )
    if hints.gains is not None and len(hints.gains) != len(hints.joints or robot.motor_names):
        wanted = len(hints.joints or robot.motor_names)
        raise MeasurementError(
            f"task.gains: {len(hints.gains)} gains for {wanted} joints; expected one each, in N.m per A"
        )
