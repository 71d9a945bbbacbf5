"""Torques that were read later than positions, or sooner: a balance of forces tells by how much, and nothing stands in for it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from way_samples import measure, measured, problem_by, samples

from ee_dist.discrepancy.improve import improve
from ee_dist.discrepancy.measured_trial import MeasuredTrial
from ee_dist.discrepancy.search.candidates import parse
from ee_dist.discrepancy.search.pool import pool_of
from ee_dist.discrepancy.ways.force_balance.problem import ForceBalance
from ee_dist.discrepancy.ways.force_balance.readings import Readings, at_readings
from ee_dist.effects.catalogue import Hypothesis, Term, apply, term
from ee_dist.robots.instruments import MOTOR_TORQUE, with_motor_torques
from ee_dist.trials.log import Array

DELAY = "torque_reading_delay"
LATE_S = 0.045
OFF = (term("coulomb_friction", "elbow", torque_nm=0.25), term("part_mass", "lower", change=0.3))


def late(trials: Sequence[MeasuredTrial], late_s: float) -> tuple[MeasuredTrial, ...]:
    """The trials, with torques that stand so much later in their logs."""
    out = []
    for t in trials:
        assert t.log.torques is not None
        times = t.log.times_s
        shifted = np.stack([np.interp(times - late_s, times, c) for c in t.log.torques.T], axis=1)
        out.append(replace(t, log=replace(t.log, torques=shifted)))
    return tuple(out)


def found(hidden: Hypothesis, late_s: float) -> list[Term]:
    arm = samples()["arm"]
    problem = problem_by("force_balance", late(measure(arm, hidden), late_s), arm.robot)
    return list(improve(problem, pool_of(problem), ()).terms)


def of(terms: list[Term], effect: str) -> dict[str, float]:
    """The values of the one term of this effect."""
    (only,) = [t for t in terms if t.effect == effect]
    return dict(only.values)


def test_a_delay_of_all_torques_is_found_alone_and_shared() -> None:
    terms = found((), LATE_S)
    assert [t.name for t in terms] == [f"{DELAY}@all_joints"]
    assert of(terms, DELAY)["delay_s"] == pytest.approx(LATE_S, abs=0.003)


@pytest.mark.parametrize("late_s", [LATE_S, -0.02])
def test_it_is_found_beside_friction_and_a_mass(late_s: float) -> None:
    terms = found(OFF, late_s)
    assert of(terms, DELAY)["delay_s"] == pytest.approx(late_s, abs=0.003)
    assert of(terms, "coulomb_friction")["torque_nm"] == pytest.approx(0.25, abs=0.02)
    (lower,) = [dict(t.values)["change"] for t in terms if t.name == "part_mass@lower"]
    assert lower == pytest.approx(0.3, abs=0.05)


def test_torques_that_were_not_late_are_not_told_to_be() -> None:
    assert found((), 0.0) == []
    assert DELAY not in {t.effect for t in found(OFF, 0.0)}


def test_one_joint_may_be_late_by_itself() -> None:
    arm, elbow = samples()["arm"], [False, True]
    own = []
    for on_time in measure(arm, ()):
        (shifted,) = late([on_time], LATE_S)
        assert on_time.log.torques is not None and shifted.log.torques is not None
        torques = np.where(elbow, shifted.log.torques, on_time.log.torques)
        own.append(replace(on_time, log=replace(on_time.log, torques=torques)))
    problem = problem_by("force_balance", tuple(own), arm.robot)
    (only,) = improve(problem, pool_of(problem), ()).terms
    assert only.name == f"{DELAY}@elbow"
    assert dict(only.values)["delay_s"] == pytest.approx(LATE_S, abs=0.003)


def test_only_a_balance_of_forces_asks_for_it_and_at_all_joints_too() -> None:
    arm = samples()["arm"]
    asked = {w: {c.name for c in pool_of(problem_by(w, measured("arm"), arm.robot))} for w in arm.ways}
    assert {n for n in asked["force_balance"] if n.startswith(DELAY)} == {
        f"{DELAY}@{t}" for t in ("shoulder", "elbow", "all_joints")
    }
    assert not any(n.startswith(DELAY) for w in ("open_loop", "free_run") for n in asked[w])


def test_no_row_is_left_out_for_a_delay_and_curves_stand_where_torques_were_read() -> None:
    arm = samples()["arm"]
    problem = ForceBalance(late(measure(arm, ()), LATE_S), arm.robot)
    right = (term(DELAY, "all_joints", delay_s=LATE_S),)
    plain, put_right = problem.residuals([(), right])
    assert plain.shape == put_right.shape and np.isfinite(put_right).all()
    assert np.sqrt(np.mean(put_right**2)) < 0.1 * np.sqrt(np.mean(plain**2))
    for before, after in zip(problem.series(()), problem.series(right), strict=True):
        assert np.array_equal(before.measured, after.measured)
        off, left = (np.sqrt(np.mean((s.measured - s.predicted) ** 2)) for s in (before, after))
        assert left < 0.15 * off


def test_a_delay_of_sensors_of_torque_counts_as_their_drives_does() -> None:
    arm = samples()["arm"]
    robot = with_motor_torques(arm.robot)
    trials = []
    for t in late(measure(arm, ()), LATE_S):
        assert t.log.torques is not None
        sensors = np.concatenate([t.log.sensors, t.log.torques], axis=1)
        units = [s.unit for s in robot.sensors]
        log = replace(t.log, sensors=sensors, torques=None, sensor_names=robot.sensor_names, sensor_units=tuple(units))
        trials.append(replace(t, log=log))
    problem = ForceBalance(trials, robot)
    own = tuple(term("sensor_delay", f"{MOTOR_TORQUE}_{m}", delay_s=LATE_S) for m in robot.motor_names)
    by_sensors, by_drives, none = problem.residuals([own, (term(DELAY, "all_joints", delay_s=LATE_S),), ()])
    assert np.array_equal(by_sensors, by_drives)
    assert np.mean(by_sensors**2) < 1.5 < 30 < np.mean(none**2)


def readings(torque: Array, drop_rows: int = 20) -> Readings:
    return Readings(torque, drop_rows, 0.01)


def test_rows_between_are_on_a_curve_and_those_beyond_the_record_hold() -> None:
    t = 0.01 * np.arange(400)
    two = readings(np.stack([np.sin(6 * t), np.cos(4 * t)], axis=1))
    shifted = two.of_motion([1, 0], np.array([0.013, -0.0275]))
    assert shifted[:, 0] == pytest.approx(np.cos(4 * (t[20:-20] + 0.013)), abs=1e-6)
    assert shifted[:, 1] == pytest.approx(np.sin(6 * (t[20:-20] - 0.0275)), abs=1e-6)
    assert np.array_equal(two.of_motion([0], np.zeros(1))[:, 0], two.torque[20:-20, 0])
    far = two.of_motion([0], np.array([0.5]))[:, 0]
    assert far[-30:] == pytest.approx(two.torque[-1, 0]) and len(far) == 360


def test_a_shift_takes_no_noise_along() -> None:
    """Straight lines half way between two rows would halve the variance of white noise."""
    noise = np.random.default_rng(0).normal(size=(4000, 1))
    between = readings(noise).of_motion([0], np.array([0.005]))
    assert 0.75 < np.var(between) / np.var(noise) < 1.1


def test_what_is_left_goes_back_to_where_it_was_read() -> None:
    times = 0.1 * np.arange(50)
    left = np.stack([np.sin(times), np.cos(times)], axis=1)
    back = at_readings(left, times, np.array([0.05, 0.0]))
    assert back[1:, 0] == pytest.approx(np.sin(times[1:] - 0.05), abs=2e-3) and np.array_equal(back[:, 1], left[:, 1])
    assert at_readings(left, times, np.zeros(2)) is left


def test_delays_add_up_and_one_by_name_is_a_candidate() -> None:
    robot = samples()["arm"].robot
    twice = apply(robot, (term(DELAY, "all_joints", delay_s=0.03), term(DELAY, "elbow", delay_s=-0.01)))
    assert [d.torque_read_late_s for d in twice.drives] == pytest.approx([0.03, 0.02])
    assert parse(robot, f"{DELAY}@shoulder").bounds == ((-0.1, 0.1),)
