"""What a file of another program says of a robot, before a person adds what it does not say."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from ee_dist.robots.model import NO_TURN, ZERO3, Joint, Part, Quat, Sensor, Vec3


@dataclass(frozen=True)
class Body:
    """Parts, each after the one that carries it; joints; and by joint, field by field, what the file knows of its drive.

    ``driven`` are joints that the file itself gives a drive, or leaves without one on purpose, ``unlimited`` those
    with a torque limit of 0, which is how tools write that they know none. ``free_base``,
    ``gravity_m_s2`` and ``time_step_s`` are None where the file does not say. ``notes`` are for people; ``assumed`` are those
    of them that stand in for a missing number.
    """

    name: str
    parts: tuple[Part, ...]
    joints: tuple[Joint, ...]
    drives: Mapping[str, Mapping[str, float | str]] = field(default_factory=dict)
    driven: tuple[str, ...] = ()
    unlimited: tuple[str, ...] = ()
    transmissions: tuple[str, ...] = ()
    """Joints that the file names in what stands between a motor and a joint."""
    sensors: tuple[Sensor, ...] = ()
    root_without_mass: bool = False
    """Its root was given a mass that it does not state, which counts where the base is free."""
    bolted_only: tuple[str, ...] = ()
    """Parts, with their moments, whose inertia no rigid body has, which counts where the base is free."""
    free_base: bool | None = None
    has_floor: bool | None = None
    gravity_m_s2: float | None = None
    weight_carried: bool = False
    """The file itself carries the weight of all that moves, which is why its gravity is 0."""
    time_step_s: float | None = None
    start_position_m: Vec3 = ZERO3
    start_rotation: Quat = NO_TURN
    notes: tuple[str, ...] = ()
    assumed: tuple[str, ...] = ()

    @property
    def moving(self) -> tuple[Joint, ...]:
        return tuple(j for j in self.joints if j.kind != "fixed")
