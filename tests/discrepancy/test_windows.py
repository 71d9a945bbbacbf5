"""A free run that starts anew: the truth is at the noise floor whatever a drive holds within it, and a search goes by it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from way_samples import evaluator_for, measure, samples

from ee_dist.discrepancy.accounts.of_improve import improve_account
from ee_dist.discrepancy.evidence.holdout import windows as windows_cut
from ee_dist.discrepancy.examine import Current
from ee_dist.discrepancy.explain import UNEXPLAINED, explain
from ee_dist.discrepancy.improve import improve
from ee_dist.discrepancy.measured_trial import MeasuredTrial, speeds_of
from ee_dist.discrepancy.problem import error
from ee_dist.discrepancy.search.candidates import candidate
from ee_dist.discrepancy.search.search import Search
from ee_dist.discrepancy.search.slopes import SAME, tells_nothing
from ee_dist.discrepancy.ways.free_run.at_rest import ASTRAY
from ee_dist.discrepancy.ways.free_run.problem import FreeRun
from ee_dist.discrepancy.ways.free_run.windows import RESTART_S
from ee_dist.effects.catalogue import apply, term
from ee_dist.engines.contract import Rollout
from ee_dist.engines.drivers import Commands
from ee_dist.robots.linear_stage import linear_stage
from ee_dist.robots.model import Robot
from ee_dist.trials.log import SensorLog


def trial_of(robot: Robot, seconds: float = 4.0) -> MeasuredTrial:
    """A quick motion, measured without noise."""
    steps = round(seconds / robot.time_step_s)
    t = np.arange(steps) * robot.time_step_s
    top = robot.joint(robot.drives[0].joint).upper
    size = 0.4 * min(top, 1.0)
    sent = size * (np.sin(2 * np.pi * 0.9 * t) + 0.4 * np.sign(np.sin(2 * np.pi * 1.7 * t)))[:, None]
    commands = np.repeat(sent, len(robot.drives), axis=1)
    evaluator = evaluator_for(robot)
    (log,) = evaluator.engine.rollout([Rollout(robot, Commands(commands), steps, pose=True)])  # type: ignore[attr-defined]
    assert isinstance(log, SensorLog)
    return MeasuredTrial("quick", log, Commands(commands))


def quiet(robot: Robot) -> Robot:
    return replace(robot, sensors=tuple(replace(s, noise=0.0) for s in robot.sensors))


@pytest.mark.parametrize(
    "held", [{}, {"delay_s": 0.012}, {"delay_s": 0.095}, {"ki": 30.0}, {"backlash": 0.03}, {"compliance": 0.02}]
)
def test_what_a_drive_holds_goes_on_where_a_window_begins(held: dict[str, float]) -> None:
    robot = quiet(samples()["pendulum"].robot)
    robot = robot.map_drive(robot.drives[0].joint, lambda d: replace(d, **held))
    trial = trial_of(robot)
    whole = FreeRun((trial,), robot, evaluator_for(robot))
    windows = whole.searched
    assert isinstance(windows, FreeRun) and windows.windows_s == RESTART_S
    assert len(windows.segments) == 8
    range_ = float(np.ptp(trial.log.sensors[:, 0]))
    off = np.abs(windows.raw(windows.residuals([()])[0]))
    # Play and twist of a transmission come back within the run-up but for what they were in the middle of.
    assert off.mean() < (1e-6 if held.keys() <= {"delay_s", "ki"} else 2e-3) * range_


def test_what_is_fitted_to_some_windows_simulates_these_alone() -> None:
    """Every second window held out is half of the work, and the same values."""
    robot = quiet(samples()["pendulum"].robot)
    loose = robot.map_drive(robot.drives[0].joint, lambda d: replace(d, command="torque", delay_s=0.01))
    problem = FreeRun((trial_of(loose),), loose, evaluator_for(loose), windows_s=RESTART_S)
    cut, search = windows_cut(problem), Search(problem)
    seen = cut.seen(problem, 0)
    some = search.within(seen)
    assert some.pieces is not None and 2 * len(some.pieces) == len(problem.pieces)
    assert np.array_equal(some.everything, seen) and some.within(seen) is some
    models = [(), (term("coulomb_friction", loose.drives[0].joint, torque_nm=0.1),)]
    part, whole = some.residuals(models), search.residuals(models)
    assert np.array_equal(part[:, seen], whole[:, seen]) and not part[:, ~seen].any()


def test_the_beginning_of_long_trials_is_windows_from_all_over_them() -> None:
    robot = quiet(samples()["pendulum"].robot)
    loose = robot.map_drive(robot.drives[0].joint, lambda d: replace(d, command="torque"))
    problem = FreeRun((trial_of(loose, 12.0),), loose, evaluator_for(loose), windows_s=RESTART_S)
    brief = problem.beginning(8.0)
    assert isinstance(brief, FreeRun) and len(problem.pieces) == 24 and len(brief.pieces) == 8
    starts = [p.start_s for p in brief.pieces]
    assert starts[0] < 3.0 and starts[-1] > 9.0
    assert np.array_equal(brief.noise, problem.noise)
    assert problem.beginning(16.0) is problem, "two windows in three are hardly fewer"
    assert FreeRun((trial_of(loose, 12.0),), loose, evaluator_for(loose)).beginning(1.0).pieces[0].start_s == 0.0


def test_fits_end_where_starts_that_are_off_tell_no_more() -> None:
    """Where motions are not stable the floor is what starts do to whole windows: less than one of these tells nothing."""
    robot = quiet(samples()["pendulum"].robot)
    loose = robot.map_drive(robot.drives[0].joint, lambda d: replace(d, command="torque"))
    problem = FreeRun((trial_of(loose),), loose, evaluator_for(loose), windows_s=RESTART_S)
    everything = np.ones(len(problem.segment_of), dtype=bool)
    assert tells_nothing(problem, everything) == SAME
    problem.layout = replace(problem.layout, known=np.full(len(everything), 40.0), by_segment=True)
    starts = 2 * len(problem.segments)
    assert tells_nothing(problem, everything) == pytest.approx(SAME * 40.0 * len(everything) / starts)


def test_a_stage_without_a_sensor_of_speed_starts_with_the_speed_that_it_had() -> None:
    """Its controller saturates: a start that is off by half a step goes on for the whole record."""
    robot = quiet(linear_stage())
    trial = trial_of(robot, 1.0)
    assert not any(s.kind == "velocity" for s in robot.sensors)
    problem = FreeRun((trial,), robot, evaluator_for(robot))
    for p in (problem, problem.searched):
        assert np.abs(p.raw(p.residuals([()])[0])).max() < 1e-6 * np.ptp(trial.log.sensors[:, 0])


def test_where_positions_are_noisy_a_slope_is_that_about_a_row() -> None:
    robot = quiet(linear_stage())
    trial = trial_of(robot, 1.0)
    assert trial.log.joints is not None
    dt = robot.time_step_s
    behind = np.diff(trial.log.joints[:, 0]) / dt
    assert speeds_of(trial.log, robot)[1:, 0] == pytest.approx(behind)
    noisy = trial.log.joints + 1e-4 * np.random.default_rng(0).standard_normal(trial.log.joints.shape)
    found = speeds_of(replace(trial.log, joints=noisy), robot)
    np.testing.assert_allclose(found, np.gradient(noisy, dt, axis=0))


def test_a_search_goes_by_windows_and_says_what_the_whole_record_gives() -> None:
    sample = samples()["pendulum"]
    whole = FreeRun(measure(sample, sample.hidden), sample.robot, evaluator_for(sample.robot))
    windows = whole.searched
    assert windows.searched is windows and windows is whole.searched
    assert windows.natural_name == "mean absolute position error over 0.5 s"
    (line,) = windows.other_errors((), sample.hidden)
    before, after = (whole.told(error(r)) for r in whole.residuals([(), sample.hidden]))
    assert line == f"Run through without starting anew: model {before}, improved model {after}."
    (log, *_) = windows.simulated(())
    assert log is not None and len(log) == len(whole.measured[0].log), "seen is the whole motion"


def test_a_robot_that_nobody_leads_is_started_anew_and_searched_as_it_is() -> None:
    robot = quiet(samples()["pendulum"].robot)
    loose = robot.map_drive(robot.drives[0].joint, lambda d: replace(d, command="torque"))
    problem = FreeRun((trial_of(loose, 2.0),), loose, evaluator_for(loose), windows_s=RESTART_S)
    assert problem.searched is problem and problem.other_errors(()) == []


def test_what_was_sent_before_a_record_began_is_not_made_up() -> None:
    """A torque that comes late: before its first row the record knows none, and the first one held would throw the joint."""
    robot = quiet(samples()["pendulum"].robot)
    joint = robot.drives[0].joint
    robot = robot.map_drive(joint, lambda d: replace(d, command="torque", delay_s=0.05, kp=0.0))
    rest, steps = round(0.5 / robot.time_step_s), round(3.5 / robot.time_step_s)
    t = np.arange(steps) * robot.time_step_s
    sent = (t >= 0.5)[:, None] * 0.3 * np.cos(2 * np.pi * 1.1 * (t - 0.5))[:, None]
    (log,) = evaluator_for(robot).engine.rollout([Rollout(robot, Commands(sent), steps, pose=True)])  # type: ignore[attr-defined]
    began = log.part(rest, steps)
    began = replace(began, times_s=began.times_s - began.times_s[0])
    windows = FreeRun(
        (MeasuredTrial("from rest", began, Commands(began.commands)),), robot, evaluator_for(robot), windows_s=RESTART_S
    )
    off = np.abs(windows.raw(windows.residuals([()])[0]))
    assert len(windows.segments) == 6 and windows.pieces[0].rows[0] * robot.time_step_s >= 0.05
    assert off.mean() < 1e-4 * float(np.ptp(began.sensors[:, 0]))


def test_a_model_that_stands_still_is_told() -> None:
    """With friction enough a model leaves what a robot would that never moved, far less than one that falls."""
    robot = quiet(samples()["pendulum"].robot)
    loose = robot.map_drive(robot.drives[0].joint, lambda d: replace(d, command="torque"))
    problem = FreeRun((trial_of(loose, 2.0),), loose, evaluator_for(loose), windows_s=RESTART_S)
    stuck = (term("coulomb_friction", loose.drives[0].joint, torque_nm=50.0),)
    assert not any("stays where each window begins" in line for line in problem.remarks(()))
    (line,) = [line for line in problem.remarks(stuck) if "stays where each window begins" in line]
    off = problem.told(error(problem.residuals([stuck])[0]))
    assert f"this model is by {off}" in line and ASTRAY not in line
    # A torque that drives it away.
    (line,) = problem.remarks((term("offset_torque", loose.drives[0].joint, torque_nm=5.0),))[-1:]
    assert ASTRAY in line and "stays where each window begins" in line


def test_what_explains_by_standing_still_is_not_what_is_missing() -> None:
    """Of a load that hardly moves and a model that falls, friction which stops it takes nearly all of the error."""
    robot = quiet(samples()["pendulum"].robot)
    loose = robot.map_drive(robot.drives[0].joint, lambda d: replace(d, command="torque"))
    read = trial_of(loose, 2.0)
    steps = np.random.default_rng(0).normal(0.0, 2e-3, read.log.sensors.shape)
    log = replace(read.log, sensors=np.cumsum(steps, axis=0), joints=np.cumsum(steps[:, :1], axis=0))
    problem = FreeRun((replace(read, log=log),), loose, evaluator_for(loose), windows_s=RESTART_S)
    joint = loose.drives[0].joint
    friction = explain(problem, [candidate(loose, "coulomb_friction", joint)])
    (found,) = friction.candidates
    assert found.explained > 0.5 and friction.best is None and friction.verdict == UNEXPLAINED
    assert "says next to nothing of the motion" in found.why_not and friction.left
    # Who asks for it all the same is told before how much is explained.
    wanted = [candidate(loose, "coulomb_friction", joint)]
    improved = improve(problem, wanted, wanted=wanted)
    also = problem.other_errors(improved.ladder[0].terms, improved.terms)
    account = improve_account(problem, improved, also=also)
    assert "says next to nothing of the motion" in account.words[1] and not account.good
    assert sum("says next to nothing of the motion" in line for line in account.words) == 1


def test_a_motor_that_cannot_overcome_its_friction_is_told_run_through() -> None:
    """In windows it goes on with the speed that it is given, as far as a good model does; by itself it never sets out."""
    stage = samples()["stage"].robot
    joint = stage.drives[0].joint
    robot = quiet(stage).map_drive(joint, lambda d: replace(d, kp=2000.0, kd=400.0, torque_limit=100.0))
    times = np.arange(0.0, 6.0, robot.time_step_s)
    sent = Commands(np.where(times > 1, 0.1 * np.sin(np.pi * times / 2), 0.0)[:, None])
    (log,) = evaluator_for(robot).engine.rollout([Rollout(robot, sent, len(times), pose=True)])  # type: ignore[attr-defined]
    problem = FreeRun((MeasuredTrial("sine", log, sent),), robot, evaluator_for(robot), windows_s=RESTART_S)
    parts = tuple(candidate(robot, name, joint) for name in ("torque_limit", "coulomb_friction"))
    ends = [
        Current(parts, np.concatenate([parts[0].shares({"loss": 0.5}), parts[1].shares({"torque_nm": n})]))
        for n in (30.0, 50.2)
    ]
    rubs, stuck = (end.hypothesis for end in ends)
    assert not problem.says_nothing(()) and not problem.says_nothing(rubs)
    told = problem.says_nothing(stuck)
    assert told.startswith("run through") and "never moves" in told, "by windows it is not told"
    assert [problem.never_moves(m) for m in ((), rubs, stuck)] == ["", "", told]
    # What a description does not do either is nobody's loss.
    itself = FreeRun(problem.measured, apply(robot, stuck), evaluator_for(robot), windows_s=RESTART_S)
    assert not itself.never_moves((term("viscous_friction", joint, damping_nm_s_rad=1.0),))


def test_a_right_model_of_a_robot_at_rest_is_not_told_to_stand_still() -> None:
    robot = samples()["pendulum"].robot
    loose = robot.map_drive(robot.drives[0].joint, lambda d: replace(d, command="torque"))
    at_rest = np.zeros((800, 1))
    (log,) = evaluator_for(loose).engine.rollout([Rollout(loose, Commands(at_rest), 800, pose=True)])  # type: ignore[attr-defined]
    problem = FreeRun(
        (MeasuredTrial("rest", log, Commands(at_rest)),), loose, evaluator_for(loose), windows_s=RESTART_S
    )
    assert not any("stays where each window begins" in line for line in problem.remarks(()))


def unstable(floor: float, seconds: float = 12.0) -> FreeRun:
    """A pendulum led by torques, as if starts that are off made a floor of so many times the noise."""
    robot = quiet(samples()["pendulum"].robot)
    loose = robot.map_drive(robot.drives[0].joint, lambda d: replace(d, command="torque", delay_s=0.01))
    problem = FreeRun((trial_of(loose, seconds),), loose, evaluator_for(loose), windows_s=RESTART_S)
    shape = np.full(len(problem.segment_of), floor)
    problem.layout = replace(problem.layout, floor=shape, known=shape - 1.0, by_segment=True)
    return problem


def test_where_starts_decide_a_search_goes_in_longer_steps() -> None:
    """What they move is little beside the floor: a third of the work, and the same residual but for that."""
    problem = unstable(1e6)
    found = problem.searched
    assert isinstance(found, FreeRun) and found is not problem and (found.steps, problem.steps) == (problem.every, 1)
    assert len(found.segments) == len(problem.segments)
    assert len(found.segment_of) == pytest.approx(len(problem.segment_of), abs=problem.every)
    joint = found.robot.drives[0].joint
    for model in (
        (),
        (term("coulomb_friction", joint, torque_nm=0.1),),
        (term("command_delay", joint, delay_s=0.013),),
    ):
        fine, coarse = (np.abs(p.raw(p.residuals([model])[0])) for p in (problem, found))
        assert coarse.mean() == pytest.approx(
            fine.mean(), abs=2e-3 * float(np.ptp(problem.measured[0].log.sensors[:, 0]))
        )
    before = found.evaluator.counts.steps
    found.residuals([(term("viscous_friction", joint, damping_nm_s_rad=0.05),)])
    assert found.evaluator.counts.steps - before == len(found.pieces) * max(len(p.log) for p in found.pieces)
    assert 3 * max(len(p.log) for p in found.pieces) <= max(len(p.log) for p in problem.pieces) + 2 * problem.every
    assert any("goes in steps of" in line for line in found.notes) and not any("in steps" in n for n in problem.notes)
    brief = found.beginning(4.0)
    assert isinstance(brief, FreeRun) and brief.steps == found.steps and len(brief.pieces) < len(found.pieces)
    (log, *_) = found.simulated(())
    assert log is not None and log.times_s[1] - log.times_s[0] == pytest.approx(found.robot.time_step_s), (
        "seen in all rows"
    )


def test_longer_steps_are_not_taken_where_they_would_be_seen() -> None:
    precise = unstable(1e-4)
    assert precise.searched is precise
    stable = unstable(1e6)
    stable.layout = replace(stable.layout, by_segment=False)
    assert stable.searched is stable
    seldom = unstable(1e6)
    log = seldom.measured[0].log
    filled = np.arange(len(log)) % 2 == 1
    seldom.measured = (replace(seldom.measured[0], log=replace(log, filled=filled)),)
    assert seldom.searched is seldom, "rows that nobody read say nothing of what happened in them"


@given(st.integers(1, 6), st.integers(0, 40))
def test_what_drives_were_told_in_longer_steps_is_its_mean(count: int, first: int) -> None:
    problem = unstable(1.0, 2.0)
    (piece, *_) = [p for p in problem.pieces if p.start_s > 0]
    short = replace(piece, commands=piece.commands[first:], rows=range(0, len(piece.log), count))
    found = short.coarser(count)
    whole = (len(short.commands) // count) * count
    blocks = short.commands[:whole].reshape(-1, count, short.commands.shape[1]).mean(axis=1)
    np.testing.assert_allclose(found.commands[: len(blocks)], blocks)
    assert np.array_equal(found.measured((0,)), short.measured((0,)))
    np.testing.assert_allclose(found.times_s, short.times_s)
