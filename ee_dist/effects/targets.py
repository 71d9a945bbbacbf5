"""Where an effect can act on a robot."""

from __future__ import annotations

import math

from ee_dist.robots.model import Robot


def parts(robot: Robot) -> tuple[str, ...]:
    """Parts whose mass can show: all but a root that is bolted down."""
    return tuple(p.name for p in robot.parts[0 if robot.free_base else 1 :])


def carried_parts(robot: Robot) -> tuple[str, ...]:
    """Parts that hang on a joint and so can break off, root part left out."""
    return tuple(p.name for p in robot.parts[1:])


def motors(robot: Robot) -> tuple[str, ...]:
    return robot.motor_names


def motors_with_speed_limit(robot: Robot) -> tuple[str, ...]:
    return tuple(d.joint for d in robot.drives if math.isfinite(d.speed_limit))


def motors_with_torque_limit(robot: Robot) -> tuple[str, ...]:
    return tuple(d.joint for d in robot.drives if math.isfinite(d.torque_limit))


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
    """``a+b``: two different motors, in the order of the robot."""
    names = robot.motor_names
    return tuple(f"{a}+{b}" for i, a in enumerate(names) for b in names[i + 1 :])


def floor(robot: Robot) -> tuple[str, ...]:
    return ("floor",) if robot.world.has_floor else ()
