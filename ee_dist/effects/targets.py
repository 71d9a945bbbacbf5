"""Where an effect can act on a robot."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import combinations

from ee_dist.robots.model import Robot


def parts(robot: Robot) -> tuple[str, ...]:
    """Parts whose mass can show: all but a root that is bolted down."""
    return tuple(p.name for p in robot.parts[0 if robot.free_base else 1 :])


def carried_parts(robot: Robot) -> tuple[str, ...]:
    """Parts that hang on a joint and so can break off, root part left out."""
    return tuple(p.name for p in robot.parts[1:])


def motors(robot: Robot) -> tuple[str, ...]:
    """All joints that have a drive, be it a passive one."""
    return robot.motor_names


def stopped_joints(robot: Robot) -> tuple[str, ...]:
    """Joints with a drive that do not turn without end."""
    return tuple(name for name in robot.motor_names if math.isfinite(robot.joint(name).ends[1]))


def sprung_joints(robot: Robot) -> tuple[str, ...]:
    """Joints that a spring may pull back: what turns without end and without a motor would wind it up."""
    free = {d.joint for d in robot.drives if d.command == "none"}
    return tuple(n for n in robot.motor_names if n not in free or math.isfinite(robot.joint(n).ends[1]))


def powered(robot: Robot) -> tuple[str, ...]:
    """Joints that a motor moves."""
    return tuple(d.joint for d in robot.drives if d.command != "none")


def bolted_motors(robot: Robot) -> tuple[str, ...]:
    """Joints that a motor moves, of a robot whose forces can be balanced."""
    return () if robot.free_base else powered(robot)


@dataclass(frozen=True)
class Assumed:
    """Joints of whose drive a description only assumed the field of that name; as data, so that effects can be sent."""

    field: str

    def __call__(self, robot: Robot) -> tuple[str, ...]:
        return robot.assumed_joints(self.field)


def with_rotors(robot: Robot) -> tuple[str, ...]:
    """Joints whose drive is described with a rotor."""
    return tuple(d.joint for d in robot.drives if d.rotor_inertia > 0)


def uneven_rotors(robot: Robot) -> tuple[str, ...]:
    """Joints whose rotors were assumed, if these differ: where all are alike as much more at each says the same as a factor."""
    joints = robot.assumed_joints("rotor_inertia")
    return joints if len({d.rotor_inertia for d in robot.drives if d.joint in joints}) > 1 else ()


def position_drives(robot: Robot) -> tuple[str, ...]:
    """Joints under a position controller."""
    return tuple(d.joint for d in robot.drives if d.command == "position")


def governed_drives(robot: Robot) -> tuple[str, ...]:
    """Joints whose controller may keep them below a speed of its own."""
    return tuple(d.joint for d in robot.drives if d.command in ("position", "torque"))


def controlled(robot: Robot) -> tuple[str, ...]:
    """Joints under a controller of position or speed."""
    return tuple(d.joint for d in robot.drives if d.command in ("position", "speed"))


def damped_drives(robot: Robot) -> tuple[str, ...]:
    """Joints whose controller has a gain on their speed."""
    return tuple(d.joint for d in robot.drives if d.command == "position" and d.kd > 0)


def motors_with_speed_limit(robot: Robot) -> tuple[str, ...]:
    """Motors driven by voltage; a current controller makes up for back-EMF."""
    return tuple(d.joint for d in robot.drives if math.isfinite(d.speed_limit) and d.command in ("position", "speed"))


def motors_with_torque_limit(robot: Robot) -> tuple[str, ...]:
    return tuple(d.joint for d in robot.drives if math.isfinite(d.torque_limit) and d.command != "none")


def supply(robot: Robot) -> tuple[str, ...]:
    """The one supply that feeds all motors."""
    return ("supply",) if motors_with_torque_limit(robot) else ()


def base(robot: Robot) -> tuple[str, ...]:
    """The root part of a robot that moves about."""
    return (robot.root.name,) if robot.free_base else ()


def sensors(robot: Robot) -> tuple[str, ...]:
    return robot.sensor_names


def touch_sensors(robot: Robot) -> tuple[str, ...]:
    return tuple(s.name for s in robot.sensors if s.kind == "touch")


def continuous_sensors(robot: Robot) -> tuple[str, ...]:
    return tuple(s.name for s in robot.sensors if s.kind != "touch")


def hidden_neurons(robot: Robot) -> tuple[str, ...]:
    return tuple(f"hidden_{k}" for k in range(len(robot.wiring.hidden_gain)))


def motor_pairs(robot: Robot) -> tuple[str, ...]:
    """``a+b``: two different motors that take commands of one kind, in the order of the robot."""
    drives = [d for d in robot.drives if d.command != "none"]
    pairs = ((a, b) for i, a in enumerate(drives) for b in drives[i + 1 :])
    return tuple(f"{a.joint}+{b.joint}" for a, b in pairs if a.command == b.command)


def joint_pairs(robot: Robot) -> tuple[str, ...]:
    """``a+b``: two different joints with a drive that both turn, or both slide, in the order of the robot."""
    kinds = {n: robot.joint(n).kind for n in robot.motor_names}
    pairs = combinations(robot.motor_names, 2)
    return tuple(f"{a}+{b}" for a, b in pairs if kinds[a] == kinds[b])


def floor(robot: Robot) -> tuple[str, ...]:
    return ("floor",) if robot.world.has_floor else ()


def mounting(robot: Robot) -> tuple[str, ...]:
    """The root part of a robot that is bolted down."""
    return () if robot.free_base else (robot.root.name,)


def sensor_groups(robot: Robot) -> tuple[str, ...]:
    """Kinds of sensors of which there are several: they share a bus, a filter, a driver."""
    kinds = [s.kind for s in robot.sensors]
    return tuple(dict.fromkeys(k for k in kinds if kinds.count(k) > 1))


def is_arm(robot: Robot) -> bool:
    """Bolted down, with more than one driven joint."""
    return not robot.free_base and len(robot.drives) > 1


def is_bolted(robot: Robot) -> bool:
    """Bolted down, with a driven hinge that weight may turn."""
    kinds = {j.name: j.kind for j in robot.joints}
    return not robot.free_base and any(kinds[d.joint] == "hinge" for d in robot.drives)


def takes_torques(robot: Robot) -> bool:
    """Whether some motor is told a torque, or a voltage in its place."""
    return any(d.command == "torque" for d in robot.drives)


MOST_JOINTS = 8


def has_few_joints(robot: Robot) -> bool:
    """Bolted down, with two to MOST_JOINTS joints: pairs of more are too many to ask for each."""
    return not robot.free_base and 2 <= len(robot.drives) <= MOST_JOINTS


def gains_are_known(robot: Robot) -> bool:
    """Whether somebody said what the robot's controllers do: a torque is too weak only beside one that is known."""
    return not robot.assumed_joints("kp")


def is_adjustable(robot: Robot) -> bool:
    """An arm, whose maker or user set its controllers; or any robot whose description guesses at their gains."""
    return is_arm(robot) or not gains_are_known(robot)
