"""Trials of one joint each, in which others were not recorded: nothing of these is compared, whatever their logs hold."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from way_samples import Sample, evaluator_for, measure, sines, two_joint_arm

from ee_dist.discrepancy.accounts.of_compare import compare_account
from ee_dist.discrepancy.compare import compare
from ee_dist.discrepancy.evidence.by_joint import gains_of
from ee_dist.discrepancy.evidence.holdout import MOTIONS, cross_fit, travelling
from ee_dist.discrepancy.evidence.left import leftovers
from ee_dist.discrepancy.explain import explain
from ee_dist.discrepancy.last_word import last_word
from ee_dist.discrepancy.measured_trial import MeasuredTrial
from ee_dist.discrepancy.problem import Problem, error
from ee_dist.discrepancy.search.candidates import candidate
from ee_dist.discrepancy.search.fitted import Model
from ee_dist.discrepancy.search.pool import pool_of
from ee_dist.discrepancy.search.search import Search
from ee_dist.discrepancy.ways.free_run.problem import FreeRun
from ee_dist.discrepancy.ways.open_loop.calibration import unmodelled_by
from ee_dist.discrepancy.ways.open_loop.problem import OpenLoop
from ee_dist.discrepancy.ways.open_loop.scale import channel_scale
from ee_dist.effects.catalogue import term
from ee_dist.measurements.errors import MeasurementError
from ee_dist.robots.model import Robot

JOINTS = ("shoulder", "elbow")
HIDDEN = (term("coulomb_friction", "elbow", torque_nm=0.3),)
NOISE = 2e-3


@cache
def arm(declared: bool = True) -> Robot:
    """With positions alone, whose noise is ``declared`` or to be estimated."""
    robot = two_joint_arm()
    own = (replace(s, noise=NOISE if declared else 0.0) for s in robot.sensors if s.kind == "position")
    return replace(robot, sensors=tuple(own))


@cache
def recorded() -> tuple[MeasuredTrial, ...]:
    """Two motions of each joint, at the commands of which the other stays; both were read."""
    plan = tuple(c * np.eye(2)[j] for j in range(2) for c in sines(arm(), 0.6, 2.0))
    return measure(Sample(arm(), plan, HIDDEN, ()), HIDDEN)


def one_each(other: float = 0.0) -> tuple[MeasuredTrial, ...]:
    """The same, of which nobody recorded the joint that stays: ``other`` stands in its column."""
    out = []
    for k, trial in enumerate(recorded()):
        gone = 1 - k // 2
        sensors, joints = np.array(trial.log.sensors), np.array(trial.log.joints)
        sensors[:, gone], joints[:, gone] = other, 0.0
        log = replace(trial.log, sensors=sensors, joints=joints)
        out.append(replace(trial, log=log, not_recorded=frozenset([arm().sensor_names[gone]])))
    return tuple(out)


def by(way: str, trials: tuple[MeasuredTrial, ...], declared: bool = True) -> Problem:
    robot = arm(declared)
    if way == "open_loop":
        return OpenLoop(trials, robot, evaluator_for(robot))
    return FreeRun(trials, robot, evaluator_for(robot), windows_s=0.5 if way == "windows" else None)


@cache
def plain(way: str, declared: bool = True) -> Problem:
    return by(way, one_each(), declared)


WAYS = pytest.mark.parametrize("way", ["open_loop", "free_run", "windows"])


@WAYS
@pytest.mark.parametrize("declared", [True, False])
@settings(max_examples=5, deadline=None)
@given(other=st.floats(-2.0, 2.0))
def test_what_stands_in_their_columns_says_nothing(way: str, declared: bool, other: float) -> None:
    mine, usual = by(way, one_each(other), declared), plain(way, declared)
    models = [(), HIDDEN]
    np.testing.assert_array_equal(mine.residuals(models), usual.residuals(models))
    np.testing.assert_array_equal(mine.floor, usual.floor)
    assert mine.noise_floor() == usual.noise_floor() and mine.trust == usual.trust
    assert mine.other_errors(*models) == usual.other_errors(*models)
    assert [str(x) for x in leftovers(mine, mine.residuals([()])[0])] == [
        str(x) for x in leftovers(usual, usual.residuals([()])[0])
    ]


@WAYS
def test_values_are_of_the_joints_that_were_recorded(way: str) -> None:
    problem = plain(way)
    pairs = set(zip(problem.trial_of.tolist(), problem.channel_of.tolist(), strict=True))
    assert pairs == {(0, 0), (1, 0), (2, 1), (3, 1)}
    drawn = problem.series(())
    assert {(s.trial, s.channel) for s in drawn} == pairs
    residual = problem.residuals([()])[0]
    raw = problem.raw(residual)
    for s in drawn:  # what is left is that of the joint itself
        own = (problem.trial_of == s.trial) & (problem.channel_of == s.channel) & problem.layout.reading
        off = max(np.abs(t.measured - t.predicted).max() for t in drawn if (t.trial, t.channel) == (s.trial, s.channel))
        assert 0 < np.nanmax(np.abs(raw[own])) <= 1.01 * off
    account = compare_account(problem, compare(problem, residual), leftovers(problem, residual))
    assert "of 4 curves (2 channels in 4 trials)" in account.sure
    (told,) = [line for line in account.lines if line.startswith("Channels that nobody recorded")]
    assert told.endswith("are not compared in it (4 trials: motion 0, motion 1, motion 2, motion 3).")


def test_plain_errors_over_all_rows_are_those_of_the_joints_that_were_recorded() -> None:
    problem = plain("open_loop")
    assert isinstance(problem, OpenLoop)
    off = [
        (t.log.sensors - p)[:, k // 2]
        for k, (t, p) in enumerate(zip(problem.measured, problem.predicted(()), strict=True))
    ]
    (line,) = problem.other_errors(())
    assert f"position {1e3 * np.sqrt(np.mean(np.concatenate(off) ** 2)):.3g} mrad" in line


@WAYS
def test_what_is_left_of_a_joint_is_that_which_is_left_where_all_was_read(way: str) -> None:
    alone = plain(way)
    read = [
        replace(t, log=replace(t.log, sensors=r.log.sensors.copy()), not_recorded=frozenset())
        for t, r in zip(alone.measured, recorded(), strict=True)
    ]
    both = by(way, tuple(read))
    own = both.channel_of == both.trial_of // 2
    mine, all_of_it = (p.raw(p.residuals([()])[0]) for p in (alone, both))
    np.testing.assert_allclose(mine, all_of_it[own], rtol=1e-6, atol=1e-9)
    assert error(alone.residuals([HIDDEN])[0]) < 0.6 * error(alone.residuals([()])[0])


def test_noise_is_that_of_trials_that_have_the_channel() -> None:
    robot, trials = arm(False), one_each(0.3)
    found = channel_scale(robot, trials).noise
    for c in range(2):
        own = channel_scale(robot, trials[2 * c : 2 * c + 2]).noise
        assert found[c] == own[c] == pytest.approx(NOISE, rel=0.2) and own[1 - c] == 0.0
    # Repeats tell it where every channel has some, and else nothing does but the logs themselves.
    same = [replace(t, name="same") for t in (trials[0], trials[0], trials[2])]
    assert channel_scale(robot, same).source.startswith("estimated")
    repeated = [replace(t, name=str(k // 2)) for k, t in enumerate((trials[0], trials[0], trials[2], trials[3]))]
    assert channel_scale(robot, repeated).source.startswith("measured")


def test_hidden_friction_is_found_at_its_joint() -> None:
    problem = plain("open_loop")
    names = ("coulomb_friction", "viscous_friction", "parallel_spring")
    found = explain(problem, [candidate(arm(), name, joint) for name in names for joint in JOINTS])
    assert found.best is not None and found.best.name == "coulomb_friction@elbow" and not found.left
    assert dict(found.best.hypothesis[0].values)["torque_nm"] == pytest.approx(0.3, rel=0.1)


def test_motions_are_held_out_and_gains_are_told_joint_by_joint() -> None:
    problem = plain("open_loop")
    (cut,) = travelling(problem)
    assert cut.name == MOTIONS
    parts = tuple(candidate(arm(), "coulomb_friction", joint) for joint in JOINTS)
    (held,) = cross_fit(Search(problem), [(Model(parts), np.full(2, 0.1))], cut)
    base = problem.residuals([()])[0]
    shoulder, elbow = gains_of(problem, parts, base, held.residual)
    assert elbow > 0.9 * float(base @ base) > 10 * abs(shoulder)


def test_a_channel_that_no_trial_has_is_none_of_the_problem() -> None:
    trials = one_each()[:2]
    for way in ("open_loop", "free_run"):
        problem = by(way, trials)
        assert set(problem.channel_of) == {0} and np.isfinite(problem.residuals([(), HIDDEN])).all()
        assert f"recorded in none: {arm().sensor_names[1]}" in " ".join(problem.notes)
    with pytest.raises(MeasurementError, match="trial 'motion 2': no position was recorded in it"):
        by("free_run", (*trials, replace(one_each()[2], not_recorded=frozenset(arm().sensor_names))))


def test_a_trial_by_itself_keeps_the_places_of_its_channels() -> None:
    for way in ("open_loop", "free_run"):
        alone = by(way, one_each()[2:])
        assert alone.channels == plain(way).channels and {s.channel for s in alone.series(())} == {1}
        said = last_word([alone, alone], [(), HIDDEN], plain(way).compared).others
        assert any("not at position_shoulder, unlike what was fitted" in line for line in said), said


@pytest.mark.parametrize("other", [0.9, 1.9])
def test_no_candidate_is_hinted_at_by_what_nobody_read(other: float) -> None:
    pools = [pool_of(by("open_loop", one_each(place)[:3], False)) for place in (other, 0.0)]
    first, second = ([(c.name, c.hint, c.bounds) for c in pool] for pool in pools)
    assert first == second


def test_a_calibration_leaves_nothing_there() -> None:
    problem = plain("open_loop")
    assert isinstance(problem, OpenLoop)
    left = unmodelled_by(problem, problem.residuals([()])[0])
    assert [bool(left[f"motion {k}"][0, 1 - k // 2]) for k in range(4)] == [False] * 4
    assert left["motion 2"][0, 1] > 0


def test_a_calibration_is_the_mean_over_the_trials_of_a_name_in_which_a_channel_was_recorded() -> None:
    one, other = plain("open_loop"), by("open_loop", tuple(replace(t, name="motion") for t in one_each()))
    assert isinstance(one, OpenLoop) and isinstance(other, OpenLoop)
    squares = [v**2 for v in unmodelled_by(one, one.residuals([()])[0]).values()]
    (left,) = unmodelled_by(other, other.residuals([()])[0]).values()
    # Where noise alone is left the squares of single trials were raised to 0.
    assert left[0, 1] == pytest.approx(np.sqrt((squares[2][0, 1] + squares[3][0, 1]) / 2), rel=0.05)


def test_trials_in_which_all_was_recorded_say_nothing_of_it() -> None:
    for way in ("open_loop", "free_run"):
        assert not any("nobody recorded" in line for line in by(way, recorded()).notes)
