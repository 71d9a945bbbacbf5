"""A pole that stands upright: what is off in a measured start grows, and is no effect."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from ee_dist.discrepancy.evidence.left import leftovers
from ee_dist.discrepancy.explain import NOTHING_MISSING, explain
from ee_dist.discrepancy.measured_trial import MeasuredTrial
from ee_dist.discrepancy.problem import error
from ee_dist.discrepancy.search.candidates import candidate
from ee_dist.discrepancy.ways.free_run.problem import FreeRun
from ee_dist.discrepancy.ways.free_run.starts import GROWN
from ee_dist.discrepancy.ways.free_run.windows import RESTART_S
from ee_dist.effects.catalogue import Hypothesis, apply, term
from ee_dist.engines.contract import Rollout
from ee_dist.engines.drivers import Commands
from ee_dist.engines.mujoco.engine import MuJoCoEngine
from ee_dist.evaluation.serial import SerialEvaluator
from ee_dist.robots.describe import load_robot
from ee_dist.robots.model import Robot
from ee_dist.trials.log import SensorLog, State

POLE = """<robot name="pole"><link name="stand"/>
  <link name="rod"><inertial><origin xyz="0 0 {top}"/><mass value="0.3"/>
    <inertia ixx="0.0005" iyy="0.0005" izz="0.0001" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="hinge" type="revolute"><parent link="stand"/><child link="rod"/><origin xyz="0 0 0.5"/>
    <axis xyz="0 1 0"/><limit lower="-3" upper="3" effort="5" velocity="50"/></joint></robot>"""
STEP_S, ROWS, NOISE = 0.005, 200, 2e-4


def pole(folder: Path, top: float) -> Robot:
    file = folder / "pole.urdf"
    file.write_text(POLE.format(top=top))
    drives = {"hinge": {"command": "torque"}}
    robot = load_robot({"urdf": str(file), "free_base": False, "time_step_s": STEP_S, "drives": drives})[0]
    return replace(robot, sensors=tuple(s for s in robot.sensors if s.kind == "position"))


def problem(robot: Robot, hidden: Hypothesis = (), rows: int = ROWS, apart: float = 0.004) -> FreeRun:
    """Ten falls (or swings) from rest, their positions read with noise."""
    evaluator, rng = SerialEvaluator(MuJoCoEngine(1), 1024), np.random.default_rng(0)
    commands = Commands(np.zeros((rows, 1)))
    starts = [State(np.array([apart * (k + 1) * (-1) ** k]), np.zeros(1)) for k in range(10)]
    rollouts = [Rollout(apply(robot, hidden), commands, rows, start=s, pose=True) for s in starts]
    trials = []
    for k, log in enumerate(evaluator.engine.rollout(rollouts)):
        assert isinstance(log, SensorLog)
        read = log.sensors + NOISE * rng.standard_normal(log.sensors.shape)
        trials.append(MeasuredTrial(f"fall {k}", replace(log, sensors=read, joints=read), commands, commands_held=True))
    return FreeRun(tuple(trials), robot, evaluator, windows_s=RESTART_S)


def test_the_truth_of_an_upright_pole_is_at_the_floor(tmp_path: Path) -> None:
    found = problem(pole(tmp_path, 0.15))
    residual = found.residuals([()])[0]
    floor, source = found.noise_floor()
    assert floor**2 > GROWN
    assert "start of each window" in source
    assert error(residual) < 1.2 * floor
    assert not leftovers(found, residual)


def test_a_hanging_pole_keeps_the_floor_of_its_noise(tmp_path: Path) -> None:
    found = problem(pole(tmp_path, -0.15), rows=4 * ROWS)
    assert found.noise_floor()[0] == 1.0
    assert not found.layout.by_segment


def test_friction_that_tames_a_wrong_start_is_not_missing(tmp_path: Path) -> None:
    """It makes the prediction of an upright pole better, and is not there."""
    # It balances: all that a prediction does is what noise made of its start.
    found = problem(pole(tmp_path, 0.15), rows=4 * ROWS, apart=0.0)
    friction = candidate(found.robot, "viscous_friction", "hinge")
    alone, with_it = found.residuals([(), (friction.term([0.03]),)])
    assert error(with_it) < error(alone)
    assert explain(found, [friction]).verdict == NOTHING_MISSING


def test_what_is_missing_is_still_seen(tmp_path: Path) -> None:
    hidden = (term("viscous_friction", "hinge", damping_nm_s_rad=0.05),)
    found = problem(pole(tmp_path, 0.15), hidden)
    plain, true = found.residuals([(), hidden])
    assert leftovers(found, plain)
    assert not leftovers(found, true)
