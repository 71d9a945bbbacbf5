"""What each way finds on robots that are measured here: the same name by every way, parameters, ripples, closed loops."""

from __future__ import annotations

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from way_samples import measure, measured, problem, problem_by, samples

from ee_dist.discrepancy.compare import compare
from ee_dist.discrepancy.evidence.rule import above_noise
from ee_dist.discrepancy.examine import Effort
from ee_dist.discrepancy.explain import EFFECT, NOTHING_MISSING, explain
from ee_dist.discrepancy.measured_trial import evenly_read, read_every
from ee_dist.discrepancy.problem import error, joined
from ee_dist.discrepancy.search.candidates import candidate, candidates
from ee_dist.discrepancy.search.fit import fit_one
from ee_dist.discrepancy.search.fitted import Model
from ee_dist.discrepancy.search.search import Search
from ee_dist.discrepancy.ways.force_balance.problem import ForceBalance
from ee_dist.discrepancy.ways.force_balance.ripple import describe, remains
from ee_dist.discrepancy.ways.free_run.closed_loop import closed_loop
from ee_dist.discrepancy.ways.free_run.problem import FreeRun
from ee_dist.effects.catalogue import apply, term
from ee_dist.engines.one_joint import OneJointEngine
from ee_dist.measurements.errors import MeasurementError
from ee_dist.tasks.results.sections import curves
from ee_dist.viewing.curves import thinned

SUSPECTS = ("coulomb_friction", "viscous_friction", "parallel_spring", "offset_torque")
QUICK = Effort(first=4, second=2, final=2, starts=1)
SEEN = [("pendulum", "open_loop"), ("pendulum", "free_run"), ("pendulum", "force_balance"),
        ("arm", "open_loop"), ("arm", "free_run"), ("arm", "force_balance"),
        ("stage", "force_balance")]  # fmt: skip
"""The stage's controller hides friction from whoever looks at positions only."""


@pytest.mark.parametrize(("name", "way"), SEEN, ids=[f"{n}-{w}" for n, w in SEEN])
def test_the_same_hidden_effect_has_the_same_name_whatever_the_way(name: str, way: str) -> None:
    p, (hidden,) = problem(name, way), samples()[name].hidden
    if isinstance(p, FreeRun):
        p.effort = 0.4
    pool = candidates(p.robot, only=SUSPECTS, families=p.families)
    found = explain(p, pool, effort=QUICK)
    assert found.verdict == EFFECT and found.best is not None
    assert found.best.name == hidden.name
    assert found.best.terms[0].values[0][1] == pytest.approx(hidden.values[0][1], rel=0.12)
    if way != "force_balance":
        assert not found.left, "a filter loses what happens at a reversal; nothing else is left"


@pytest.mark.parametrize("way", ["open_loop", "free_run"])
def test_an_untouched_pendulum_misses_nothing(way: str) -> None:
    sample = samples()["pendulum"]
    p = problem_by(way, measure(sample, (), seed=3), sample.robot)
    p.effort = 0.4
    found = explain(p, candidates(p.robot, only=SUSPECTS), effort=QUICK)
    assert found.verdict == NOTHING_MISSING and found.best is None


def test_a_balance_of_forces_gives_mass_and_friction_of_a_stage() -> None:
    sample = samples()["stage"]
    heavy = (term("part_mass", "carriage", change=0.15), term("viscous_friction", "carriage", damping_nm_s_rad=150.0))
    p = problem_by("force_balance", measure(sample, heavy), sample.robot)
    model = Model((candidate(p.robot, "part_mass", "carriage"), candidate(p.robot, "viscous_friction", "carriage")))
    fit = fit_one(Search(p), model, [0.05 * model.upper])
    mass, damping = (t.values[0][1] for t in fit.hypothesis)
    assert mass == pytest.approx(0.15, abs=0.03)
    assert damping == pytest.approx(150.0, rel=0.03)
    assert error(fit.residual) < 0.3 * error(p.residuals([()])[0])


def test_a_ripple_over_position_is_told_with_its_wavelength() -> None:
    t = np.linspace(0, 20, 8000)
    x = 0.1 * np.sin(1.3 * t)
    v, a = np.gradient(x, t), np.gradient(np.gradient(x, t), t)
    noise = 0.05 * np.random.default_rng(0).standard_normal(len(t))
    found = remains("carriage", np.sin(2 * np.pi * x / 0.02) + noise, x, v, a)
    assert sum(r.time_share for r in found.regimes) == pytest.approx(1.0)
    assert sum(r.energy_share for r in found.regimes) == pytest.approx(1.0)
    assert {r.direction for r in found.ripples} == {"up", "down"}
    for ripple in found.ripples:
        assert ripple.wavelength == pytest.approx(0.02, rel=0.02)
        assert ripple.share > 0.9 and ripple.repeats > 0.9 and ripple.passes >= 3
    lines = describe(found, "N", "m")
    assert "a ripple of 0.0199 m" in lines[-1] or "a ripple of 0.02 m" in lines[-1]
    assert all(re.search(r" % of the time, .* % of the residual's energy, [\d.e-]+ N \(mean [+-][\d.e-]+ N\)", line)
               for line in lines[1 : 1 + len(found.regimes)]), "each number with its unit"  # fmt: skip
    # What does not repeat with position is not called a ripple, and what changes with direction is told by regime.
    other = remains("carriage", np.sign(v) + noise, x, v, a)
    means = {r.name: r.mean for r in other.regimes}
    assert means["cruising up"] > 0.9 and means["cruising down"] < -0.9
    assert all(r.share < 0.2 for r in other.ripples)


def test_what_a_way_alone_can_say_is_said_in_words() -> None:
    balance, free = problem("stage", "force_balance"), problem("pendulum", "free_run")
    assert any("near a reversal" in line for line in balance.remarks(()))
    # What people read is a share: the definition is of that number, and says what programs get.
    definition = balance.error_definition
    assert "as a share of that of the measured force" in definition and f"{balance.told(1.0)} of that" in definition
    assert isinstance(balance, ForceBalance) and isinstance(free, FreeRun)
    regimes = {r.name: r for r in balance.remains(()).regimes}
    assert regimes["cruising up"].mean > 15 and regimes["cruising down"].mean < -15, "20 N of friction"
    (line,) = free.remarks(())
    assert line.startswith("Started anew from the measured state every 0.5 s: ")
    off = free.mean_absolute(())
    assert off.shape == (2,) and (off > free.mean_absolute(samples()["pendulum"].hidden)).all()
    again = FreeRun(measured("pendulum"), free.robot, free.evaluator, windows_s=0.5)
    assert len(again.segments) == 2 * 6 and again.natural(error(again.residuals([()])[0])) < 0.9 * off.mean()


def test_in_a_closed_loop_forces_tell_what_positions_hide() -> None:
    sample, (trial, _) = samples()["stage"], measured("stage")
    truth = apply(sample.robot, sample.hidden)
    right, wrong = closed_loop([truth, sample.robot], trial, OneJointEngine())
    assert right.position < 0.001 and right.force < 0.05
    assert wrong.force > 3 * right.force and wrong.position < 0.01
    with pytest.raises(MeasurementError, match="joint positions and torques are needed"):
        closed_loop([truth], replace(trial, log=replace(trial.log, torques=None)), OneJointEngine())


def test_windows_of_a_trial_are_one_curve_that_breaks_off_between_them() -> None:
    free = problem("pendulum", "free_run")
    assert isinstance(free, FreeRun)
    again = FreeRun(measured("pendulum"), free.robot, free.evaluator, windows_s=0.5)
    parts, whole = again.series(()), joined(again.series(()))
    assert len(parts) == 2 * 6 and [(s.trial, s.channel) for s in whole] == [(0, 0), (1, 0)]
    for s in whole:
        own = [p for p in parts if p.trial == s.trial]
        assert np.isnan(s.predicted).sum() == 5 and (np.diff(s.times_s) >= 0).all()
        read = np.isfinite(s.predicted)
        np.testing.assert_array_equal(s.predicted[read], np.concatenate([p.predicted for p in own]))
    shown = curves(again, again.residuals([()])[0], [("model", ()), ("improved", samples()["pendulum"].hidden)])
    for o in shown:
        assert (
            o.improved is not None and len(o.improved) == len(o.times_s) and o.times_s[0] == 0 and o.times_s[-1] > 2.5
        )
        assert np.isnan(thinned(o, 60).predicted).sum() == 5


def test_a_robot_that_has_lost_all_that_moves_needs_no_force() -> None:
    balance = problem("pendulum", "force_balance")
    assert np.isfinite(balance.residuals([(term("part_lost", "arm"),)])).all()


def test_what_a_balance_says_of_a_joint_is_of_all_trials_as_in_the_table() -> None:
    balance = problem("arm", "force_balance")
    assert isinstance(balance, ForceBalance) and len(balance.measured) > 1
    table = {c.name: c.rmse for c in compare(balance, balance.residuals([()])[0]).channels}
    said = [line for line in balance.remarks(()) if "root mean square" in line]
    for line, name in zip(said, balance.channels, strict=True):
        rms, most = (float(n) for n in re.findall(r"([\d.]+) N\.m", line))
        assert line.startswith(f"{name}: ") and line.endswith(f"over {len(balance.measured)} trials")
        assert rms == pytest.approx(table[name], rel=0.01) and rms <= most


def test_a_pass_ends_with_its_trial() -> None:
    x = np.concatenate([np.linspace(0.0, 1.0, 200)] * 3)
    left, v = np.sin(40 * x), np.ones(len(x))
    found = remains("carriage", left, x, v, np.zeros(len(x)), np.repeat(np.arange(3), 200))
    assert found.trials == 3 and [r.passes for r in found.ripples] == [3]
    assert remains("carriage", left, x, v, np.zeros(len(x))).ripples[0].passes == 1


def test_a_trial_at_one_slow_speed_is_not_near_a_reversal() -> None:
    """What is slow is so beside the pace of its own trial: the other may be eighty times as quick."""
    slow, quick = np.full(300, 0.02), np.full(300, 1.5)
    v, x = np.concatenate([slow, quick]), np.concatenate([np.cumsum(slow), np.cumsum(quick)])
    a, which = np.zeros(600), np.repeat([0, 1], 300)
    a[300] = 1.0
    left = np.random.default_rng(0).standard_normal(600)
    found = {r.name: r.time_share for r in remains("joint", left, x, v, a, which).regimes}
    assert found == {"speeding up or slowing down": 1 / 600, "cruising up": 599 / 600}
    still = {r.name: r.time_share for r in remains("joint", left, x, v * np.repeat([0.001, 1], 300), a, which).regimes}
    assert still["near a reversal"] == 0.5, "what stands still has no pace of its own"


@pytest.mark.parametrize("way", ["open_loop", "free_run", "force_balance"])
def test_what_is_known_of_a_trial_is_not_changed_by_what_is_believed_of_the_robot(way: str) -> None:
    """A load that was weighed weighs that, however light the part is that carries it."""
    sample, load = samples()["arm"], term("payload", "lower", mass_kg=0.4, x_m=0.2)
    trials = tuple(replace(t, setup=(load,)) for t in measured("arm"))
    lighter = term("part_mass", "lower", change=-0.8)
    found = problem_by(way, trials, sample.robot)
    by_hand = problem_by(way, trials, apply(sample.robot, (lighter,)))
    told, described = found.raw(found.residuals([(lighter,)])[0]), by_hand.raw(by_hand.residuals([()])[0])
    bare = found.raw(found.residuals([()])[0])
    assert np.nanmax(np.abs(told - described)) < 0.02 * np.nanmax(np.abs(bare - described))


def test_the_order_of_trials_that_were_read_at_two_paces_changes_nothing() -> None:
    """One filter for all of them, at the pace of the slowest: the first trial's had decided it."""
    first, second = measured("arm")
    step = float(np.median(np.diff(first.log.times_s)))
    slow = replace(second, log=evenly_read(read_every(second.log, 3 * step)))
    robot = samples()["arm"].robot
    one, other = (problem_by("force_balance", trials, robot) for trials in ((first, slow), (slow, first)))
    assert one.error_definition == other.error_definition and "read the most seldom" in one.error_definition
    errors = [error(p.residuals([()])[0]) for p in (one, other)]
    assert errors[0] == pytest.approx(errors[1], rel=1e-4)
    assert "read the most seldom" not in problem_by("force_balance", (first, second), robot).error_definition


def test_a_floor_above_all_of_an_error_is_no_floor() -> None:
    bound = SimpleNamespace(floor=np.full(10, 5.0), sure=np.full(10, 1.0))
    assert above_noise(bound, 80.0) == pytest.approx(30.0), "above it, what it leaves"  # type: ignore[arg-type]
    assert above_noise(bound, 40.0) == pytest.approx(30.0), "below it, what is noise beyond doubt"  # type: ignore[arg-type]
    assert above_noise(bound, 5.0) < 1e-9  # type: ignore[arg-type]
