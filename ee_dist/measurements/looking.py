"""What is looked at once a trial is read: units that cannot be, speeds of another joint, torques that do not fit the motion."""

from __future__ import annotations

import math
from collections.abc import Container, Iterator
from collections.abc import Mapping as AnyMapping
from dataclasses import dataclass

import numpy as np

from ee_dist.basics.quoted import quoted
from ee_dist.measurements.clocks import Clocked
from ee_dist.measurements.commanded import (
    beside_their_commands,
    beyond_the_drive,
    command_flaws,
    far_from_commands,
    torques_beside_commands,
)
from ee_dist.measurements.errors import MeasurementError
from ee_dist.measurements.mapping import Column, Estimated, Mapping
from ee_dist.measurements.need import torques_beside_need
from ee_dist.measurements.report import TORQUE
from ee_dist.measurements.robot_channels import torque_units
from ee_dist.measurements.signals import HARDLY
from ee_dist.measurements.speeds_beside import (
    exchanged_suspicions,
    pace_suspicion,
    scales_suspicion,
    speed_suspicion,
    stall_suspicion,
)
from ee_dist.measurements.suspicious import (
    hardly_moves,
    repeat_suspicion,
    runs_against,
    torque_suspicion,
    torques_suspicion,
    unit_suspicion,
    unlike_suspicion,
)
from ee_dist.measurements.taking import power_suspicion, takers
from ee_dist.measurements.units import factor
from ee_dist.robots.model import Robot, Sensor
from ee_dist.robots.reached import told
from ee_dist.trials.log import Array

BEYOND_THE_DRIVE = 10.0
"""Times the limit of its drive that no measured torque is."""
SHAKES = 0.05
"""Share of the way of the joint of its kind that goes farthest below which another one may only shake with it."""
TURNED = 1.05
"""Times half a turn beyond which the tilt of a base is in another unit."""


@dataclass(frozen=True)
class Looked:
    """A trial as it was read, in the robot's units. ``channels`` are its sensors by name, (T,) each; ``commands`` and ``torques``
    are (T, M), and ``joints``, where all positions are known, too. Whatever is found is a line for the report; a unit that
    can only be another one raises MeasurementError, unless the mapping is sure of it."""

    robot: Robot
    mapping: Mapping
    channels: AnyMapping[str, Array]
    commands: Array
    torques: Array | None
    joints: Array | None
    step_s: float
    rate_read_hz: float
    every_s: float = 0.0
    """From one reading of the sensors to the next, where rows between them were filled in; 0: every row is one."""
    shown: Container[str] = ()
    """Units of positions that some trial shows (see ``units_shown``): where a joint stands still they are not doubted."""
    trial: str = ""
    """Its name, for a refusal; "" of one alone."""

    def found(self) -> Iterator[str]:
        """A line for everything that looks wrong."""
        for s in self.robot.sensors:
            if s.kind == "position":
                yield from self._position(s)
            elif s.kind in ("roll", "pitch"):
                yield from self._tilt(s)
            elif s.kind == "velocity" and s.target in self._positions:
                flaw = speed_suspicion(s.name, self.channels[s.name], self._positions[s.target], self.step_s)
                if flaw is not None and (flaw[1] or s.target in movers(self.robot, self._positions, HARDLY)):
                    yield from self._judged(flaw, self.mapping.sensors[s.name])
        yield from self._speeds()
        for name, flaw in command_flaws(self.robot, self.mapping, self.commands, self._positions, self.step_s):
            yield from self._judged(flaw, self.mapping.commands.get(name))
        yield from beside_their_commands(self.robot, self.commands, self._positions, self.step_s)
        yield from beyond_the_drive(self.robot, self.commands)
        yield from far_from_commands(self.robot, self.commands, self._positions)
        if self.torques is not None:
            yield from torques_beside_commands(self.robot, self.commands, self.torques, self.step_s)
        if self.torques is not None and self.joints is not None:
            yield from self._torques(self.torques, self.joints)

    @property
    def _positions(self) -> dict[str, Array]:
        return {s.target: self.channels[s.name] for s in self.robot.sensors if s.kind == "position"}

    def _position(self, sensor: Sensor) -> Iterator[str]:
        joint, at, column = (
            self.robot.joint(sensor.target),
            self.channels[sensor.name],
            self.mapping.sensors[sensor.name],
        )
        unit = _declared(self.mapping, sensor)
        if unit in self.shown or unit in units_shown(self.robot, self.mapping, self.channels):
            # Columns of one log have one unit, as trials of one mapping have, and another shows it.
            unit = sensor.unit
        yield from self._judged(unit_suspicion(sensor.name, at, *joint.ends, sensor.unit, unit), column)
        for words in told(joint, float(at.min()), float(at.max()), sensor.noise):
            yield f"{sensor.name}: {words}: is the description's zero another one, or its stop elsewhere?"

    def _tilt(self, sensor: Sensor) -> Iterator[str]:
        at = self.channels[sensor.name]
        flaw = unit_suspicion(sensor.name, at, -math.pi, math.pi, sensor.unit, far=TURNED, whose="a base")
        yield from self._judged(flaw, self.mapping.sensors[sensor.name])
        most = float(np.abs(at).max())
        if flaw is None and sensor.kind == "pitch" and most > TURNED * math.pi / 2:
            yield (
                f"{sensor.name}: reaches {most:.3g} rad, and no pitch does as it is counted here (up to 1.57, roll tells the "
                "rest): leave out what comes after the robot fell, or count it so"
            )

    def _speeds(self) -> Iterator[str]:
        """Measured speeds beside the change of positions: of all joints together, and each beside those of the others."""
        positions = self._positions
        read = [
            s
            for s in self.robot.sensors
            if s.kind == "velocity" and s.target in positions and isinstance(self.mapping.sensors[s.name], Column)
        ]
        if not read:
            return
        speed = np.stack([self.channels[s.name] for s in read], axis=1)
        position = np.stack([positions[s.target] for s in read], axis=1)
        far = movers(self.robot, positions)
        moving = [k for k, s in enumerate(read) if s.target in far]
        going, gone = speed[:, moving], position[:, moving]
        # Where it stood still speeds are off for that.
        note = stall_suspicion(going, gone, self.step_s)
        # Lines between readings are slower than what moved: the change of what was read is that from one reading to the next.
        stride = max(1, round(self.every_s / self.step_s))
        pace = stride * self.step_s, self.rate_read_hz
        joints = [s.target for s in read]
        note = note or pace_suspicion(going[::stride], gone[::stride], *pace)
        if note := note or scales_suspicion([joints[k] for k in moving], going[::stride], gone[::stride], pace[0]):
            yield note
        if len(read) > 1:
            names = [s.name for s in read]
            yield from exchanged_suspicions(names, joints, speed, position, self.step_s)

    def _torques(self, torques: Array, joints: Array) -> Iterator[str]:
        """Torques beside what drives can give, what the motion needs, and the work that they may take out of it."""
        for drive, most in zip(self.robot.drives, np.abs(torques).max(axis=0), strict=True):
            stated = (drive.joint, "torque_limit") not in self.robot.assumed
            if stated and most > BEYOND_THE_DRIVE * drive.torque_limit:
                yield (
                    f"{TORQUE} {drive.joint}: reaches {most:.4g}, where its drive gives {drive.torque_limit:.4g} at most: "
                    "another unit?"
                )
        known = [m in self.mapping.torques for m in self.robot.motor_names]
        judged = torques_beside_need(self.robot, torques, joints, self.step_s, known)
        if judged is None:
            return
        units, names = torque_units(self.robot), [m for m in self.robot.motor_names if m in self.mapping.torques]
        for m, relation in zip(names, judged, strict=True):
            yield from self._judged(torque_suspicion(f"{TORQUE} {m}", relation, units[m]), self.mapping.torques[m])
        yield from (note for note in (torques_suspicion(names, judged), unlike_suspicion(names, judged)) if note)
        if self.mapping.external:  # what pushes or pulls from outside may give work
            return
        against = {m for m, relation in zip(names, judged, strict=True) if runs_against(relation)}
        for m, work in takers(self.robot, torques, joints, self.step_s).items():
            if m not in against:
                yield power_suspicion(f"{TORQUE} {m}", work)

    def _judged(self, flaw: tuple[str, bool] | None, column: Column | Estimated | None) -> Iterator[str]:
        if flaw is None:
            return
        note, certain = flaw
        if certain and not (isinstance(column, Column) and column.sure):
            where = f"trial {quoted(self.trial)}: " if self.trial else ""
            raise MeasurementError(
                f"{self.mapping.source}: {where}{note}; if it is right as it stands, add 'sure: true' to it"
            )
        yield note


def units_shown(robot: Robot, mapping: Mapping, channels: AnyMapping[str, Array]) -> set[str]:
    """The units that positions are said to be in of which one at least moves as a joint does: what is small in one unit may be a
    motion in another. ``channels`` (T,) by sensor are in the robot's units."""
    found = set()
    for s in robot.sensors:
        if s.kind == "position":
            ends = robot.joint(s.target).ends
            if all(map(math.isfinite, ends)) and not hardly_moves(channels[s.name], *ends, s.unit):
                found.add(_declared(mapping, s))
    return found


def _declared(mapping: Mapping, sensor: Sensor) -> str:
    """The unit that the mapping says a position is in."""
    column = mapping.sensors[sensor.name]
    return column.unit if isinstance(column, Column) and column.scale == 1 else sensor.unit


def movers(robot: Robot, positions: AnyMapping[str, Array], least: float = SHAKES) -> set[str]:
    """The joints that go at least that share of the way of the one of their kind that goes farthest. What only shakes with it
    shows how links bend and encoders round, and says nothing of speeds and times."""
    spans = {joint: (robot.joint(joint).kind, float(np.ptp(at))) for joint, at in positions.items()}
    most = {kind: max(span for k, span in spans.values() if k == kind) for kind, _ in spans.values()}
    return {joint for joint, (kind, span) in spans.items() if span > 0 and span >= least * most[kind]}


def repeats(robot: Robot, mapping: Mapping, clocks: AnyMapping[str, Clocked], seldom: Container[str]) -> Iterator[str]:
    """Rows in which nothing was read anew: what sensors say in one table, as the file has it. Of tables that were read ``seldom``
    such rows count as none already."""
    sensors = {s.name: s for s in robot.sensors}
    by_table: dict[str, dict[str, Array]] = {}
    for name, c in mapping.sensors.items():
        if isinstance(c, Column) and c.table not in seldom:
            size = c.scale * factor(c.unit, sensors[name].unit, str(mapping.source))
            by_table.setdefault(c.table, {})[name] = size * clocks[c.table].table.numbers(c.column, gaps=True)
    for read in by_table.values():
        placed = {sensors[n].target: at for n, at in read.items() if sensors[n].kind == "position"}
        going = movers(robot, placed)
        moving = np.stack([placed[j] for j in going], axis=1) if going else None
        if note := repeat_suspicion(np.stack([*read.values()], axis=1), moving):
            yield note
