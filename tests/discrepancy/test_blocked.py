"""A joint that something held at times is told, and one that sags, sticks or stands at its stop is not."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from way_samples import samples

from ee_dist.discrepancy.blocked import blocked
from ee_dist.discrepancy.measured_trial import MeasuredTrial
from ee_dist.robots.model import Robot
from ee_dist.trials.log import SensorLog

STEP_S = 0.02
ROBOT: Robot = samples()["pendulum"].robot


def trial(name: str, told: np.ndarray, read: np.ndarray) -> MeasuredTrial:
    """A trial of the servo pendulum that reads its position alone as it is given."""
    robot = ROBOT
    sensors = np.zeros((len(told), len(robot.sensors)))
    (own,) = (k for k, s in enumerate(robot.sensors) if s.kind == "position")
    sensors[:, own] = read
    log = SensorLog(
        times_s=STEP_S * np.arange(len(told)),
        sensors=sensors,
        commands=told[:, None].copy(),
        sensor_names=robot.sensor_names,
        sensor_units=tuple(s.unit for s in robot.sensors),
        motor_names=robot.motor_names,
    )
    return MeasuredTrial(name, log, commands_held=True)


def grips(floor: float, ends_s: float = 3.0, sag: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """What a gripper is told in 6 s, opening and closing twice, and what it reads where something holds it above ``floor``
    until ``ends_s``."""
    t = np.arange(0.0, 6.0, STEP_S)
    told = np.interp(t, [0, 0.5, 1, 2.5, 3, 3.5, 4, 5.5, 6], [0.4, 0.4, -0.15, -0.15, 0.4, 0.4, -0.15, -0.15, 0.4])
    free = np.interp(t - 0.1, t, told) - sag
    return told, np.where(t < ends_s, np.maximum(free, floor), free)


def logs(floors: list[float], ends_s: float = 3.0, sag: float = 0.0) -> list[MeasuredTrial]:
    rng = np.random.default_rng(0)
    made = [grips(floor, ends_s, sag) for floor in floors]
    return [trial(f"pick {k}", c, q + rng.normal(scale=5e-4, size=len(q))) for k, (c, q) in enumerate(made)]


def test_what_grips_a_thing_is_told_with_its_place_and_how_often() -> None:
    (line,) = blocked(logs([0.026, 0.030, 0.024]), ROBOT)
    assert re.match(
        r"servo stood at 0\.026\d? rad 3 times \(pick 0, pick 1, pick 2\) while it was asked to go 0\.18 rad further",
        line,
    )
    assert "was something in its way?" in line and "\n" not in line


@pytest.mark.parametrize(
    ("floors", "more"),
    [
        ([-1.0, -1.0, -1.0], {}),  # nothing there
        ([0.026, 0.026], {"ends_s": 9.0}),  # always there: a stop, which is an effect
        ([0.026, -0.05, 0.1], {}),  # at another place each time: friction
        ([0.026], {}),  # once
        ([-1.0, -1.0], {"sag": 0.09}),  # it hangs back everywhere
    ],
)
def test_what_an_effect_may_say_is_not_told(floors: list[float], more: dict[str, float]) -> None:
    assert blocked(logs(floors, **more), ROBOT) == []


def test_a_joint_that_never_stood_beyond_where_it_comes_to_rest_is_not_told() -> None:
    t = np.arange(0.0, 8.0, STEP_S)
    told = np.interp(t, [0, 1, 2, 4, 5, 6, 7, 8], [0.4, 0.4, -0.15, -0.15, 0.4, -0.5, 0.4, 0.4])
    read = np.interp(t, [0, 1.2, 2.2, 4.2, 5.2, 6.2, 7.2, 8], [0.4, 0.4, 0.02, 0.02, 0.4, -0.45, 0.4, 0.4])
    assert blocked([trial(f"again {k}", told, read) for k in range(2)], ROBOT) == []


def test_where_a_slow_joint_turns_back_nothing_held_it() -> None:
    t = np.arange(0.0, 12.0, STEP_S)
    wide = np.where(t < 6.0, 0.5, 1.0)
    told, read = (wide * np.sin(1.6 * (t - late)) * size for late, size in ((0.0, 1.0), (0.2, 0.7)))
    slow = replace(ROBOT, joints=tuple(replace(j, lag_s=0.2) for j in ROBOT.joints))
    assert blocked([trial(f"sine {k}", told, read) for k in range(2)], slow) == []


def test_nothing_is_told_of_what_is_simulated_here_or_led_otherwise_or_not_recorded() -> None:
    found = logs([0.026, 0.026])
    assert blocked(found, ROBOT)
    assert not blocked([replace(t, commands_held=False) for t in found], ROBOT)
    led = ROBOT.map_drive(ROBOT.drives[0].joint, lambda d: replace(d, command="torque"))
    assert not blocked(found, led)
    assert not blocked([replace(t, not_recorded=frozenset(s.name for s in ROBOT.sensors)) for t in found], ROBOT)


@given(st.floats(-3.0, 3.0), st.sampled_from([-1.0, 1.0]), st.floats(0.5, 3.0))
def test_where_zero_is_which_way_and_how_large_change_nothing_but_the_numbers(
    shift: float, side: float, size: float
) -> None:
    found = []
    for k in range(2):
        told, read = grips(0.026)
        found.append(trial(f"pick {k}", side * size * told + shift, side * size * read + shift))
    (line,) = blocked(found, ROBOT)
    assert f"2 times (pick 0, pick 1) while it was asked to go {size * 0.176:.2g} rad further" in line
