"""The robot as immutable data: what an engine needs to build it and what its drives and sensors do.

A robot is a tree of rigid parts. As in URDF, the frame of a part is the frame of the joint that carries it;
the frame of the root part is the robot's own. Lengths are metres, masses kilograms, angles radians, torques
newton metres; for a sliding joint read metres for radians and newtons for newton metres.

Nothing here knows an engine, an effect or a file. An effect changes a robot with the ``with_*`` methods,
which return a new robot.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable
from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import Any

from ee_dist.basics.altered import altered
from ee_dist.basics.names import listed
from ee_dist.basics.quoted import quoted

Vec3 = tuple[float, float, float]
Quat = tuple[float, float, float, float]
"""Unit quaternion, scalar last (x, y, z, w)."""

CONTINUOUS_RAD = 200 * math.pi
"""Limits of a joint that has none, so that ranges stay numbers: a hundred turns either way."""
CONTINUOUS_M = 100.0
NO_TURN: Quat = (0.0, 0.0, 0.0, 1.0)
ZERO3: Vec3 = (0.0, 0.0, 0.0)


class RobotError(ValueError):
    """A robot description that contradicts itself, or a name it does not have."""


@dataclass(frozen=True)
class Shape:
    """A collision shape of a part, placed in the frame of the part.

    ``size`` is (half x, half y, half z) of a box, (radius,) of a sphere, (radius, length) of a capsule or cylinder
    along its own z axis, where the length of a capsule leaves out its caps.
    """

    kind: str
    size: tuple[float, ...]
    position_m: Vec3 = ZERO3
    rotation: Quat = NO_TURN


@dataclass(frozen=True)
class Part:
    """A rigid part. ``inertia_kg_m2`` is (xx, yy, zz, xy, xz, yz) about the centre of mass, in the axes of the part."""

    name: str
    mass_kg: float
    com_m: Vec3
    inertia_kg_m2: tuple[float, float, float, float, float, float]
    shapes: tuple[Shape, ...] = ()
    group: str = ""
    """The limb that the part belongs to; a part lost takes its whole subtree with it."""
    grip: float = 1.0
    """Friction of the part's surface against the floor, as a share of the world's: a shell slides where a foot holds."""


@dataclass(frozen=True)
class Joint:
    """A hinge or slide between two parts (or a rigid bond, ``fixed``).

    ``position_m`` and ``rotation`` place the child's frame in the parent's at joint position zero; ``axis`` is in the
    child's frame. Positions are limited to [lower, upper].
    """

    name: str
    kind: str
    parent: str
    child: str
    position_m: Vec3
    axis: Vec3
    lower: float
    upper: float
    rotation: Quat = NO_TURN
    freedom: float = 1.0
    """Share of the range about the rest pose that a jam leaves; commands and sensors keep their scale. A joint rests at zero, or
    where it starts if zero is out of its range."""
    top_speed: float = float("inf")
    """Highest speed that a data sheet states, rad/s (m/s for a slide): a scale for what is measured; it limits nothing."""
    lag_s: float = 0.0
    """By how much readings were seen to follow commands: a scale for delays that are worth trying; it delays nothing."""
    start: float = 0.0
    """Where the joint stands when a rollout begins that does not say otherwise, rad (m)."""

    @property
    def stops(self) -> tuple[float, float]:
        """The positions that the joint can reach."""
        if self.lower <= 0.0 <= self.upper or self.freedom == 1.0:
            return self.lower * self.freedom, self.upper * self.freedom
        rest = min(max(self.start, self.lower), self.upper)
        return rest + (self.lower - rest) * self.freedom, rest + (self.upper - rest) * self.freedom

    @property
    def ends(self) -> tuple[float, float]:
        """The positions at which something stops the joint: infinite where its limits stand for none."""
        far = CONTINUOUS_RAD if self.kind == "hinge" else CONTINUOUS_M
        endless = self.lower <= -far and self.upper >= far and self.freedom == 1.0
        return (-math.inf, math.inf) if endless else self.stops


COMMANDS = ("position", "speed", "torque", "none")
"""What a drive may be commanded by; ``none``: a passive joint with friction, a spring or stops of its own."""


@dataclass(frozen=True)
class Drive:
    """Motor, gear and controller of one joint; the fields below the line say what may be wrong with it.

    Active torque = clip(kp*error + ki*integral(error) - kd*(speed - feed_forward*commanded speed), +-torque_limit); a
    brushed motor driven by voltage then loses ``torque_limit/speed_limit`` times its speed to back-EMF, so ``speed_limit`` is
    the speed at no load.
    The error is that of the position; of the speed where ``command`` is speed (``kp`` in N.m.s/rad, ``kd`` without use). Where
    it is torque, the command itself takes the place of the sum, and a current controller makes up for back-EMF.
    All neutral values leave the arithmetic bit for bit as if the field did not exist.
    """

    joint: str
    kp: float
    ki: float
    kd: float
    torque_limit: float
    speed_limit: float
    rotor_inertia: float = 0.0
    """Reflected to the joint, kg.m^2 (kg for a slide)."""
    supply_nominal_v: float = 0.0
    """If positive, active torque scales with (measured supply) / (this)."""
    command: str = "position"
    """One of COMMANDS."""
    command_speed: float = float("inf")
    """Velocity limit of the controller, rad/s: how fast it lets a commanded position move, how large a commanded speed it
    obeys, or from which speed on no commanded torque pushes (less of it from nine tenths of that speed on). It has nothing to
    do with ``speed_limit``, which is the motor's."""
    command_acceleration: float = float("inf")
    """Acceleration limit of a controller of positions, rad/s^2: how fast the goal to which it leads its joint gathers speed, and
    loses it again before it arrives (a trapezoidal profile)."""
    command_duration: float = 0.0
    """Time that a controller of positions takes to each new goal, s: it leads its joint there evenly, from where it has led it so
    far, and begins anew whenever the goal changes (a time-based profile). 0: at once."""
    # -- what may be wrong or missing (neutral values); for a slide read m for rad and N for N.m --
    strength: float = 1.0
    current_gain: float = 1.0  # torque of the motor over what is read off its current
    command_gain: float = 1.0
    zero_offset: float = 0.0  # rad by which the controller's zero lies off the joint's
    deadband: float = 0.0  # rad of error on either side that the controller leaves alone
    delay_s: float = 0.0
    back_emf: float = 0.0  # N.m.s/rad on top of torque_limit / speed_limit
    viscous: float = 0.0  # N.m.s/rad
    coulomb: float = 0.0  # N.m
    stribeck: float = 0.0  # N.m on top at rest, gone as exp(-|speed| / stribeck_speed)
    stribeck_speed: float = 0.1
    stribeck_load: float = 0.0  # the same as a share of the torque through the gear
    stribeck_load_speed: float = 0.0  # of that share; where it is not told, stribeck_speed
    load_friction: float = 0.0  # dry friction as a share of the torque through the gear, motor less external
    backdrive_friction: float = 0.0  # by how much that share is larger for the external torque
    quadratic_friction: float = 0.0  # 1/(N.m), times the square of the torque through the gear
    friction_asymmetry: float = 0.0  # N.m by which dry friction is larger moving up, and smaller moving down
    viscous_asymmetry: float = 0.0  # N.m.s/rad, likewise
    offset_torque: float = 0.0
    backlash: float = 0.0  # rad of play between motor and joint, in all
    compliance: float = 0.0  # rad/(N.m) by which motor and joint twist apart
    spring: float = 0.0  # N.m/rad towards spring_rest (rad)
    spring_rest: float = 0.0
    brake: float = 0.0  # N.m of dry friction of a brake
    feed_forward: float = 0.0  # of a controller of positions: share of the commanded speed that kd leaves undamped
    torque_read_late_s: float = 0.0  # age of what is read of its torque beside what is read of its position; signed

    def __post_init__(self) -> None:
        # Descriptions from when there was one speed for both keep their meaning.
        if self.stribeck_load_speed == 0.0:
            object.__setattr__(self, "stribeck_load_speed", self.stribeck_speed)


DRIVE_NUMBERS = tuple(f.name for f in fields(Drive) if f.name not in ("joint", "command"))
"""Fields of a drive that are numbers."""


@dataclass(frozen=True)
class Sensor:
    """One channel. ``kind``: touch (of a part), angle (scaled to [-1, 1] by the joint's range), position, velocity,
    torque (of a joint: what moves it, friction taken off), motor_torque (what the motor's current stands for, friction and
    all that comes after the motor left in), height or tilt of the root part. Torques are those of the step before the
    reading."""

    name: str
    kind: str
    target: str
    unit: str = "1"
    gain: float = 1.0
    bias: float = 0.0
    noise: float = 0.0
    delay_s: float = 0.0
    quantum: float = 0.0
    stuck: float = 0.0
    """Share of its movement since ``stuck_from_s`` that the channel does not report; at 1 it is frozen."""
    stuck_from_s: float = 0.0
    dropout: float = 0.0
    missed_touch: float = 0.0
    """s that a touch must last before it is reported."""


@dataclass(frozen=True)
class World:
    """Floor and surroundings. A tilt turns gravity, so positions stay in the frame of the floor."""

    gravity_m_s2: float = 9.81
    tilt_x_rad: float = 0.0
    tilt_y_rad: float = 0.0
    friction: float = 1.0
    compliance_m_n: float = 0.0
    push_x_n: float = 0.0
    push_y_n: float = 0.0
    drag_n_s_m: float = 0.0
    supply_sag: float = 0.0
    has_floor: bool = True


@dataclass(frozen=True)
class Wiring:
    """Between controller and drives. Motor m obeys controller output ``source[m]``; hidden neuron k is scaled; commands that are
    known beforehand, as those of a log are, act ``early_s`` before their time."""

    source: tuple[int, ...]
    hidden_gain: tuple[float, ...] = ()
    early_s: float = 0.0


@dataclass(frozen=True)
class Law:
    """A term of a user's own in the drive path: a registered function by name, its joint and its values."""

    name: str
    joint: str
    values: tuple[tuple[str, float], ...]


@dataclass(frozen=True)
class Robot:
    """A whole robot. ``free_base`` robots move about; otherwise the root part is bolted to the world."""

    name: str
    parts: tuple[Part, ...]
    joints: tuple[Joint, ...]
    drives: tuple[Drive, ...]
    sensors: tuple[Sensor, ...]
    wiring: Wiring
    world: World = World()
    laws: tuple[Law, ...] = ()
    free_base: bool = True
    start_position_m: Vec3 = ZERO3
    start_rotation: Quat = NO_TURN
    time_step_s: float = 0.01
    lost: tuple[str, ...] = ()
    """Names of parts broken off: kept in the description, so that channels keep their places, absent in the engine."""
    assumed: tuple[tuple[str, str], ...] = field(default=(), compare=False)
    """(joint, field of its drive) of what a description says only because something had to be said. No part of what the robot is:
    a search looks there first, and farther."""

    # -- look-ups ----------------------------------------------------------------------------------------------------

    @property
    def root(self) -> Part:
        return self.parts[0]

    @property
    def motor_names(self) -> tuple[str, ...]:
        return tuple(d.joint for d in self.drives)

    @property
    def sensor_names(self) -> tuple[str, ...]:
        return tuple(s.name for s in self.sensors)

    @property
    def touches_nothing(self) -> bool:
        """Whether it stands fast and there is no floor: nothing that it could touch is simulated."""
        return not (self.free_base or self.world.has_floor)

    def assumed_joints(self, name: str) -> tuple[str, ...]:
        """Joints of whose drive the field of that name was assumed, in the order of the robot."""
        return tuple(j for j in self.motor_names if (j, name) in self.assumed)

    def joint(self, name: str) -> Joint:
        return _find(self.joints, "name", name, "joint")

    def part(self, name: str) -> Part:
        return _find(self.parts, "name", name, "part")

    def joint_of(self, part: str) -> Joint:
        """The joint that carries a part."""
        return _find(self.joints, "child", part, "carried part")

    def subtree(self, part: str) -> tuple[str, ...]:
        """A part and everything it carries."""
        found = [part]
        for name in found:
            found.extend(j.child for j in self.joints if j.parent == name)
        return tuple(found)

    @cached_property
    def present_parts(self) -> tuple[Part, ...]:
        return tuple(p for p in self.parts if p.name not in self.lost)

    @cached_property
    def present_joints(self) -> tuple[Joint, ...]:
        return tuple(j for j in self.joints if j.child not in self.lost)

    @cached_property
    def digest(self) -> str:
        """Content address: equal robots, and only they, have equal digests."""
        made_of = (*self.parts, *self.joints, *self.drives, *self.sensors)
        counts = (len(self.parts), len(self.joints), len(self.drives), len(self.sensors))
        rest = (self.name, self.wiring, self.world, self.laws, self.free_base, self.start_position_m)
        more = (self.start_rotation, self.time_step_s, self.lost)
        text = "".join([repr((counts, rest, more)), *map(_text, made_of)])
        return hashlib.sha256(text.encode()).hexdigest()

    @cached_property
    def noisy(self) -> bool:
        """Whether a sensor draws random numbers."""
        return any(s.noise or s.dropout for s in self.sensors)

    def __getstate__(self) -> dict[str, Any]:
        # Cached look-ups are rebuilt where they are needed: they would double the bytes sent to a worker.
        return {f.name: getattr(self, f.name) for f in fields(self)}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)

    # -- changes -----------------------------------------------------------------------------------------------------

    def with_part(self, name: str, **changes: Any) -> Robot:
        return altered(self, parts=_changed(self.parts, "name", name, "part", changes))

    def with_joint(self, name: str, **changes: Any) -> Robot:
        return altered(self, joints=_changed(self.joints, "name", name, "joint", changes))

    def with_drive(self, joint: str, **changes: Any) -> Robot:
        return altered(self, drives=_changed(self.drives, "joint", joint, "drive", changes))

    def with_sensor(self, name: str, **changes: Any) -> Robot:
        return altered(self, sensors=_changed(self.sensors, "name", name, "sensor", changes))

    def with_world(self, **changes: Any) -> Robot:
        return altered(self, world=altered(self.world, **changes))

    def with_law(self, law: Law) -> Robot:
        return altered(self, laws=(*self.laws, law))

    def map_drive(self, joint: str, change: Callable[[Drive], Drive]) -> Robot:
        _find(self.drives, "joint", joint, "drive")
        return altered(self, drives=tuple(change(d) if d.joint == joint else d for d in self.drives))

    def without(self, part: str) -> Robot:
        """The robot after ``part`` broke off at its joint, with all that it carried."""
        self.joint_of(part)
        gone = set(self.lost) | set(self.subtree(part))
        return altered(self, lost=tuple(p.name for p in self.parts if p.name in gone))


_texts: dict[int, tuple[object, str]] = {}
TEXTS = 65536
"""Texts that are kept at most."""


def _text(item: object) -> str:
    """What an immutable part of a robot is, in full. Found once of each object: robots that differ in one share the others."""
    known = _texts.get(id(item))
    if known is None:
        if len(_texts) >= TEXTS:
            _texts.clear()
        # The object is kept as well, so that its identity cannot become another's.
        known = _texts[id(item)] = (item, repr(item))
    return known[1]


def _find(items: tuple[Any, ...], key: str, value: str, what: str) -> Any:
    for item in items:
        if getattr(item, key) == value:
            return item
    names = listed(getattr(item, key) for item in items)
    raise RobotError(f"no {what} named {quoted(value)}; there are: {names}")


def _changed(items: tuple[Any, ...], key: str, value: str, what: str, changes: dict[str, Any]) -> tuple[Any, ...]:
    _find(items, key, value, what)
    return tuple(altered(item, **changes) if getattr(item, key) == value else item for item in items)
