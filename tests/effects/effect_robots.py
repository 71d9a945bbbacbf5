"""Robots small enough for pencil and paper, and a bench to run them on."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from ee_dist.effects.catalogue import Term, apply
from ee_dist.engines.contract import Engine, Rollout
from ee_dist.engines.drivers import Commands
from ee_dist.robots.model import Drive, Joint, Part, Robot, Sensor, Shape, Wiring, World
from ee_dist.robots.solids import box_inertia
from ee_dist.trials.log import Array, SensorLog, State

MASS_KG, ARM_M, G = 2.0, 0.3, 9.81
POINT = (1e-9, 1e-9, 1e-9, 0.0, 0.0, 0.0)
FRAME = Part("frame", 1.0, (0.0, 0.0, 0.0), (1e-3, 1e-3, 1e-3, 0.0, 0.0, 0.0))
SLACK: dict[str, Any] = {"kp": 0.0, "ki": 0.0, "kd": 0.0, "torque_limit": 100.0, "speed_limit": math.inf}


def _fixed_robot(part: Part, joint: Joint, drive: Drive, time_step_s: float) -> Robot:
    sensors = tuple(
        Sensor(kind, kind, "joint", unit) for kind, unit in (("position", "m"), ("velocity", "m/s"), ("torque", "N"))
    )
    return Robot(
        name="one_joint",
        parts=(FRAME, part),
        joints=(joint,),
        drives=(drive,),
        sensors=sensors,
        wiring=Wiring((0,)),
        world=World(has_floor=False),
        free_base=False,
        time_step_s=time_step_s,
    )


def slider(time_step_s: float = 0.001, **drive: Any) -> Robot:
    """2 kg on a horizontal slide of +-10 m; a drive that does nothing unless told."""
    part = Part("carriage", MASS_KG, (0.0, 0.0, 0.0), (1e-3, 1e-3, 1e-3, 0.0, 0.0, 0.0))
    joint = Joint("joint", "slide", "frame", "carriage", (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), -10.0, 10.0)
    return _fixed_robot(part, joint, Drive("joint", **(SLACK | drive)), time_step_s)


def lever(time_step_s: float = 0.001, **drive: Any) -> Robot:
    """2 kg at the end of a level arm of 0.3 m: gravity pulls towards larger angles with 2 kg * g * 0.3 m * cos(angle)."""
    part = Part("arm", MASS_KG, (ARM_M, 0.0, 0.0), POINT)
    joint = Joint("joint", "hinge", "frame", "arm", (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), -3.0, 3.0)
    return _fixed_robot(part, joint, Drive("joint", **(SLACK | drive)), time_step_s)


def block(height_m: float = 5.0, shape: Shape | None = None, time_step_s: float = 0.001, **world: Any) -> Robot:
    """2 kg, free to move, with a touch sensor; it starts at ``height_m``. Its only drive turns a very small wheel."""
    body = Part("body", MASS_KG, (0.0, 0.0, 0.0), box_inertia(MASS_KG, 0.1, 0.1, 0.1), (shape,) if shape else ())
    wheel = Part("wheel", 1e-3, (0.0, 0.0, 0.0), (1e-4, 1e-4, 1e-4, 0.0, 0.0, 0.0))
    joint = Joint("joint", "hinge", "body", "wheel", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), -1.0, 1.0)
    return Robot(
        name="block",
        parts=(body, wheel),
        joints=(joint,),
        drives=(Drive("joint", **SLACK),),
        sensors=(Sensor("touch", "touch", "body"), Sensor("height", "height", "body", "m")),
        wiring=Wiring((0,)),
        world=World(**world),
        start_position_m=(0.0, 0.0, height_m),
        time_step_s=time_step_s,
    )


class Bench:
    """Runs a robot under effects and gives its log."""

    def __init__(self, engine: Engine) -> None:
        self.engine = engine

    def run(
        self,
        robot: Robot,
        *terms: Term,
        steps: int = 1000,
        command: float | Array = 0.0,
        position: float = 0.0,
        speed: float = 0.0,
        twist: tuple[float, ...] | None = None,
        enabled: Array | None = None,
        seed: int | None = None,
    ) -> SensorLog:
        """``command`` holds (a number) or is followed (steps, M); the rest is where the run starts."""
        motors = len(robot.drives)
        values = np.broadcast_to(np.asarray(command, dtype=float).reshape(-1, 1), (np.size(command), motors))
        start = State(np.full(motors, position), np.full(motors, speed))
        if robot.free_base:
            pose = np.array([*robot.start_position_m, *robot.start_rotation])
            start = replace(start, base_pose=pose, base_twist=np.array(twist or (0.0,) * 6))
        rollout = Rollout(apply(robot, terms), Commands(values), steps, seed, start, pose=True, enabled=enabled)
        (log,) = self.engine.rollout([rollout])
        assert log.finite
        return log
