"""Robots that are measured here, by simulation, and the problem that each way of comparing makes of them."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np

from ee_dist.discrepancy.measured_trial import MeasuredTrial, driver_of, setup_of
from ee_dist.discrepancy.problem import Problem
from ee_dist.discrepancy.ways.force_balance.problem import ForceBalance
from ee_dist.discrepancy.ways.free_run.problem import FreeRun
from ee_dist.discrepancy.ways.open_loop.problem import OpenLoop
from ee_dist.discrepancy.ways.open_loop.stretches import at_most, stretches
from ee_dist.effects.catalogue import Hypothesis, term
from ee_dist.engines.contract import Engine
from ee_dist.engines.drivers import Commands
from ee_dist.engines.mujoco.engine import MuJoCoEngine
from ee_dist.engines.one_joint import OneJointEngine
from ee_dist.evaluation.jobs import Evaluator
from ee_dist.evaluation.physical import PhysicalRobot
from ee_dist.evaluation.serial import SerialEvaluator
from ee_dist.robots.describe import load_robot
from ee_dist.robots.linear_stage import linear_stage
from ee_dist.robots.model import Robot
from ee_dist.robots.quadruped_lab import quadruped_lab
from ee_dist.robots.servo_pendulum import servo_pendulum
from ee_dist.trials.excitation import Excitation
from ee_dist.trials.log import Array
from ee_dist.trials.noise import with_noise

ARM = """<robot name="small_arm">
  <link name="table"/>
  <link name="upper"><inertial><origin xyz="0.12 0 0"/><mass value="0.5"/>
    <inertia ixx="0.0002" iyy="0.0025" izz="0.0025" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="lower"><inertial><origin xyz="0.1 0 0"/><mass value="0.3"/>
    <inertia ixx="0.0001" iyy="0.0012" izz="0.0012" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="shoulder" type="revolute"><parent link="table"/><child link="upper"/><origin xyz="0 0 0.3"/>
    <axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="12" velocity="8"/></joint>
  <joint name="elbow" type="revolute"><parent link="upper"/><child link="lower"/><origin xyz="0.25 0 0"/>
    <axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="8" velocity="8"/></joint>
</robot>"""
FORCE_NOISE = 0.002
"""Noise of a measured motor force, as a share of the largest one that the drive can give."""


@dataclass(frozen=True)
class Sample:
    """A robot, what it is made to do, what is hidden in it for the tests, and the ways in which it can be compared."""

    robot: Robot
    plan: tuple[Excitation | Array, ...]
    hidden: Hypothesis
    ways: tuple[str, ...]


def two_joint_arm() -> Robot:
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "arm.urdf"
        file.write_text(ARM)
        drives = {
            "shoulder": {"kp": 25, "kd": 0.8, "rotor_inertia": 0.005},
            "elbow": {"kp": 15, "kd": 0.5, "rotor_inertia": 0.004},
        }
        return load_robot({"urdf": str(file), "free_base": False, "time_step_s": 0.004, "drives": drives})[0]


def motor_forces(robot: Robot, commands: Array, joints: Array) -> Array:
    """(T, M) what the motors give along a motion, as a meter of their current would tell: before any friction."""
    p = {
        n: np.array([getattr(d, n) for d in robot.drives])
        for n in ("kp", "kd", "torque_limit", "speed_limit", "strength")
    }
    speed = np.concatenate([np.zeros((1, joints.shape[1])), np.diff(joints, axis=0)]) / robot.time_step_s
    seen = speed
    if robot.laws:
        # The controller of the stage takes the difference of its readings over two samples.
        past = np.concatenate([joints[:1], joints[:1], joints[:-2]])
        seen = (joints - past) / (2 * robot.time_step_s)
    asked = np.clip(p["kp"] * (commands - joints) - p["kd"] * seen, -p["torque_limit"], p["torque_limit"])
    return asked - p["torque_limit"] / p["speed_limit"] * speed


def sines(robot: Robot, amplitude: float, seconds: float) -> tuple[Array, ...]:
    """Commands (T, M) of two motions, from rest at zero: two sines a joint, every joint at its own pace."""
    t = np.arange(0, seconds, robot.time_step_s)[:, None]
    pace = 1.0 + 0.3 * np.arange(len(robot.drives))
    rise = np.minimum(1.0, t / 0.4) ** 2
    pairs = ((4.3, 9.7), (6.1, 2.9))
    return tuple(rise * amplitude * (0.7 * np.sin(a * pace * t) + 0.3 * np.sin(b * pace * t)) for a, b in pairs)


def measure(sample: Sample, hidden: Hypothesis, seed: int = 0) -> tuple[MeasuredTrial, ...]:
    """Trials of the robot with a hidden change; a fixed robot's joints as read, and the forces of its motors."""
    robot, engine = sample.robot, engine_for(sample.robot)
    out = []
    for k, e in enumerate(sample.plan):
        held, driver = (setup_of(e), driver_of(e, robot)) if isinstance(e, Excitation) else ((), Commands(e))
        steps = e.steps(robot) if isinstance(e, Excitation) else len(e)
        hardware = PhysicalRobot(engine, robot, (*hidden, *held), np.random.SeedSequence([seed, k]))
        log = hardware.trial(driver, steps)
        if isinstance(driver, Commands) and not robot.free_base:
            assert log.joints is not None
            rng = np.random.default_rng([seed, k, 1])
            force = motor_forces(robot, driver.values, log.joints)
            limit = np.array([d.torque_limit for d in robot.drives])
            force = force + FORCE_NOISE * limit * rng.standard_normal(force.shape)
            read = np.stack([log.sensors[:, c] for c, s in enumerate(robot.sensors) if s.kind == "position"], axis=1)
            log = replace(log, joints=read, torques=force)
        out.append(MeasuredTrial(f"motion {k}", log, driver, held))
    return tuple(out)


def engine_for(robot: Robot) -> Engine:
    return OneJointEngine(1024) if len(robot.motor_names) == 1 else MuJoCoEngine(1)


def evaluator_for(robot: Robot) -> Evaluator:
    return SerialEvaluator(engine_for(robot), 1024)


def problem_by(
    way: str, trials: tuple[MeasuredTrial, ...], robot: Robot, evaluator: Evaluator | None = None
) -> Problem:
    evaluator = evaluator or evaluator_for(robot)
    if way.startswith("open_loop"):
        whole = OpenLoop(trials, robot, evaluator)
        if way == "open_loop":
            return whole
        return whole.of(trials, at_most(stretches(robot, trials, whole.window, 0.7), 2))
    return FreeRun(trials, robot, evaluator) if way == "free_run" else ForceBalance(trials, robot)


@cache
def samples() -> dict[str, Sample]:
    everything = ("open_loop", "free_run", "force_balance")
    pendulum, arm = with_noise(servo_pendulum(), 5e-5), with_noise(two_joint_arm(), 2e-4)
    # A stiff controller answers a wrong first position with a kick: its encoder is a good one.
    stage = with_noise(linear_stage(), 3e-6)
    return {
        "pendulum": Sample(
            pendulum,
            sines(pendulum, 1.0, 3.0),
            (term("coulomb_friction", "servo", torque_nm=0.06),),
            everything,
        ),
        "stage": Sample(
            stage,
            sines(stage, 0.04, 2.0),
            (term("coulomb_friction", "carriage", torque_nm=20.0),),
            everything,
        ),
        "arm": Sample(
            arm,
            sines(arm, 0.6, 3.0),
            (term("coulomb_friction", "elbow", torque_nm=0.25),),
            everything,
        ),
        "quadruped": Sample(
            with_noise(quadruped_lab(), 0.02),
            (Excitation("multisine", 2.4, 0.8, 1, "stand"), Excitation("gait", 1.2, 0.7, 3, "stand")),
            (term("motor_weak", "knee_front_left", loss=0.4),),
            ("open_loop",),
        ),
    }


@cache
def measured(name: str) -> tuple[MeasuredTrial, ...]:
    return measure(samples()[name], samples()[name].hidden)


@cache
def problem(name: str, way: str) -> Problem:
    return problem_by(way, measured(name), samples()[name].robot)


CASES = [(name, way) for name in ("pendulum", "stage", "arm", "quadruped")
         for way in ("open_loop", "free_run", "force_balance") if name != "quadruped" or way == "open_loop"]  # fmt: skip
CASES += [("arm", "open_loop by stretches")]
