"""A sensor that is dead, and told to be: its model leaves exactly nothing there, which tells all about it and hinders no fit."""

from __future__ import annotations

import numpy as np
import pytest

from ee_dist.discrepancy.evidence.holdout import windows
from ee_dist.discrepancy.evidence.intervals import half_widths
from ee_dist.discrepancy.examine import Current
from ee_dist.discrepancy.measured_trial import MeasuredTrial, driver_of
from ee_dist.discrepancy.problem import error
from ee_dist.discrepancy.search.candidates import candidate
from ee_dist.discrepancy.search.fitted import Model
from ee_dist.discrepancy.search.search import Search
from ee_dist.discrepancy.search.slopes import counted, follow_slopes, gauss_newton
from ee_dist.discrepancy.search.valley import follow_valley
from ee_dist.discrepancy.told import told_only
from ee_dist.discrepancy.ways.open_loop.problem import OpenLoop
from ee_dist.effects.catalogue import term
from ee_dist.engines.mujoco.engine import MuJoCoEngine
from ee_dist.evaluation.physical import PhysicalRobot
from ee_dist.evaluation.serial import SerialEvaluator
from ee_dist.robots.servo_pendulum import servo_pendulum
from ee_dist.trials.excitation import Excitation
from ee_dist.trials.noise import with_noise

ROBOT = servo_pendulum()
NOISY = with_noise(ROBOT, 0.002)
FRICTION = term("coulomb_friction", "servo", torque_nm=0.08)
PARTS = tuple(
    candidate(ROBOT, effect, target)
    for effect, target in (("sensor_failing", "speed"), ("coulomb_friction", "servo"), ("viscous_friction", "servo"))
)


@pytest.fixture(scope="module")
def search() -> Search:
    """Three motions with dry friction, in which the speed reads the same number in every row."""
    engine, trials = MuJoCoEngine(1), []
    for k, kind in enumerate(("multisine", "slow_sines", "steps")):
        motion = Excitation(kind, 3.0, 0.4, k + 1)
        driver = driver_of(motion, NOISY)
        log = PhysicalRobot(engine, NOISY, (FRICTION,), np.random.SeedSequence(k)).trial(driver, motion.steps(ROBOT))
        sensors = log.sensors.copy()
        sensors[:, list(log.sensor_names).index("speed")] = 0.0
        trials.append(MeasuredTrial(kind, type(log)(**{**vars(log), "sensors": sensors}), driver))
    return Search(OpenLoop(trials, ROBOT, SerialEvaluator(engine)))


@pytest.mark.parametrize("follow", [follow_slopes, follow_valley])
@pytest.mark.parametrize("prior", [0.0, 5.0])
def test_fits_go_on_beside_it(search, follow, prior) -> None:
    start = np.array([1.0, 0.3 * PARTS[1].shares({"torque_nm": 0.08})[0], 0.1])
    (fit,) = follow(search, [(Model(PARTS), start)], search.everything, prior=prior)
    assert fit.u[0] == 1.0, "dead, not nearly"
    values = dict(fit.hypothesis[1].values)
    assert values["torque_nm"] == pytest.approx(0.08, rel=0.1)
    (right,) = search.problem.residuals([(term("sensor_failing", "speed", loss=1.0), FRICTION)])
    assert error(fit.residual) < 1.01 * error(right)
    assert half_widths(search.problem, fit)[0] < 0.2, "told, and not *not determined*"


def test_it_stays_in_the_model_that_is_left_in_the_end(search) -> None:
    useless = candidate(ROBOT, "parallel_spring", "servo")
    parts = (*PARTS, useless)
    u = np.concatenate([[1.0], PARTS[1].shares({"torque_nm": 0.08}), np.zeros(1), 0.01 * np.ones(useless.size)])
    told = told_only(search, Current(parts, u), 0, windows(search.problem), 50)
    assert {"viscous_friction@servo", useless.name} <= set(told.gone)
    assert {c.name for c in told.then.parts} == {"sensor_failing@speed", "coulomb_friction@servo"}


def test_a_residual_of_nothing_weighs_only_what_moves_nothing_else() -> None:
    change = np.array([[2.0, 0.0], [3.0, 4.0]])
    smooth, weights = np.array([0.0, 2.0]), np.array([0.0, 0.5])
    assert counted(change, weights, smooth).tolist() == [[0.0, 0.0], [1.5, 2.0]]
    assert counted(change[:, :1], np.array([0.0, 0.0]), smooth).tolist() == [[2.0], [0.0]]


@pytest.mark.parametrize(("slope", "stays"), [(30.0, True), (3.0, False)])
def test_the_prior_moves_a_value_from_its_end_only_where_data_hardly_tell_it(slope, stays) -> None:
    model = Model(PARTS[:1])
    step = gauss_newton(np.array([[slope], [0.0]]), np.array([0.0, 1.0]), np.array([1.0]), 1.0, model)
    assert bool(step[0] == 0.0) is stays and step[0] <= 0.0
    pulled = gauss_newton(np.array([[slope]]), np.array([5.0]), np.array([1.0]), 1.0, model)
    assert pulled[0] < -0.1, "data ask for less"
