"""What readings show by themselves of an effect's values, and a search that looks there."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from way_samples import Sample, measure, problem_by

from ee_dist.discrepancy.explain import explain
from ee_dist.discrepancy.finished import EXPLAINED
from ee_dist.discrepancy.improve import _seen_by_itself, improve
from ee_dist.discrepancy.measured_trial import MeasuredTrial
from ee_dist.discrepancy.problem import Problem
from ee_dist.discrepancy.search.candidates import Candidate, Proposal, candidate
from ee_dist.discrepancy.search.fit import fit_one
from ee_dist.discrepancy.search.fitted import Model
from ee_dist.discrepancy.search.pool import pool_of
from ee_dist.discrepancy.search.scan import scan
from ee_dist.discrepancy.search.screen import screen
from ee_dist.discrepancy.search.search import Search
from ee_dist.effects.catalogue import CATALOGUE, Hypothesis, term
from ee_dist.effects.effect import EffectError
from ee_dist.robots.model import Robot
from ee_dist.robots.servo_pendulum import servo_pendulum
from ee_dist.trials.excitation import Excitation
from ee_dist.trials.log import Array
from ee_dist.trials.noise import with_noise

STEP = 0.0731
COARSE = (term("sensor_quantisation", "position", step=STEP),)


def problem_of(hidden: Hypothesis) -> Problem:
    robot = with_noise(servo_pendulum(), 1e-3)
    plan = tuple(Excitation(kind, 3.0, 0.5, k) for k, kind in enumerate(("multisine", "steps")))
    return problem_by("open_loop", measure(Sample(robot, plan, hidden, ()), hidden), robot)


def steps_of(problem: Problem) -> dict[str, Candidate]:
    return {c.target: c for c in pool_of(problem) if c.effect.name == "sensor_quantisation"}


def test_steps_of_a_sensor_are_taken_from_its_readings() -> None:
    problem = problem_of(COARSE)
    found = steps_of(problem)
    assert found["position"].values(np.array(found["position"].hint))["step"] == pytest.approx(STEP, rel=1e-6)
    assert found["speed"].hint == (), "it has noise, and no steps"
    assert not any(c.hint for c in pool_of(problem) if c.effect.name != "sensor_quantisation")


def test_a_supply_that_was_measured_is_not_said_to_sag_more() -> None:
    robot = with_noise(servo_pendulum(), 1e-3)
    follows, ignores = (
        replace(robot, drives=tuple(replace(d, supply_nominal_v=v) for d in robot.drives)) for v in (12.0, 0.0)
    )
    trials = measure(Sample(robot, (Excitation("multisine", 1.0, 0.5, 0),), (), ()), ())
    volts = tuple(replace(t, log=replace(t.log, supply_v=np.full(len(t.log.times_s), 11.5))) for t in trials)

    def proposed(some: tuple[MeasuredTrial, ...], of: Robot) -> bool:
        return "supply_sag" in {c.effect.name for c in pool_of(problem_by("open_loop", some, of))}

    assert not proposed(volts, follows)
    assert proposed(volts, ignores), "drives that do not follow the voltage"
    assert proposed(trials, follows), "nothing was measured"


def test_what_no_slope_leads_to_is_looked_at_and_kept() -> None:
    problem = problem_of(COARSE)
    coarse, search = steps_of(problem)["position"], Search(problem)
    (screened,) = screen(search, [coarse])
    (scanned,) = scan(search, [screened])
    assert scanned.starts[0] == pytest.approx(coarse.hint)
    fit = fit_one(search, Model((coarse,)), [np.array([0.6])])
    assert fit.hypothesis[0].values[0][1] == pytest.approx(STEP, rel=0.01)
    (true,) = problem.residuals([COARSE])
    assert fit.energy <= 1.001 * float(true @ true)


@pytest.mark.parametrize(
    ("seen_in", "said"),
    [(lambda _: 1 / 0, "its seen_in failed: ZeroDivisionError"), (lambda _: {"size": 1.0}, "no parameter 'size'")],
)
def test_what_a_user_s_own_reading_gets_wrong_is_said(seen_in: Callable[[Array], dict[str, float]], said: str) -> None:
    own = replace(CATALOGUE["sensor_quantisation"], seen_in=seen_in)
    with pytest.raises(EffectError, match=said):
        own.shown_in(np.zeros(5))
    other = replace(CATALOGUE["upper_stop"], seen_at=lambda *_: seen_in(np.zeros(5)))
    with pytest.raises(EffectError, match=said.replace("seen_in", "seen_at")):
        other.shown_at(servo_pendulum(), "servo", np.zeros(5), np.zeros(5))


def test_what_readings_show_is_checked_by_the_effect_that_says_so_whatever_is_registered() -> None:
    known = CATALOGUE["sensor_quantisation"]
    coarser = tuple(replace(p, lower=2.0, upper=3.0, neutral=2.0) for p in known.parameters)
    own = replace(known, name="of_nobody_s", parameters=coarser, seen_in=lambda values: {"step": values[0]})
    assert own.shown_in(np.full(5, 2.5)) == {"step": 2.5}
    with pytest.raises(EffectError, match=r"of_nobody_s: step = 1 lies outside \[2, 3\]"):
        own.shown_in(np.ones(5))


def test_a_sensor_with_many_steps_gives_no_hint() -> None:
    assert all(c.hint == () for c in steps_of(problem_of(())).values())


def stops_of(problem: Problem, *only: str) -> dict[str, Candidate]:
    return {c.effect.name: c for c in pool_of(problem, (), only) if c.effect.name.endswith("_stop")}


@pytest.mark.parametrize(("name", "side"), [("upper_stop", 1.0), ("lower_stop", -1.0)])
def test_a_stop_on_one_side_is_seen_where_commands_go_beyond_it_and_is_found(name: str, side: float) -> None:
    joint = servo_pendulum().joint("servo")
    at = 0.25 * side
    nearer = joint.upper - at if side > 0 else at - joint.lower
    hidden = (term(name, "servo", nearer_rad=nearer),)
    problem = problem_of(hidden)
    (seen,) = stops_of(problem).values()
    assert seen.effect.name == name, "nothing ends on the other side"
    assert seen.values(np.array(seen.hint))["nearer_rad"] == pytest.approx(nearer, abs=0.02)
    rivals = (
        "command_gain",
        "position_gain",
        "zero_offset",
        "deadband",
        "sensor_failing",
        "sensor_stuck",
        "motor_weak",
    )
    found = explain(problem, [c for c in pool_of(problem) if c.effect.name in (name, *rivals)])
    assert found.best is not None and found.best.name == f"{name}@servo"
    assert dict(found.best.terms[0].values)["nearer_rad"] == pytest.approx(nearer, abs=0.01)


def test_where_no_joint_ends_no_stop_is_proposed_but_to_who_asks() -> None:
    in_order, weak = problem_of(()), problem_of((term("motor_weak", "servo", loss=0.5),))
    assert stops_of(in_order) == {} and stops_of(weak) == {}, "a soft motor comes back before its command does"
    assert {c.hint for c in stops_of(in_order, "upper_stop").values()} == {()}
    torques = CATALOGUE["upper_stop"].seen_at
    assert torques is not None
    robot = in_order.robot
    loose = replace(robot, drives=tuple(replace(d, command="torque") for d in robot.drives))
    told, at = np.linspace(-1.0, 1.0, 100), np.minimum(np.linspace(-1.0, 1.0, 100), 0.2)
    assert torques(robot, "servo", told, at) and not torques(loose, "servo", told, at), "a torque is no place"


@pytest.mark.parametrize("hinted", [True, False])
def test_a_stop_that_is_seen_goes_before_what_is_a_little_wrong_everywhere(hinted: bool) -> None:
    stop = replace(candidate(servo_pendulum(), "upper_stop", "servo"), hint=(0.5,) if hinted else ())
    friction = candidate(servo_pendulum(), "coulomb_friction", "servo")
    found = [SimpleNamespace(proposal=Proposal(parts)) for parts in ((stop,), (friction, stop), (friction,))]
    assert [_seen_by_itself(f) for f in found] == [hinted, hinted, False]  # type: ignore[arg-type]


def test_improve_finds_a_stop_and_friction_beside_it() -> None:
    joint = servo_pendulum().joint("servo")
    hidden = (
        term("upper_stop", "servo", nearer_rad=joint.upper - 0.25),
        term("coulomb_friction", "servo", torque_nm=0.2),
    )
    problem = problem_of(hidden)
    names = ("upper_stop", "coulomb_friction", "command_gain", "position_gain", "zero_offset", "viscous_friction")
    found = improve(problem, [c for c in pool_of(problem) if c.effect.name in names])
    told = {t.effect: dict(t.values) for t in found.terms}
    assert set(told) == {"upper_stop", "coulomb_friction"} and found.verdict == EXPLAINED
    assert joint.upper - told["upper_stop"]["nearer_rad"] == pytest.approx(0.25, abs=0.01)
    assert told["coulomb_friction"]["torque_nm"] == pytest.approx(0.2, rel=0.05)


@pytest.mark.parametrize(("speed", "most"), [(0.0, 1.0), (1.0, 0.75)])
def test_a_sensor_that_moves_is_not_dead(speed: float, most: float) -> None:
    """Whatever the model does: between its stops the joint cannot have moved so far that a few per cent of it were read."""
    problem = problem_of(())
    at = problem.robot.sensor_names.index("position")

    def read(trial: MeasuredTrial) -> MeasuredTrial:
        sensors = trial.log.sensors * np.where(np.arange(len(problem.robot.sensors)) == at, speed, 1.0)
        return replace(trial, log=replace(trial.log, sensors=sensors))

    problem.measured = tuple(read(t) for t in problem.measured)
    (failing,) = (c for c in pool_of(problem) if c.name == "sensor_failing@position")
    (_, high), (lower, upper) = failing.bounds[0], problem.robot.joint(problem.robot.sensors[at].target).ends
    values = np.concatenate([t.log.sensors[:, at] for t in problem.measured])
    assert high <= most and (high == 1.0) == (speed == 0.0)
    assert high >= 1.0 - np.ptp(values) / (upper - lower), "all that its stops allow"
