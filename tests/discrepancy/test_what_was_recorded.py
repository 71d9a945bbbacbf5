"""What is said of the measurements themselves: torques without weight, joints at rest, trials too short to compare."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from way_samples import measured, problem_by, samples

from ee_dist.discrepancy.accounts.of_compare import compare_account
from ee_dist.discrepancy.compare import circumstances, compare
from ee_dist.discrepancy.measured_trial import MeasuredTrial
from ee_dist.discrepancy.ways.force_balance.problem import ForceBalance
from ee_dist.effects import apply, term
from ee_dist.engines.drivers import Commands
from ee_dist.measurements.need import torques_needed
from ee_dist.recording.records import HARDWARE, TrialRecord
from ee_dist.recording.writer import RunWriter
from ee_dist.robots.describe import robot_of
from ee_dist.robots.model import Robot
from ee_dist.tasks.config import Config
from ee_dist.tasks.measurements import load
from ee_dist.trials.log import LogError


def trials_without_weight(
    robot: Robot, trials: tuple[MeasuredTrial, ...], at: tuple[float, ...] = (1.0, 1.0)
) -> tuple[MeasuredTrial, ...]:
    """The same motions with torques as a controller reports them that compensates gravity, ``at`` each joint so much of it."""
    floating = replace(robot, world=replace(robot.world, gravity_m_s2=0.0))
    out = []
    for t in trials:
        assert t.log.joints is not None and t.log.torques is not None
        weight = torques_needed(robot, t.log.joints, robot.time_step_s)[0]
        weight = weight - torques_needed(floating, t.log.joints, robot.time_step_s)[0]
        out.append(replace(t, log=replace(t.log, torques=t.log.torques - weight * at)))
    return tuple(out)


def test_torques_that_carry_no_weight_are_told_before_anything_is_believed() -> None:
    robot, trials = samples()["arm"].robot, measured("arm")
    assert not ForceBalance(trials, robot).doubts
    light = trials_without_weight(robot, trials)
    p = ForceBalance(light, robot)
    assert "gravity_m_s2: 0" in p.doubts
    told = compare_account(p, compare(p, p.residuals([()])[0]), ())
    assert any(line.startswith("Before this is believed: the measured torques do not carry") for line in told.first)
    floating = replace(robot, world=replace(robot.world, gravity_m_s2=0.0))
    assert not ForceBalance(light, floating).doubts


def test_a_base_bolted_on_by_another_side_is_told_before_anything_is_believed() -> None:
    robot, trials = samples()["arm"].robot, measured("arm")
    for side in ("x_up", "x_down", "upside_down"):
        hung = apply(robot, (term("base_turned", side),))
        p = ForceBalance(trials, hung)
        assert "bolted on by another side" in p.doubts
        # Turned by that, it carries what it should.
        at = p.doubts.split("base_turned@")[1].split("'")[0]
        assert not ForceBalance(trials, apply(hung, (term("base_turned", at),))).doubts


@pytest.mark.parametrize(("at", "name"), [((1.0, 0.0), "shoulder"), ((0.0, 1.0), "elbow")])
def test_one_joint_without_its_weight_is_named_and_gravity_is_not_put_off(at: tuple[float, ...], name: str) -> None:
    robot, trials = samples()["arm"].robot, measured("arm")
    said = ForceBalance(trials_without_weight(robot, trials, at), robot).doubts
    assert said.startswith(f"the torques measured at {name} do not carry the weight that the model has there (")
    assert "gravity" not in said
    # A weight that is a third off is a heavy part, and no other quantity.
    assert not ForceBalance(trials_without_weight(robot, trials, (0.3, 0.3)), robot).doubts


def held(trial: MeasuredTrial, every: int) -> MeasuredTrial:
    """The trial as from a log with seldom rows: commands held between them, sensors on straight lines."""
    log = trial.log
    read = np.arange(len(log)) % every == 0
    rows = np.arange(len(log)) // every * every
    at = np.flatnonzero(read)
    sensors = np.stack([np.interp(np.arange(len(log)), at, s[at]) for s in log.sensors.T], axis=1)
    log = replace(log, commands=log.commands[rows], sensors=sensors, filled=~read)
    return replace(trial, log=log, driver=Commands(log.commands.copy()))


@pytest.mark.parametrize("name", ["pendulum", "arm"])
def test_a_joint_moves_although_its_command_stands_still_between_two_rows(name: str) -> None:
    sample = samples()[name]
    positions = tuple(s for s in sample.robot.sensors if s.kind == "position")
    robot = replace(sample.robot, sensors=positions)
    keep = [sample.robot.sensors.index(s) for s in positions]
    trials = []
    for t in measured(name):
        names = tuple(s.name for s in positions)
        log = replace(t.log, sensors=t.log.sensors[:, keep], sensor_names=names, sensor_units=("rad",) * len(names))
        trials.append(held(replace(t, log=log), 5))
    p = problem_by("open_loop", tuple(trials), robot)
    found = {r.name: r.values for r in compare(p, p.residuals([()])[0]).regimes}
    assert found["moving"] > 0.6
    assert found["moving up"] == pytest.approx(found["moving down"], abs=0.2)
    # The same speed as where it was read, whatever was commanded.
    t = trials[0].log
    truth = np.gradient(measured(name)[0].log.joints, robot.time_step_s, axis=0)
    around = circumstances(p, 0)
    inner = slice(40, -40)
    assert np.corrcoef(around.speed[inner, 0], truth[inner, 0])[0, 1] > 0.95
    assert np.abs(around.speed).max() < 3 * np.abs(truth).max() and len(t) == len(around.speed)


def written(folder: Path, rows: tuple[int, ...]) -> Path:
    """A recording of the pendulum with trials of so many rows."""
    robot, (trial, *_) = samples()["pendulum"].robot, measured("pendulum")
    with RunWriter(folder / "measured.mcap", robot, {"task": "import"}) as writer:
        for k, n in enumerate(rows):
            log = trial.log.head(n)
            writer.trial(TrialRecord(k, f"motion {k}", HARDWARE, Commands(log.commands.copy()), log, ()))
    return folder / "measured.mcap"


def test_a_short_trial_stops_nobody(tmp_path: Path) -> None:
    found = load(Config(measured=str(written(tmp_path, (300, 20, 300, 30)))))
    assert [t.name for t in found.trials] == ["motion 0", "motion 2"]
    (said,) = [r for r in found.remarks if r.startswith("Left out")]
    assert "motion 1: 20 rows; at least 60 are needed; as short: motion 3" in said
    short = tmp_path / "short"
    short.mkdir()
    with pytest.raises(LogError, match=r"motion 0: 20 rows; at least 60 are needed"):
        load(Config(measured=str(written(short, (20, 30)))))


def test_a_description_says_of_which_kind_its_file_is(tmp_path: Path) -> None:
    """robot=urdf with a YAML that names an MJCF, as task=robot writes it, is no mistake."""
    (tmp_path / "swing.xml").write_text(
        '<mujoco model="swing"><worldbody><body name="arm"><joint name="h" axis="0 1 0" range="-60 60"/>'
        '<geom type="capsule" size="0.02 0.1" pos="0 0 -0.1"/></body></worldbody>'
        '<actuator><position joint="h" kp="20" kv="1"/></actuator></mujoco>'
    )
    (tmp_path / "robot.yaml").write_text("mjcf: swing.xml\nfree_base: false\n")
    robot, _ = robot_of("urdf", None, str(tmp_path / "robot.yaml"))
    assert robot.motor_names == ("h",)
