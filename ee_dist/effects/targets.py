"""Where an effect can act on a robot."""

from __future__ import annotations

from ee_dist.robots.model import Robot


def whole_robot(robot: Robot) -> tuple[str, ...]:
    return ("",)


def parts(robot: Robot) -> tuple[str, ...]:
    return tuple(p.name for p in robot.parts)


def carried_parts(robot: Robot) -> tuple[str, ...]:
    """Parts that hang on a joint and so can break off, root part left out."""
    return tuple(p.name for p in robot.parts[1:])


def motors(robot: Robot) -> tuple[str, ...]:
    return robot.motor_names


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
