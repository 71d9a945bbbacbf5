"""What a perfect model would leave: by every drive with noise of its own, and in trials of unequal length."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
import scipy
from way_samples import Sample, engine_for, evaluator_for, measure, samples, sines, two_joint_arm

from ee_dist.discrepancy.accounts.of_compare import compare_account
from ee_dist.discrepancy.accounts.of_explain import explain_account
from ee_dist.discrepancy.accounts.of_improve import improve_account
from ee_dist.discrepancy.compare import by_trial, compare, heat
from ee_dist.discrepancy.evidence.holdout import MOTIONS, WINDOWS
from ee_dist.discrepancy.evidence.left import leftovers
from ee_dist.discrepancy.explain import NOTHING_MISSING, UNEXPLAINED, explain
from ee_dist.discrepancy.improve import improve
from ee_dist.discrepancy.measured_trial import MeasuredTrial, driver_of
from ee_dist.discrepancy.problem import error
from ee_dist.discrepancy.search.pool import pool_of
from ee_dist.discrepancy.starting import start_of, starts_beside
from ee_dist.discrepancy.ways.force_balance.noise import roughness_of_noise, share_of_noise
from ee_dist.discrepancy.ways.force_balance.places import Way, share_of_no_place
from ee_dist.discrepancy.ways.force_balance.problem import ForceBalance
from ee_dist.discrepancy.ways.free_run.problem import FreeRun
from ee_dist.discrepancy.ways.open_loop.prediction import roughness
from ee_dist.discrepancy.ways.open_loop.problem import OpenLoop
from ee_dist.evaluation.physical import PhysicalRobot
from ee_dist.measurements.sampling import LowPass, decimated
from ee_dist.robots.instruments import with_motor_torques
from ee_dist.robots.inverse_dynamics import parameters, regressor
from ee_dist.robots.model import Robot
from ee_dist.robots.servo_pendulum import servo_pendulum
from ee_dist.trials.excitation import Excitation
from ee_dist.trials.log import Array, SensorLog
from ee_dist.trials.noise import with_noise

Force = Callable[[Array, Array, Array], Array]
"""(T, 2) torque of times (T,), positions and speeds (T, 2)."""


def balanced_arm(noise_nm: tuple[float, float], more: Force | None = None) -> ForceBalance:
    """Two motions of an arm whose torques are those of its model, but for white noise, and what is ``more``."""
    robot = two_joint_arm()
    t = np.arange(0.0, 12.0, robot.time_step_s)
    trials = []
    for k, pace in enumerate((1.0, 1.27)):
        q = np.stack(
            [
                0.6 * np.sin(2.1 * pace * t) + 0.2 * np.sin(5.3 * pace * t),
                0.5 * np.sin(3.1 * pace * t) + 0.3 * np.sin(1.3 * pace * t),
            ],
            axis=1,
        )
        v = np.gradient(q, robot.time_step_s, axis=0)
        a = np.gradient(v, robot.time_step_s, axis=0)
        torque = regressor(robot, q, v, a) @ parameters(robot) + a * [d.rotor_inertia for d in robot.drives]
        torque += 0.0 if more is None else more(t, q, v)
        torque += np.random.default_rng([3, k]).normal(size=torque.shape) * noise_nm
        of = {"position": q, "velocity": v}
        place = {name: j for j, name in enumerate(robot.motor_names)}
        sensors = np.stack([of[s.kind][:, place[s.target]] for s in robot.sensors], axis=1)
        units = tuple(s.unit for s in robot.sensors)
        log = SensorLog(t, sensors, q, robot.sensor_names, units, robot.motor_names, joints=q, torques=torque)
        trials.append(MeasuredTrial(f"motion {k}", log, None))
    return ForceBalance(trials, robot)


@pytest.mark.parametrize("noise_nm", [(0.05, 0.05), (0.15, 0.027)])
def test_forces_that_differ_by_noise_alone_are_noise_whichever_drive_has_more_of_it(
    noise_nm: tuple[float, float],
) -> None:
    problem = balanced_arm(noise_nm)
    residual = problem.residuals([()])[0]
    assert leftovers(problem, residual) == []
    assert error(residual) == pytest.approx(1.0, abs=0.15)
    for k in range(2):
        mine = problem.channel_of == k
        assert (residual[mine] ** 2).mean() == pytest.approx(problem.floor[mine].mean(), rel=0.35)


def still(t: Array, q: Array, v: Array) -> Array:
    return np.zeros_like(q)


def teeth(t: Array, q: Array, v: Array) -> Array:
    """Cogging of the elbow, ten times the noise: at full pace some ten teeth a second."""
    return np.array([0.0, 0.3]) * np.sin(48.0 * q)


def buzz(t: Array, q: Array, v: Array) -> Array:
    """Something at the elbow that no place shows again."""
    return np.array([0.0, 0.3]) * np.sin(2 * np.pi * 9.0 * t)[:, None]


def test_a_force_that_every_pass_of_a_place_shows_again_is_no_noise() -> None:
    clean, problem = (balanced_arm((0.03, 0.03), force) for force in (still, teeth))
    noise = [p.own_noise * p.noise_share * p.size for p in (clean, problem)]
    assert (noise[1] < 2.5 * noise[0]).all(), "it was 18 times as much"
    found = explain(problem, pool_of(problem))
    assert found.verdict == UNEXPLAINED and {g.channel for g in found.left} == {"elbow"}


def test_a_quick_force_that_may_be_noise_is_not_said_to_be_nothing() -> None:
    problem = balanced_arm((0.03, 0.03), buzz)
    found = explain(problem, pool_of(problem))
    account = explain_account(problem, found, None)
    assert found.verdict == NOTHING_MISSING and found.unsure == ["elbow"]
    assert account.headline.startswith("Nothing is left beyond what may be noise") and not account.good
    assert "upper bound" in found.floor_source
    agrees = compare_account(problem, compare(problem, found.base), [])
    assert agrees.headline.endswith("beyond what may be noise.") and not agrees.good
    added = improve(problem, [])
    told = improve_account(problem, added)
    assert "beyond what may be noise" in told.headline and not told.good


def test_a_floor_that_may_be_a_force_makes_no_evidence_weaker() -> None:
    dry = [balanced_arm((0.03, 0.03), lambda t, q, v, f=f: 0.3 * np.sign(v) + f(t, q, v)) for f in (still, buzz)]
    pool = [c for c in pool_of(dry[0]) if c.name == "coulomb_friction@all_joints"]
    held_out = [explain(p, pool).best.held_out for p in dry]  # type: ignore[union-attr]
    assert held_out == [WINDOWS, MOTIONS]


@pytest.mark.parametrize("alike", [0.0, 0.9])
def test_noise_stays_noise_where_the_places_are_passed_again_and_again(alike: float) -> None:
    def noise(t: Array, q: Array, v: Array) -> Array:
        return np.asarray(
            scipy.signal.lfilter([0.05], [1.0, -alike], np.random.default_rng(7).normal(size=q.shape), axis=0)
        )

    problem = balanced_arm((0.0, 0.0), noise)
    every = problem.processing.keep_every
    left = [b(m) for b, m in zip(problem.balances, problem.models, strict=True)]
    ways = [Way(m.position[:, 1], m.speed[:, 1], x[0][:, 1]) for m, x in zip(problem.motions, left, strict=True) if x]
    step_s = problem.robot.time_step_s
    assert share_of_no_place(ways, every, step_s, problem.processing.filter_for(step_s)) > 0.85
    # White noise is noise beyond doubt; noise that is slower than the readings may be a quick force.
    assert (problem.sure < problem.floor).all() == (alike > 0)


@pytest.mark.parametrize("every", [1, 2, 5, 10])
def test_noise_of_which_some_rows_are_kept(every: int) -> None:
    passed = 0.5 / max(every, 2)
    smooth = LowPass(passed)(np.random.default_rng(0).normal(size=100_000), 1.0)
    kept = decimated(smooth[:, None], every)[50:-50]
    found = roughness(kept)[1:-1].mean() / kept.var()
    assert roughness_of_noise(every, passed) == pytest.approx(found, rel=0.05)
    assert share_of_noise(every, passed) == pytest.approx(kept.var(), rel=0.05)


NOISE = {"pendulum": 5e-5, "stage": 3e-6, "arm": 2e-4}


@pytest.mark.parametrize("name", NOISE)
def test_a_balance_of_forces_leaves_of_the_right_model_what_its_floor_says(name: str) -> None:
    """Of quick motions too, that the controller is stiff in, and that go on where the record ends."""
    robot = with_noise(with_motor_torques(samples()[name].robot), NOISE[name])
    quick = (Excitation("steps", 2.0, 0.15, 2), Excitation("fast_sines", 1.5, 0.05, 4))
    trials = []
    for k, e in enumerate(quick):
        hardware = PhysicalRobot(engine_for(robot), robot, (), np.random.SeedSequence([310, k]))
        trials.append(
            MeasuredTrial(f"motion {k}", hardware.trial(driver_of(e, robot), e.steps(robot)), driver_of(e, robot))
        )
    problem = ForceBalance(trials, robot)
    left = problem.residuals([()])[0]
    assert 0.4 < error(left) < 1.25
    for part in problem.slices:
        ends = np.abs(left[part].reshape(-1, len(problem.channels)))[[0, -1]]
        assert ends.max() < 5.0


def unequal() -> FreeRun:
    robot = with_noise(servo_pendulum(), 5e-5)
    sample = Sample(robot, (sines(robot, 1.0, 8.0)[0], sines(robot, 1.0, 2.0)[1]), (), ("free_run",))
    return FreeRun(measure(sample, ()), robot, evaluator_for(robot))


@pytest.mark.parametrize(("times", "left"), [(1.0, set()), (1.5, {"motion 0"})])
def test_in_trials_of_unequal_length_what_is_more_than_noise_is_left_and_noise_is_not(
    times: float, left: set[str]
) -> None:
    problem = unequal()
    rng = np.random.default_rng(0)
    for _ in range(10):
        gap = rng.normal(size=len(problem.weight)) / np.sqrt(2 / np.pi)
        gap[problem.trial_of == 0] *= times
        residual = np.sign(gap) * np.sqrt(np.abs(gap) * problem.weight)
        assert {g.trial for g in leftovers(problem, residual)} == left


def test_the_error_of_a_trial_is_its_own_however_long_the_others_are() -> None:
    problem = unequal()
    residual = problem.residuals([()])[0]
    found = compare(problem, residual).trial_errors
    raw = np.abs(problem.raw(residual))
    for k, value in enumerate(found):
        assert problem.natural(value) == pytest.approx(raw[problem.trial_of == k].mean(), rel=1e-6)


def test_in_trials_of_unequal_length_equal_errors_look_equal() -> None:
    problem = unequal()
    residual = np.sqrt(np.where(problem.trial_of == 0, 2.0, 1.0) * problem.weight)
    cells, trials = heat(problem, residual)[:, 0], by_trial(problem, residual)[:, 0]
    np.testing.assert_allclose(cells**2, np.where(problem.trial_of_segment == 0, 2.0, 1.0))
    np.testing.assert_allclose(trials, [problem.trial_error(residual, k) for k in range(2)])
    assert compare(problem, residual).channels[0].worst_trial == "1. motion 0"


@pytest.mark.parametrize("noise", [2e-3, 1.4e-3, 1e-3, 5e-4])
def test_the_roughness_of_precise_sensors_has_the_floor_that_their_noise_gives_it(noise: float) -> None:
    """From as much as counts down to a quarter of that: the noise of a channel moves the log of its roughness by less than its
    own share, and by more than the square of that."""
    plain = samples()["arm"]
    robot = with_noise(two_joint_arm(), noise)
    sample = Sample(robot, sines(robot, 0.3, 12.0), (), plain.ways)
    problem = OpenLoop(measure(sample, ()), robot, evaluator_for(robot))
    texture = ~problem.layout.reading
    left, floor = problem.residuals([()])[0][texture], problem.floor[texture]
    assert 0.7 < np.mean(left**2) / np.mean(floor) < 1.1


def loud_arm() -> Robot:
    """Whose sensors of speed are far worse than those of position."""
    robot = two_joint_arm()
    loud = tuple(replace(s, noise=0.3 if s.kind == "velocity" else 1e-3) for s in robot.sensors)
    return replace(robot, sensors=loud)


def test_what_noisy_speeds_do_to_a_start_is_noise() -> None:
    """A model starts as fast as a noisy sensor says. What that leaves in the first blocks of a robot that is described exactly is
    in the floor, and the blocks are weighed by it."""
    robot = loud_arm()
    evaluator = evaluator_for(robot)
    positions = [c for c, s in enumerate(robot.sensors) if s.kind == "position"]
    sample = Sample(robot, tuple(3.0 * s for s in sines(robot, 0.3, 3.0)), (), ("open_loop",))
    first: list[tuple[float, float]] = []
    for seed in range(12):
        whole = measure(sample, (), seed)
        # From where they move as fast as that sensors can tell.
        begins = [
            60 + int(np.abs(np.diff(np.asarray(t.log.joints), axis=0)[60:200].sum(axis=1)).argmax()) for t in whole
        ]
        trials = [replace(t, log=t.log.part(b, len(t.log)), driver=None) for t, b in zip(whole, begins, strict=True)]
        problem = OpenLoop(trials, robot, evaluator)
        residual = problem.residuals([()])[0]
        for k in range(len(trials)):
            left = problem.views.blocks(k, residual) ** 2
            floor = problem.floor[problem.slices[k]][: left.size].reshape(left.shape)
            first.append((left[:4, positions].mean(), floor[:4, positions].mean()))
    left_first, floor_first = np.mean(first, axis=0)
    assert 0.6 < left_first / floor_first < 1.5


def test_a_robot_whose_sensors_see_no_motion_stood() -> None:
    robot = loud_arm()
    for seed in range(4):
        for trial in measure(Sample(robot, sines(robot, 0.3, 3.0), (), ("open_loop",)), (), seed):
            start = start_of(trial, robot)
            assert start is not None and not start.speeds.any() and starts_beside(trial, robot) == []
            quick = trial.log.sensors.copy()
            quick[0, [s.kind == "velocity" for s in robot.sensors]] = 2.0
            moving = start_of(replace(trial, log=replace(trial.log, sensors=quick)), robot)
            assert moving is not None and moving.speeds.all()
