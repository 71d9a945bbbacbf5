"""Robots so simple that their motion has a formula, and the rollouts that the engine tests share."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ee_dist.engines.contract import Engine, Rollout
from ee_dist.engines.drivers import Commands, Network, weight_count
from ee_dist.robots.model import Drive, Joint, Part, Robot, Sensor, Shape, Wiring, World
from ee_dist.robots.quadruped import quadruped
from ee_dist.robots.solids import box_inertia
from ee_dist.trials.log import Array, SensorLog, State

G = 9.81
MASS_KG = 2.0
RADIUS_M = 0.1
BOX_HALF_M = (0.1, 0.1, 0.05)


def ball(height_m: float = RADIUS_M, com_m: tuple[float, float, float] = (0.0, 0.0, 0.0), **world: float) -> Robot:
    """A free ball with its centre at ``height_m``."""
    part = Part("ball", MASS_KG, com_m, (0.008, 0.009, 0.01, 0, 0, 0), (Shape("sphere", (RADIUS_M,)),))
    sensors = (Sensor("height", "height", ""), Sensor("touch", "touch", "ball"))
    start = (0.0, 0.0, height_m)
    return Robot("ball", (part,), (), (), sensors, Wiring(()), World(**world), start_position_m=start)


def sled(**world: float) -> Robot:
    """A free box that lies on the floor on four round feet. (Bullet keeps too few contacts of a flat side that slides.)"""
    feet = tuple(Shape("sphere", (0.02,), (x, y, 0.02 - BOX_HALF_M[2])) for x in (-0.1, 0.1) for y in (-0.1, 0.1))
    part = Part("sled", MASS_KG, (0.0, 0.0, 0.0), box_inertia(MASS_KG, *BOX_HALF_M), feet)
    sensors = (Sensor("height", "height", ""), Sensor("speed", "speed_x", ""), Sensor("touch", "touch", "sled"))
    start = (0.0, 0.0, BOX_HALF_M[2])
    return Robot("sled", (part,), (), (), sensors, Wiring(()), World(**world), start_position_m=start)


def loose_drive(joint: str, rotor_inertia: float = 0.0) -> Drive:
    """A motor that does nothing: without gains or back-EMF."""
    return Drive(joint, 0.0, 0.0, 0.0, torque_limit=1.0, speed_limit=float("inf"), rotor_inertia=rotor_inertia)


def one_joint(kind: str, axis: tuple[float, float, float], rotor_inertia: float = 0.0, step_s: float = 0.002) -> Robot:
    """A part of 2 kg on a joint of a post fixed to the world. A hinge carries it 0.3 m below."""
    below = (0.0, 0.0, -0.3) if kind == "hinge" else (0.0, 0.0, 0.0)
    parts = (
        Part("post", 1.0, (0.0, 0.0, 0.0), (0.01, 0.01, 0.01, 0, 0, 0)),
        Part("bob", MASS_KG, below, (0.01, 0.012, 0.008, 0, 0, 0)),
    )
    joint = Joint("joint", kind, "post", "bob", (0.0, 0.0, 0.0), axis, -10.0, 10.0)
    sensors = (Sensor("position", "position", "joint"), Sensor("velocity", "velocity", "joint"))
    return Robot(
        "one_joint",
        parts,
        (joint,),
        (loose_drive("joint", rotor_inertia),),
        sensors,
        Wiring((0,)),
        World(has_floor=False),
        free_base=False,
        start_position_m=(0.0, 0.0, 1.0),
        time_step_s=step_s,
    )


def no_commands(robot: Robot) -> Commands:
    return Commands(np.zeros((1, len(robot.drives))))


def at(
    joints: list[float], speeds: list[float], pose: list[float] | None = None, twist: list[float] | None = None
) -> State:
    """A start state from plain lists."""
    base = None if pose is None else np.array(pose)
    return State(np.array(joints), np.array(speeds), base, None if twist is None else np.array(twist))


def run(
    engine: Engine, robot: Robot, steps: int, start: State | None = None, commands: Array | None = None
) -> SensorLog:
    """One rollout, with poses."""
    driver = no_commands(robot) if commands is None else Commands(commands)
    (log,) = engine.rollout([Rollout(robot, driver, steps, start=start, pose=True)])
    return log


def calm_commands(seed: int, steps: int, step_s: float = 0.01) -> Array:
    """Slow sines on the quadruped's eight joints, faded in over a second."""
    rng = np.random.default_rng(seed)
    t = np.arange(steps)[:, None] * step_s
    rate, phase, size = rng.uniform(0.2, 0.6, 8), rng.uniform(0, 2 * np.pi, 8), rng.uniform(0.1, 0.35, 8)
    return size * np.sin(2 * np.pi * rate * t + phase) * np.minimum(t, 1.0)


def network(seed: int) -> Network:
    """A random controller of the quadruped."""
    return Network(tuple(np.random.default_rng(seed).uniform(-1, 1, weight_count(8, 8))))


def mixed_models() -> list[Robot]:
    """Quadrupeds that differ in what an engine keeps apart: structure, masses, floor, gravity."""
    whole = quadruped()
    tilted_inertia = (0.007, 0.012, 0.016, 0.001, -0.0005, 0.0008)
    return [
        whole,
        whole.with_part("body", mass_kg=2.4),
        whole.without("upper_rear_left"),
        whole.without("lower_front_right").with_part("body", com_m=(0.02, -0.01, 0.0)),
        whole.with_part("body", com_m=(0.02, -0.01, 0.005)),
        whole.with_part("body", inertia_kg_m2=tilted_inertia),
        whole.with_world(friction=0.3),
        whole.with_world(tilt_x_rad=0.15, tilt_y_rad=-0.1),
        whole.with_world(compliance_m_n=2e-4),
        whole.with_world(push_x_n=1.5, drag_n_s_m=3.0),
        whole.map_drive("hip_front_left", lambda d: replace(d, rotor_inertia=0.03, coulomb=0.2)),
    ]
