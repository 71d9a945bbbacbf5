"""Effects on sensors and wiring do what their numbers say."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from effect_robots import Bench, block, slider

from ee_dist.effects import apply, term
from ee_dist.effects.catalogue import Term
from ee_dist.engines.contract import Rollout
from ee_dist.engines.drivers import HIDDEN, Commands, Network, weight_count
from ee_dist.robots.model import Shape
from ee_dist.robots.quadruped import quadruped
from ee_dist.trials.log import Array

STEPS = 1000
SWING = 0.3 * np.sin(np.arange(STEPS) * 0.001 * 6.0)


def reported(bench: Bench, *terms: Term, seed: int | None = None) -> tuple[Array, Array]:
    """True and reported positions (T,) of a slide that is swung, under terms."""
    log = bench.run(slider(kp=400.0, kd=60.0), *terms, steps=STEPS, command=SWING, seed=seed)
    assert log.joints is not None
    return log.joints[:, 0], log.channel("position")


def test_sensor_failing_reports_the_share_that_is_left(bench: Bench) -> None:
    true, found = reported(bench, term("sensor_failing", "position", loss=0.3))
    np.testing.assert_allclose(found, 0.7 * true)
    _, dead = reported(bench, term("sensor_failing", "position", loss=1.0))
    assert not dead.any()


def test_sensor_gain_reports_too_much(bench: Bench) -> None:
    true, found = reported(bench, term("sensor_gain", "position", change=0.3))
    np.testing.assert_allclose(found, 1.3 * true)


def test_sensor_bias_shifts_the_reading(bench: Bench) -> None:
    true, found = reported(bench, term("sensor_bias", "position", bias=-0.07))
    np.testing.assert_allclose(found, true - 0.07)


def test_sensor_noise_has_its_deviation_and_no_memory(bench: Bench) -> None:
    true, found = reported(bench, term("sensor_noise", "position", deviation=0.05), seed=3)
    error = found - true
    assert error.std() == pytest.approx(0.05, rel=0.1)
    assert abs(error.mean()) < 4 * 0.05 / np.sqrt(STEPS)
    assert abs(np.corrcoef(error[1:], error[:-1])[0, 1]) < 0.15
    _, other = reported(bench, term("sensor_noise", "position", deviation=0.05), seed=4)
    assert (other != found).any()


def test_sensor_noise_adds_to_noise_by_squares() -> None:
    once = term("sensor_noise", "position", deviation=0.3)
    robot = apply(slider(), (once, term("sensor_noise", "position", deviation=0.4)))
    assert robot.sensors[0].noise == pytest.approx(0.5)


def test_sensor_delay_shifts_the_reading_by_its_time(bench: Bench) -> None:
    true, found = reported(bench, term("sensor_delay", "position", delay_s=0.035))
    np.testing.assert_array_equal(found[35:], true[:-35])
    assert (found[:35] == true[0]).all()
    _, between = reported(bench, term("sensor_delay", "position", delay_s=0.0355))
    np.testing.assert_allclose(between[36:], (true[1:-35] + true[:-36]) / 2, atol=1e-12)


def test_sensor_quantisation_reports_the_nearest_step(bench: Bench) -> None:
    true, found = reported(bench, term("sensor_quantisation", "position", step=0.02))
    np.testing.assert_allclose(found / 0.02, np.round(found / 0.02), atol=1e-9)
    assert np.abs(found - true).max() <= 0.01 + 1e-12


def test_sensor_stuck_holds_the_value_that_it_had(bench: Bench) -> None:
    true, found = reported(bench, term("sensor_stuck", "position", share=1.0, from_s=0.2))
    np.testing.assert_array_equal(found[:200], true[:200])
    assert (found[200:] == true[199]).all()
    assert found[-1] != 0
    _, first = reported(bench, term("sensor_stuck", "position", share=1.0))
    assert (first == true[0]).all()


def test_sensor_stuck_in_part_follows_the_rest_of_the_movement(bench: Bench) -> None:
    true, found = reported(bench, term("sensor_stuck", "position", share=0.6, from_s=0.2))
    np.testing.assert_allclose(found[200:], true[199] + 0.4 * (true[200:] - true[199]))


def test_sensor_dropout_repeats_its_share_of_the_readings(bench: Bench) -> None:
    true, found = reported(bench, term("sensor_dropout", "position", share=0.3), seed=1)
    repeated = found[1:] == found[:-1]
    assert repeated.mean() == pytest.approx(0.3, abs=0.05)
    np.testing.assert_array_equal(found[1:][~repeated], true[1:][~repeated])


def test_missed_touch_comes_late_and_goes_at_once(bench: Bench) -> None:
    robot = block(height_m=0.15, shape=Shape("sphere", (0.1,)))
    on_time, late = (
        bench.run(robot, term("missed_touch", "touch", missed_s=wait), steps=400).channel("touch") > 0
        for wait in (0.0, 0.05)
    )
    assert on_time.any()
    assert not on_time[0]
    pressed, expected = 0, []
    for down in on_time:
        pressed = pressed + 1 if down else 0
        expected.append(pressed > 50)
    np.testing.assert_array_equal(late, expected)


def gait(bench: Bench, driver: Commands | Network, *terms: Term) -> Array:
    (log,) = bench.engine.rollout([Rollout(apply(quadruped(), terms), driver, 60)])
    return log.commands


def test_hidden_neuron_failing_is_a_network_without_it(bench: Bench) -> None:
    weights = np.random.default_rng(0).uniform(-1, 1, weight_count(8, 8))
    without = weights.copy()
    recurrent, out = without[9 * HIDDEN : 9 * HIDDEN + HIDDEN**2], without[9 * HIDDEN + HIDDEN**2 :]
    recurrent.reshape(HIDDEN, HIDDEN)[:, 1] = 0.0
    out.reshape(8, HIDDEN + 1)[:, 1] = 0.0
    dead = gait(bench, Network(tuple(weights)), term("hidden_neuron_failing", "hidden_1", loss=1.0))
    np.testing.assert_array_equal(dead, gait(bench, Network(tuple(without))))
    half = gait(bench, Network(tuple(weights)), term("hidden_neuron_failing", "hidden_1", loss=0.5))
    assert (half != dead).any()


def test_motors_tied_gives_two_motors_one_command(bench: Bench) -> None:
    sent = np.random.default_rng(0).uniform(-0.1, 0.1, (60, 8))
    found = gait(bench, Commands(sent), term("motors_tied", "knee_front_left+hip_rear_right"))
    expected = sent.copy()
    expected[:, 6] = sent[:, 1]
    np.testing.assert_array_equal(found, expected)


def test_motors_swapped_exchanges_their_commands(bench: Bench) -> None:
    sent = np.random.default_rng(0).uniform(-0.1, 0.1, (60, 8))
    swap = term("motors_swapped", "knee_front_left+hip_rear_right")
    expected = sent.copy()
    expected[:, [1, 6]] = sent[:, [6, 1]]
    np.testing.assert_array_equal(gait(bench, Commands(sent), swap), expected)
    np.testing.assert_array_equal(gait(bench, Commands(sent), swap, swap), sent)


def test_a_stuck_channel_does_not_touch_its_neighbours(bench: Bench) -> None:
    robot = slider(kp=400.0, kd=60.0)
    robot = replace(robot, sensors=tuple(replace(s, bias=-0.0) for s in robot.sensors))
    base = bench.run(robot, steps=STEPS, command=SWING)
    log = bench.run(robot, term("sensor_stuck", "position", share=1.0), steps=STEPS, command=SWING)
    np.testing.assert_array_equal(log.channel("velocity"), base.channel("velocity"))
