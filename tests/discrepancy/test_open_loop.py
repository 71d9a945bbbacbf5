"""The problem of a whole robot: what faulty sensors report, and what a calibration widens."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from way_samples import measure, problem_by, samples

from ee_dist.discrepancy.accounts.of_compare import compare_account
from ee_dist.discrepancy.compare import compare
from ee_dist.discrepancy.evidence.left import leftovers
from ee_dist.discrepancy.evidence.rule import LUCK
from ee_dist.discrepancy.examine import Effort
from ee_dist.discrepancy.explain import EFFECT, NOTHING_MISSING, explain
from ee_dist.discrepancy.measured_trial import MeasuredTrial, driver_of, setup_of
from ee_dist.discrepancy.problem import Series, error
from ee_dist.discrepancy.search.candidates import candidates
from ee_dist.discrepancy.search.pool import pool_of
from ee_dist.discrepancy.search.screen import screen
from ee_dist.discrepancy.search.search import Search
from ee_dist.discrepancy.ways.open_loop.calibration import unmodelled_by
from ee_dist.discrepancy.ways.open_loop.in_units import in_units, told_in_units
from ee_dist.discrepancy.ways.open_loop.problem import OpenLoop
from ee_dist.discrepancy.ways.open_loop.unmodelled import from_entries, of_trial, to_entries
from ee_dist.effects.catalogue import Hypothesis, term
from ee_dist.engines.contract import Engine
from ee_dist.engines.mujoco.engine import MuJoCoEngine
from ee_dist.engines.pybullet.engine import PyBulletEngine
from ee_dist.evaluation.cache import CachedEvaluator
from ee_dist.evaluation.physical import PhysicalRobot
from ee_dist.evaluation.serial import SerialEvaluator
from ee_dist.robots.model import Sensor
from ee_dist.robots.quadruped_lab import quadruped_lab
from ee_dist.tasks.config import ConfigError
from ee_dist.tasks.measurements import _calibration
from ee_dist.trials.excitation import Excitation
from ee_dist.trials.noise import with_noise

ROBOT = with_noise(quadruped_lab(), 0.02)
GAIT = Excitation("gait", seconds=4.0)


def trials(engine: Engine, hidden: Hypothesis, seed: int = 0) -> list[MeasuredTrial]:
    held = setup_of(GAIT)
    driver = driver_of(GAIT, ROBOT)
    hardware = PhysicalRobot(engine, ROBOT, (*hidden, *held), np.random.SeedSequence(seed))
    return [MeasuredTrial("gait", hardware.trial(driver, GAIT.steps(ROBOT)), driver, held)]


@pytest.fixture(scope="module")
def mujoco() -> MuJoCoEngine:
    return MuJoCoEngine(1)


def problem(engine: Engine, measured: list[MeasuredTrial], **settings: object) -> OpenLoop:
    return OpenLoop(measured, ROBOT, CachedEvaluator(SerialEvaluator(engine)), **settings)  # type: ignore[arg-type]


def test_a_sensor_fault_too_small_to_matter_costs_nothing(mujoco: MuJoCoEngine) -> None:
    p = problem(mujoco, trials(mujoco, ()))
    faults = [
        (term("sensor_failing", "touch_front_left", loss=1e-6),),
        (term("sensor_gain", "roll", change=1e-6),),
        (term("sensor_delay", "torque_knee_rear_left", delay_s=1e-6),),
    ]
    base, *others = (float(r @ r) for r in p.residuals([(), *faults]))
    for found in others:
        assert found == pytest.approx(base, abs=6.0), "no other channel may look worse for it"


@pytest.mark.parametrize("coarse", ["all", "one"])
def test_how_most_sensors_are_is_not_what_is_wrong_with_one(mujoco: MuJoCoEngine, coarse: str) -> None:
    (trial,) = trials(mujoco, ())
    places = [c for c, s in enumerate(ROBOT.sensors) if s.kind == "position"]
    values = trial.log.sensors.copy()
    for c in places if coarse == "all" else places[:1]:
        step = 0.5 * float(np.ptp(values[:, c]))
        values[:, c] = np.round(values[:, c] / step) * step
    p = problem(mujoco, [replace(trial, log=replace(trial.log, sensors=values))])
    first, single = ROBOT.sensors[places[0]].name, coarse == "one"
    names = {c.name for c in pool_of(p)}
    assert (f"sensor_dropout@{first}" in names, f"sensor_quantisation@{first}" in names) == (single, single)
    assert "sensor_noise@roll" in names and f"sensor_stuck@{first}" in names, "others are told by other marks"
    assert len(p.notes) == (0 if single else 1)
    account = compare_account(p, compare(p, p.residuals([()])[0]), [])
    assert set(p.notes) <= set(account.words), "every verb says so"
    left_out = p.residuals([()])[0]
    p.weights = replace(p.weights, repeating=frozenset())
    assert (float(left_out @ left_out) == pytest.approx(float((p.residuals([()])[0] ** 2).sum()))) == single


def test_a_stuck_touch_sensor_is_better_explained_by_the_truth_than_by_nothing(mujoco: MuJoCoEngine) -> None:
    hidden = (term("sensor_stuck", "touch_front_right", share=0.7, from_s=0.65),)
    p = problem(mujoco, trials(mujoco, hidden))
    nothing, truth = p.residuals([(), hidden])
    assert float(nothing @ nothing) - float(truth @ truth) > 100.0
    pool = candidates(ROBOT, only=["sensor_stuck@touch_front_right", "sensor_stuck@touch_rear_left"])
    right, wrong = sorted(screen(Search(p), pool), key=lambda s: -s.promise)
    assert right.candidate.target == "touch_front_right"
    assert right.promise > 5 * wrong.promise


def test_a_calibration_widens_what_the_other_engine_does_differently(mujoco: MuJoCoEngine) -> None:
    bullet = PyBulletEngine()
    try:
        first, again = trials(bullet, (), 1), trials(bullet, (), 2)
    finally:
        bullet.close()
    strict = problem(mujoco, first)
    left = unmodelled_by(strict, strict.residuals([()])[0])
    assert set(left) == {"gait"}
    known = problem(mujoco, again, unmodelled=left)
    raw = problem(mujoco, again)
    assert error(raw.residuals([()])[0]) > 1.3 * raw.noise_floor()[0], "the engines differ in a gait"
    assert error(known.residuals([()])[0]) < error(raw.residuals([()])[0])
    assert leftovers(raw, raw.residuals([()])[0])
    assert not leftovers(known, known.residuals([()])[0]), "nothing new on another untouched robot"
    assert known.noise_floor()[1].endswith("and what calibration left")


def test_a_calibration_survives_its_file_and_serves_trials_it_did_not_see(tmp_path: Path) -> None:
    names, units = ROBOT.sensor_names, [s.unit for s in ROBOT.sensors]
    rng = np.random.default_rng(0)
    before = {"gait": rng.random((2, len(names))), "sway": rng.random((2, len(names)))}
    after = from_entries(to_entries(before, names, units), names)  # type: ignore[arg-type]
    for trial in before:
        assert np.array_equal(before[trial], of_trial(after, trial, len(names)))
    unseen = of_trial(after, "hops", len(names))
    assert np.array_equal(unseen, np.maximum(before["gait"], before["sway"]))
    assert not of_trial({}, "hops", len(names)).any()
    path = tmp_path / "model.yaml"
    path.with_suffix(".calibration.yaml").write_text("unmodelled: {roll: {deviation: 1}}\n")
    with pytest.raises(ConfigError, match="not a calibration"):
        _calibration(path, ROBOT)
    entries = to_entries(before, names, units)  # type: ignore[arg-type]
    path.with_suffix(".calibration.yaml").write_text(yaml.safe_dump({"unmodelled": entries, "gained": 21.5}))
    left, gained, way = _calibration(path, ROBOT)
    assert left is not None and set(left) == set(before) and gained == 21.5 and way == "open_loop"


def test_what_an_effect_took_off_an_untouched_robot_is_no_evidence(mujoco: MuJoCoEngine) -> None:
    p = problem(mujoco, trials(mujoco, (term("sensor_bias", "roll", bias=0.02),)))
    pool = candidates(ROBOT, only=["sensor_bias@roll", "sensor_bias@pitch"])
    quick = Effort(first=2, second=2, final=2, starts=1)
    found = explain(p, pool, effort=quick)
    assert found.verdict == EFFECT and found.best is not None
    p.gained = found.best.gain * float(np.sum(found.base**2))
    again = explain(p, pool, effort=quick)
    assert again.verdict != EFFECT and again.verdict != NOTHING_MISSING, (
        "an effect took as much where nothing was wrong"
    )
    assert again.candidates[0].why_not == LUCK


@pytest.mark.parametrize(("name", "said"), [("speed", "speed"), ("velocity_servo", "velocity"), ("qd", "velocity")])
def test_a_channel_of_speeds_is_told_by_the_word_that_it_goes_by(name: str, said: str) -> None:
    series = Series(0, 0, "rad/s", np.zeros(1), np.ones(1), np.zeros(1))
    (line,) = told_in_units([in_units([series], [Sensor(name, "velocity", "servo", "rad/s")])])
    assert line == f"{said} 1 rad/s"


def test_errors_are_told_in_the_units_of_the_channels_too() -> None:
    sample = samples()["pendulum"]
    problem = problem_by("open_loop", measure(sample, sample.hidden), sample.robot)
    (line,) = problem.other_errors((), sample.hidden)
    assert line.startswith("Root mean squares over all rows of these trials: position ")
    worst = 0.0
    for series in problem.series(()):
        if problem.robot.sensors[series.channel].kind == "position":
            worst = max(worst, float(np.sqrt(np.mean((series.measured - series.predicted) ** 2))))
    before, after = (float(word) for word in re.findall(r"([\d.e+-]+) mrad", line))
    assert 0 < after < 0.2 * before and before <= 1001 * worst


def test_the_beginning_of_trials_is_the_same_problem_cut_short() -> None:
    sample = samples()["pendulum"]
    whole = problem_by("open_loop", measure(sample, sample.hidden), sample.robot)
    seconds = min(float(t.log.times_s[-1]) for t in whole.measured)
    brief = whole.beginning(0.4 * seconds)
    assert isinstance(brief, OpenLoop) and isinstance(whole, OpenLoop)
    assert brief.trials == whole.trials and brief.channels == whole.channels
    for short, full in zip(brief.measured, whole.measured, strict=True):
        assert short.log.times_s[-1] < 0.4 * seconds
        np.testing.assert_array_equal(short.log.sensors, full.log.sensors[: len(short.log)])
    for hypothesis in ((), sample.hidden):
        (found,), (there,) = brief.residuals([hypothesis]), whole.residuals([hypothesis])
        for k in range(len(whole.trials)):
            first = brief.views.raw_blocks(k, found)
            np.testing.assert_allclose(first, whole.views.raw_blocks(k, there)[: len(first)], atol=1e-6)
    assert whole.beginning(0.8 * seconds) is whole, "to save a fifth is not worth another look"
