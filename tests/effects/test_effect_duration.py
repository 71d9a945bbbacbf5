"""A drive that takes a set time to each new goal moves there evenly, and begins anew whenever the goal changes."""

from __future__ import annotations

import numpy as np
import pytest
from effect_robots import Bench, slider

from ee_dist.effects import CATALOGUE, apply, term
from ee_dist.effects.catalogue import Term
from ee_dist.engines.drive import DrivePath
from ee_dist.engines.one_joint import OneJointEngine
from ee_dist.export.plan import parameters
from ee_dist.export.shim import Shim
from ee_dist.robots.model import Robot
from ee_dist.robots.quadruped import quadruped
from ee_dist.trials.log import Array

SERVO = {"kp": 400.0, "kd": 60.0}
DT = 0.001


def taking(duration_s: float) -> Term:
    return term("command_duration", "joint", duration_s=duration_s)


def evenly(to: float, seconds: float, steps: int, begin: float = 0.0) -> Array:
    """(steps,) goals that move from one to the other in a time, and stay."""
    return begin + (to - begin) * np.minimum(DT * np.arange(1, steps + 1) / seconds, 1.0)


@pytest.mark.parametrize("far", [0.4, -0.05])
def test_command_duration_makes_a_ramp_of_a_step_that_lasts_as_long_however_large_it_is(
    bench: Bench, far: float
) -> None:
    timed = bench.run(slider(**SERVO), taking(0.6), steps=1500, command=far)
    ramp = bench.run(slider(**SERVO), steps=1500, command=evenly(far, 0.6, 1500))
    np.testing.assert_allclose(timed.channel("position"), ramp.channel("position"), atol=1e-9)


def test_the_engine_of_one_joint_knows_it() -> None:
    bench = Bench(OneJointEngine(16))
    timed = bench.run(slider(**SERVO), taking(0.6), steps=1000, command=0.4)
    ramp = bench.run(slider(**SERVO), steps=1000, command=evenly(0.4, 0.6, 1000))
    np.testing.assert_allclose(timed.channel("position"), ramp.channel("position"), atol=1e-9)


def test_a_goal_that_changes_on_the_way_begins_anew_from_where_it_was_led(bench: Bench) -> None:
    command = np.where(np.arange(1500) < 300, 0.4, -0.2)
    goals = evenly(0.4, 0.6, 1500)
    goals[300:] = evenly(-0.2, 0.6, 1200, begin=goals[299])
    timed = bench.run(slider(**SERVO), taking(0.6), steps=1500, command=command)
    led = bench.run(slider(**SERVO), steps=1500, command=goals)
    np.testing.assert_allclose(timed.channel("position"), led.channel("position"), atol=1e-9)


def goals_of(robot: Robot, commands: Array, enabled: Array | None = None, at: float = 0.0) -> Array:
    """(T,) where a drive leads a joint that stays ``at`` a place."""
    path = DrivePath([robot], robot.time_step_s)
    found = []
    for t, told in enumerate(commands):
        on = None if enabled is None else np.full((1, 1), enabled[t])
        found.append(float(path.goals(np.full((1, 1), told), np.full((1, 1), at), on)[0, 0]))
    return np.array(found)


def test_commands_that_change_at_every_step_are_followed_as_by_a_lag() -> None:
    steps, lag = 4000, 0.2
    ramp = 0.5 * DT * np.arange(1, steps + 1)
    found = goals_of(apply(slider(**SERVO), [taking(lag)]), ramp)
    filtered, here = [], 0.0
    for told in ramp:
        here += (told - here) * DT / lag
        filtered.append(here)
    np.testing.assert_allclose(found, filtered, atol=1e-12)
    assert ramp[-1] - found[-1] == pytest.approx(0.5 * lag, rel=0.01)
    # In rows that are slower than steps, and quicker than the time, it is as late.
    rows = np.repeat(ramp[::20], 20)
    slower = goals_of(apply(slider(**SERVO), [taking(lag)]), rows)
    assert ramp[-1] - slower[-1] == pytest.approx(0.5 * lag, rel=0.01)


@pytest.mark.parametrize("duration_s", [0.0, 1e-4, DT])
def test_a_time_within_a_step_changes_nothing(bench: Bench, duration_s: float) -> None:
    command = 0.1 * np.sign(np.sin(0.01 * np.arange(400)))
    timed = bench.run(slider(**SERVO), taking(duration_s), steps=400, command=command)
    free = bench.run(slider(**SERVO), steps=400, command=command)
    np.testing.assert_array_equal(timed.channel("position"), free.channel("position"))


def test_a_limit_of_speed_holds_on_the_way() -> None:
    """Ten times as far as can be gone in the time: the limit leads, and the goal arrives when it can."""
    limit = term("command_speed", "joint", slowness_s_rad=2.0)
    found = goals_of(apply(slider(**SERVO), [limit, taking(0.2)]), np.full(3000, 1.0))
    np.testing.assert_allclose(found, np.minimum(0.5 * DT * np.arange(1, 3001), 1.0), atol=1e-9)
    near = goals_of(apply(slider(**SERVO), [limit, taking(0.2)]), np.full(300, 0.05))
    np.testing.assert_allclose(near, evenly(0.05, 0.2, 300), atol=1e-9)


def test_a_released_drive_begins_anew_from_its_joint() -> None:
    enabled = np.where(np.arange(900) < 500, 0.0, 1.0)
    found = goals_of(apply(slider(**SERVO), [taking(0.3)]), np.full(900, 0.4), enabled, at=0.1)
    np.testing.assert_allclose(found[499:], evenly(0.4, 0.3, 401, begin=0.1), atol=1e-9)


def test_the_shim_takes_as_long() -> None:
    model = apply(slider(**SERVO), [taking(0.05)])
    path, shim = DrivePath([model], model.time_step_s), Shim(parameters(model))
    at = np.zeros((1, 1))
    for t, told in enumerate(np.repeat([0.3, -0.1, 0.2, 0.2], 30)):
        on, asked = 0.0 if 70 <= t < 75 else 1.0, np.full((1, 1), told)
        wanted = path.step(DT * t, asked, at, at, enabled=np.full((1, 1), on))[0]
        assert shim.torque(DT * t, asked[0], at[0], at[0], enabled=on) == pytest.approx(wanted, abs=1e-9), t


def test_it_adds_to_what_is_described_and_takes_off_no_more() -> None:
    robot = slider(**SERVO, command_duration=0.5)
    assert apply(robot, [taking(0.25)]).drives[0].command_duration == pytest.approx(0.75)
    assert apply(robot, [taking(-0.7)]).drives[0].command_duration == 0.0
    assert apply(robot, [taking(0.0)]) == robot


def test_it_is_of_controllers_of_positions_and_behind_what_was_there_before() -> None:
    entry = CATALOGUE["command_duration"]
    assert list(CATALOGUE)[-2:] == [entry.name, "torque_reading_delay"], "what came later goes behind"
    assert entry.targets(slider(command="torque")) == () == entry.targets(slider(command="speed", kp=1.0))
    assert entry.proposed(quadruped()) == (), "of a robot whose controllers are known nobody set them otherwise"
