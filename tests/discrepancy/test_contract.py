"""What every way of comparing promises, on robots that are measured here by simulation."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from way_samples import CASES, evaluator_for, measured, problem, problem_by, samples

from ee_dist.discrepancy.compare import compare, regimes
from ee_dist.discrepancy.evidence.left import leftovers
from ee_dist.discrepancy.problem import Problem, Series, error
from ee_dist.discrepancy.search.pool import pool_of
from ee_dist.discrepancy.ways.free_run.problem import FreeRun
from ee_dist.effects.catalogue import CATALOGUE, Hypothesis, Term
from ee_dist.measurements.errors import MeasurementError
from ee_dist.robots.model import Sensor
from ee_dist.trials.log import SensorLog
from ee_dist.trials.noise import with_noise

every_way = pytest.mark.parametrize(("name", "way"), CASES, ids=[f"{n}-{w}" for n, w in CASES])


@every_way
def test_every_value_has_its_place(name: str, way: str) -> None:
    p = problem(name, way)
    layout, n = p.layout, len(p.segment_of)
    assert p.way == way.removesuffix(" by stretches")
    for facts in (layout.channel_of, layout.time_s, layout.reading, layout.floor, layout.known, p.trial_of):
        assert facts.shape == (n,)
    assert set(p.segment_of) == set(range(len(p.segments))), "no segment is empty"
    assert len(layout.trial_of_segment) == len(p.segments) and set(layout.trial_of_segment) == {0, 1}
    assert p.trials == tuple(t.name for t in p.measured)
    assert len(p.channels) == len(layout.units) == len(layout.joint_of_channel) == len(set(p.channels))
    assert set(p.channel_of) == set(range(len(p.channels)))
    for j in layout.joint_of_channel:
        assert j is None or 0 <= j < len(p.robot.motor_names)
    for k, trial in enumerate(p.measured):
        own = p.trial_of == k
        length = trial.log.times_s[-1] - trial.log.times_s[0] + p.robot.time_step_s
        assert 0 <= layout.time_s[own].min() <= layout.time_s[own].max() <= length
        for s in np.flatnonzero(layout.trial_of_segment == k):
            assert p.segments[s].startswith(f"{trial.name}@")
    assert (layout.known >= 0).all() and (layout.floor >= layout.known).all()
    assert layout.floor.sum() > 0
    assert p.families <= {"body", "world", "drive", "sensing", "wiring"}


@every_way
def test_a_trial_left_out_is_zero_and_the_others_do_not_notice(name: str, way: str) -> None:
    p, hidden = problem(name, way), samples()[name].hidden
    whole = p.residuals([(), hidden])
    assert whole.shape == (2, len(p.segment_of)) and np.isfinite(whole).all()
    for k in range(len(p.trials)):
        own = p.trial_of == k
        part = p.residuals([(), hidden], [k])
        np.testing.assert_array_equal(part[:, own], whole[:, own])
        assert not part[:, ~own].any()
    np.testing.assert_array_equal(p.residuals([hidden, ()])[::-1], whole)


def neutral_terms(p: Problem) -> list[Term]:
    """A term of every family that the way can see, at the values at which it does nothing."""
    out = {}
    for c in pool_of(p):
        if c.size and c.effect.family not in out:
            out[c.effect.family] = Term(c.effect.name, c.target, tuple(c.effect.neutral_values().items()))
    return list(out.values())


@every_way
def test_an_effect_at_its_neutral_value_changes_nothing(name: str, way: str) -> None:
    p = problem(name, way)
    terms = neutral_terms(p)
    assert {"body", "drive"} <= {CATALOGUE[t.effect].family for t in terms} <= p.families
    base, *rows = p.residuals([(), *[(t,) for t in terms]])
    for t, row in zip(terms, rows, strict=True):
        np.testing.assert_allclose(row, base, atol=1e-9, err_msg=str(t))


def end_to_end(series: list[Series]) -> list[Series]:
    """One of each trial and channel, stretches of it one after another."""
    found: dict[tuple[int, int], list[Series]] = {}
    for s in series:
        found.setdefault((s.trial, s.channel), []).append(s)
    names = ("times_s", "measured", "predicted")
    return [replace(s[0], **{n: np.concatenate([getattr(x, n) for x in s]) for n in names}) for s in found.values()]


@every_way
def test_raw_values_are_measured_less_predicted_in_the_units_of_the_channels(name: str, way: str) -> None:
    p, hidden = problem(name, way), samples()[name].hidden
    raw = p.raw(p.residuals([()])[0])
    assert raw.shape == p.segment_of.shape and np.isfinite(raw[p.layout.reading]).all()
    said = end_to_end(p.series(()))
    seen = [k for k, c in enumerate(p.channels) if not c.startswith("command_")]
    assert {(s.trial, s.channel) for s in said} == {(k, c) for k in range(len(p.trials)) for c in seen}
    for s in said:
        assert s.times_s.shape == s.measured.shape == s.predicted.shape
        assert s.unit == p.layout.units[s.channel]
        own = (p.trial_of == s.trial) & (p.channel_of == s.channel) & p.layout.reading
        gap, times = s.measured - s.predicted, p.layout.time_s[own]
        # A value stands for the readings around its time: for one of them, or for the mean of a block.
        count = len(gap) // own.sum()
        if count > 1:
            gap = gap[: own.sum() * count].reshape(-1, count).mean(axis=1)
            middle = s.times_s[: own.sum() * count].reshape(-1, count).mean(axis=1)
            assert np.abs(middle - times).max() < count * p.robot.time_step_s
        else:
            np.testing.assert_allclose(times, s.times_s - s.times_s[0] + times[0], atol=1e-9)
        scale = max(np.abs(s.measured).max(), 1e-9)
        np.testing.assert_allclose(raw[own], gap, atol=2e-6 * scale + 1e-12)
    better = p.series(hidden)
    off = [sum(float(np.mean((s.measured - s.predicted) ** 2)) for s in some) for some in (said, better)]
    assert off[1] < 0.5 * off[0] or name == "quadruped", "the truth predicts better"


@every_way
def test_the_truth_leaves_about_the_noise_floor(name: str, way: str) -> None:
    p, hidden = problem(name, way), samples()[name].hidden
    base, true = p.residuals([(), hidden])
    floor, source = p.noise_floor()
    assert floor > 0 and source
    assert error(base) > 1.05 * floor
    if way == "force_balance":
        # Positions behind a filter lose what happens at a reversal: that is no noise, and more than it.
        assert error(true) < 0.4 * error(base)
        return
    assert error(true) < 1.5 * floor
    # What a stiff controller hides is below the resolution of a comparison of positions.
    assert len(leftovers(p, true)) < len(leftovers(p, base)) or error(base) < 0.2


@every_way
def test_a_model_that_cannot_be_simulated_is_told_by_its_row_alone(name: str, way: str) -> None:
    p = problem(name, way)
    broken: Hypothesis = (Term("viscous_friction", p.robot.motor_names[0], (("damping_nm_s_rad", math.inf),)),)
    with np.errstate(invalid="ignore"):
        good, bad, same = p.residuals([(), broken, ()])
    assert not np.isfinite(bad).all() and error(bad) == math.inf
    np.testing.assert_array_equal(good, same)
    assert np.isfinite(good).all()


@every_way
def test_the_same_measurements_give_the_same_bytes(name: str, way: str) -> None:
    """Of two that were asked for the same before: what was asked for decides in which order sums of masses are built up, and so
    their last bits."""
    hidden = samples()[name].hidden
    p, again = (problem_by(way, measured(name), samples()[name].robot) for _ in range(2))
    assert again.residuals([(), hidden]).tobytes() == p.residuals([(), hidden]).tobytes()
    assert again.layout.floor.tobytes() == p.layout.floor.tobytes()
    assert (again.segments, again.error_definition, again.noise_floor()) == (
        p.segments,
        p.error_definition,
        p.noise_floor(),
    )


@every_way
def test_errors_are_told_with_a_unit_and_grow_with_the_error(name: str, way: str) -> None:
    p = problem(name, way)
    small, large = p.natural(1.0), p.natural(2.0)
    assert 0 < small < large and p.natural(0.0) == 0
    assert p.told(1.0) != p.told(2.0)
    assert p.natural_name and p.natural_unit and p.error_definition
    residual = p.residuals([()])[0]
    raw = p.raw(residual)
    if way == "free_run":
        weights = 1.0 / np.bincount(p.trial_of)[p.trial_of]
        mean = float(np.sum(np.abs(raw) * weights) / weights.sum())
        assert p.natural(error(residual)) == pytest.approx(mean, rel=1e-6)
        assert p.told(error(residual)).endswith(" mm" if name == "stage" else " mrad")
    if way == "force_balance":
        forces = np.concatenate([s.measured for s in p.series(()) if s.channel == 0])
        own = raw[p.channel_of == 0]
        if len(p.channels) == 1:
            share = np.sqrt(np.mean(own**2) / np.mean(forces**2))
            assert p.natural(error(residual)) == pytest.approx(share, rel=1e-6)
        assert p.told(error(residual)).endswith(" %")


@every_way
def test_what_is_simulated_has_the_poses_of_the_whole_trial(name: str, way: str) -> None:
    p = problem(name, way)
    motions = p.simulated(samples()[name].hidden)
    assert len(motions) == len(p.measured)
    for trial, motion in zip(p.measured, motions, strict=True):
        assert (motion is None) == (way == "force_balance")
        if motion is not None:
            assert len(motion) == len(trial.log) and motion.joints is not None and motion.base_pose is not None


@every_way
def test_compare_says_where_every_way_fails(name: str, way: str) -> None:
    p = problem(name, way)
    residual = p.residuals([()])[0]
    found = compare(p, residual)
    assert found.error == error(residual) and found.definition == p.error_definition
    assert {c.name for c in found.channels} == set(p.channels)
    assert len(found.trial_errors) == len(p.trials) == len(found.parted_s)
    together = sum(r.values for r in found.regimes if r.name in ("moving", "at rest"))
    assert together == pytest.approx(1.0), "every reading of a joint was taken while it moved or did not"
    shares = sum(r.share for r in found.regimes if r.name in ("moving", "at rest"))
    assert shares == pytest.approx(1.0)
    worst = found.channels[0]
    assert worst.rmse > 0 and worst.worst_from_s < worst.worst_to_s
    assert p.remarks(()) == p.remarks(())


def test_only_a_controller_in_the_loop_shows_its_wiring() -> None:
    p = problem("quadruped", "open_loop")
    assert p.looped == (1,)
    assert len(p.trust) == 2 and min(p.trust) > 0
    assert problem("arm", "free_run").looped == ()


def _with_channel(log: SensorLog, name: str) -> SensorLog:
    more = np.concatenate([log.sensors, log.sensors[:, :1]], axis=1)
    names, units = (*log.sensor_names, name), (*log.sensor_units, "N.m")
    return replace(log, sensors=more, sensor_names=names, sensor_units=units)


def test_what_was_not_measured_is_asked_for_in_one_line() -> None:
    robot, trials = samples()["pendulum"].robot, measured("pendulum")
    without = tuple(replace(t, log=replace(t.log, torques=None)) for t in trials)
    with pytest.raises(MeasurementError, match="no torques of the drives"):
        problem_by("force_balance", without, robot)
    net = replace(robot, sensors=(*robot.sensors, Sensor("load", "torque", "servo", "N.m")))
    with pytest.raises(MeasurementError, match=r"shows what friction leaves of them.*motor_torque"):
        problem_by("force_balance", tuple(replace(t, log=_with_channel(t.log, "load")) for t in without), net)
    blind = tuple(replace(t, log=replace(t.log, joints=None)) for t in trials)
    with pytest.raises(MeasurementError, match="no joint positions in its log"):
        problem_by("free_run", blind, robot)
    slow = tuple(replace(t, log=replace(t.log, times_s=2 * t.log.times_s)) for t in trials)
    with pytest.raises(MeasurementError, match="import it at 250 Hz"):
        problem_by("free_run", slow, robot)
    short = tuple(replace(t, log=t.log.head(100)) for t in trials)
    with pytest.raises(MeasurementError, match="only 100 rows"):
        problem_by("force_balance", short, robot)
    still = tuple(replace(t, log=replace(t.log, torques=np.zeros_like(t.log.torques))) for t in trials)
    with pytest.raises(MeasurementError, match="servo: its measured torque is zero"):
        problem_by("force_balance", still, robot)
    with pytest.raises(MeasurementError, match="of another robot"):
        problem_by("free_run", trials, samples()["arm"].robot, evaluator_for(robot))


def test_noise_of_the_sensors_is_in_the_measurements_and_not_in_what_a_free_run_predicts() -> None:
    """A draw of it would count against the true model as much as noise of the readings does."""
    name = next(n for n, way in CASES if way == "free_run")
    p = problem(name, "free_run")
    assert isinstance(p, FreeRun)
    noisy, quiet = (FreeRun(p.measured, with_noise(p.robot, n), p.evaluator) for n in (0.02, 0.0))
    assert np.array_equal(noisy.residuals([()]), quiet.residuals([()]))


@pytest.mark.parametrize("scale", [0.9, 1.0, 1.02, 2.0])
def test_a_share_of_the_excess_is_between_none_and_all_of_it(scale: float) -> None:
    """Where about as much as noise is left, one part of the data may lie far below it and another as far above."""
    compared = problem("arm", "open_loop")
    left = scale * compared.residuals([samples()["arm"].hidden])[0]
    assert all(0.0 <= r.share <= 1.0 for r in regimes(compared, left))
