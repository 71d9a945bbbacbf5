"""Which way of comparing ``task.by=auto`` takes, by what was recorded and how the joints are led."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ee_dist.discrepancy.measured_trial import MeasuredTrial
from ee_dist.discrepancy.ways.force_balance.motion import Motion, Processing, motion_of
from ee_dist.discrepancy.ways.force_balance.problem import ForceBalance
from ee_dist.discrepancy.ways.free_run.problem import FreeRun
from ee_dist.discrepancy.ways.free_run.windows import RESTART_S
from ee_dist.robots.describe import load_robot
from ee_dist.robots.model import Robot
from ee_dist.robots.servo_pendulum import servo_pendulum
from ee_dist.tasks.config import Config, ConfigError, EngineConfig, EvaluatorConfig
from ee_dist.tasks.measurements import Measurements
from ee_dist.tasks.pool import chosen
from ee_dist.tasks.ways import AUTO, way_of
from ee_dist.trials.log import SensorLog

ROWS = 300
ARM = Path(__file__).parents[2] / "docs" / "examples" / "arm.urdf"


def measured(command: str) -> Measurements:
    robot = servo_pendulum()
    robot = replace(robot, drives=tuple(replace(d, command=command) for d in robot.drives))
    return Measurements(robot, (MeasuredTrial("a", log(robot)),), (), (), None, Path())


def log(robot: Robot) -> SensorLog:
    t = np.arange(ROWS) * robot.time_step_s
    commands = np.tile(0.1 * np.sin(t)[:, None], (1, len(robot.drives)))
    sensors = np.tile(0.1 * np.cos(t)[:, None], (1, len(robot.sensors)))
    joints = 0.1 * np.cos(t)[:, None]
    units = tuple(s.unit for s in robot.sensors)
    return SensorLog(t, sensors, commands, robot.sensor_names, units, robot.motor_names, joints=joints)


@pytest.mark.parametrize(
    ("command", "way"), [("position", "open_loop"), ("speed", "open_loop"), ("torque", "free_run")]
)
def test_what_was_commanded_says_what_is_compared(command: str, way: str) -> None:
    assert way_of(measured(command), AUTO).name == way


def test_of_a_real_robot_with_nothing_but_its_motion_a_free_run_tells_most() -> None:
    """Of a simulation, of a robot with another sensor, and of one that walks off, open loop."""
    simulated = measured("position")
    real = replace(simulated, trials=tuple(replace(t, commands_held=True) for t in simulated.trials))
    assert {s.kind for s in real.robot.sensors} == {"position", "velocity"}
    assert way_of(real, AUTO).name == "free_run" and way_of(simulated, AUTO).name == "open_loop"
    unknown = replace(real, trials=tuple(replace(t, commands_held=None) for t in real.trials))
    assert way_of(unknown, AUTO).name == "free_run"
    heated = replace(real.robot, sensors=(replace(real.robot.sensors[0], name="load", kind="motor_torque"),))
    assert way_of(replace(real, robot=heated), AUTO).name == "open_loop"
    blind = tuple(replace(t, log=replace(t.log, joints=None)) for t in real.trials)
    assert way_of(replace(real, trials=blind), AUTO).name == "open_loop"


def test_where_torques_were_recorded_beside_commands_it_is_said_that_they_can_be_compared() -> None:
    known = measured("position")
    logged = replace(known.trials[0].log, torques=np.ones((ROWS, len(known.robot.drives))))
    beside = replace(known, trials=(replace(known.trials[0], log=logged),))
    way = way_of(beside, AUTO)
    assert way.name == "open_loop" and "task.by=force_balance compares these" in way.why and "gains" not in way.why
    guessed = replace(beside.robot, assumed=((beside.robot.drives[0].joint, "kp"),))
    assert "gains, which the description only assumed" in way_of(replace(beside, robot=guessed), AUTO).why
    assert "force_balance" not in way_of(known, AUTO).why
    (told,) = way.instead(True)
    assert "task.by=force_balance" in told
    assert not way.instead(False) and not way_of(known, AUTO).instead(True)


def test_where_torques_lead_the_model_starts_anew_and_is_searched_as_it_is() -> None:
    config = Config(engine=EngineConfig("mujoco", 1), evaluator=EvaluatorConfig("serial"))
    free, held = (way_of(measured(c), "free_run").make(measured(c), config) for c in ("torque", "position"))
    assert isinstance(free, FreeRun) and isinstance(held, FreeRun)
    assert free.searched is free and held.searched is not held
    assert len(free.pieces) > 1 and len(held.pieces) == 1
    assert max(len(p.log) for p in free.pieces) * free.robot.time_step_s <= RESTART_S + 0.1


def test_without_commands_forces_are_balanced_and_nothing_can_be_simulated() -> None:
    """Arms led by a controller of their own are often recorded with torques and without what the controller was told."""
    known = measured("position")
    silent = replace(known.trials[0].log, commands=np.full_like(known.trials[0].log.commands, np.nan))
    torques = 0.01 * np.sin(silent.times_s)[:, None]
    with_torques = replace(known, trials=(MeasuredTrial("a", replace(silent, torques=torques)),))
    assert way_of(with_torques, AUTO).name == "force_balance"
    for by in ("open_loop", "free_run"):
        with pytest.raises(ConfigError, match=rf"task.by={by}: trial a holds no commands, .*task.by=force_balance"):
            way_of(with_torques, by)
    with pytest.raises(ConfigError, match="trial a holds no commands"):
        way_of(replace(known, trials=(MeasuredTrial("a", silent),)), AUTO)


def test_where_some_torques_are_missing_it_is_said_which() -> None:
    drives = {joint: {"command": "torque", "torque_limit": 9.0} for joint in ("shoulder", "elbow")}
    robot, _ = load_robot({"urdf": str(ARM), "drives": drives})
    rows = log(servo_pendulum()).times_s[:, None] * np.ones(len(robot.drives))
    sensors = np.tile(rows[:, :1], (1, len(robot.sensors)))
    units = tuple(s.unit for s in robot.sensors)
    own = SensorLog(rows[:, 0], sensors, rows, robot.sensor_names, units, robot.motor_names, joints=rows)
    some = np.full((ROWS, len(robot.drives)), 0.1)
    some[:, -1] = np.nan
    partly, none = (
        Measurements(robot, (MeasuredTrial("a", replace(own, torques=torques)),), (), (), None, Path())
        for torques in (some, None)
    )
    last = robot.motor_names[-1]
    way = way_of(partly, AUTO)
    assert way.name == "free_run" and f"torques were recorded, and none of {last}" in way.why
    assert "torques" not in way_of(none, AUTO).why


def test_a_way_says_that_it_cannot_see_what_was_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    config = Config(engine=EngineConfig("mujoco", 1), evaluator=EvaluatorConfig("serial"))
    free = way_of(measured("torque"), "free_run").make(measured("torque"), config)
    with pytest.raises(ConfigError, match=r"task.by=free_run knows no faults of sensors.*task.by=open_loop compares"):
        chosen(free, (), ("sensor_delay",))
    assert chosen(free, (), ("coulomb_friction",))
    monkeypatch.setattr(free, "shows", lambda *_: False)
    with pytest.raises(
        ConfigError, match=r"task.by=free_run sees nothing of it in these data, so that nothing is left"
    ):
        chosen(free, (), ("coulomb_friction",))


@pytest.mark.parametrize(("times", "way"), [(1.0, "free_run"), (0.2, "force_balance"), (3.0, "force_balance")])
def test_where_gravity_and_inertia_cancel_torques_are_a_poor_witness(times: float, way: str) -> None:
    """A pendulum that swings at its own frequency needs no torque; at another one it does."""
    known = measured("torque")
    robot = known.robot
    dt = robot.time_step_s
    t = np.arange(4000) * dt

    def moved(rad_s: float) -> tuple[SensorLog, Motion]:
        swing = 0.1 * np.sin(rad_s * t)[:, None]
        sensors = np.tile(swing, (1, len(robot.sensors)))
        new = replace(log(robot), times_s=t, sensors=sensors, joints=swing, commands=0.01 * swing, torques=0.01 + swing)
        return new, motion_of(MeasuredTrial("a", new), robot, Processing.for_rate(dt))

    def own() -> float:
        """Where weight and inertia are the same share of the position."""
        _, motion = moved(1.0)
        floating = replace(robot, world=replace(robot.world, gravity_m_s2=0.0))
        inertia = motion.needed(floating)[1]
        weight = motion.needed(robot)[1] - inertia
        return float(np.sqrt(np.std(weight) / np.std(inertia)))

    trials = (MeasuredTrial("a", moved(times * own())[0]),)
    found = way_of(replace(known, trials=trials), AUTO)
    assert found.name == way
    assert ("cancel" in found.why) == (way == "free_run")
    said = ForceBalance(trials, robot).notes
    assert any("cancel" in line for line in said) == (way == "free_run")
