"""A joint that something held at times is told, and one that sags, sticks or stands at its stop is not."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from way_samples import samples, two_joint_arm

from ee_dist.discrepancy.blocked import blocked
from ee_dist.discrepancy.measured_trial import MeasuredTrial
from ee_dist.robots.model import Robot
from ee_dist.trials.log import SensorLog
from ee_dist.trials.noise import with_noise

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


def rests(at: tuple[float, ...], size: float, noise: float = 0.0) -> np.ndarray:
    """What a joint reads that comes to rest at these places (shares of ``size``), for a second each, in 20 ms rows."""
    t = np.arange(0.0, len(at), STEP_S)
    read = np.interp(t, [x for k in range(len(at)) for x in (k, k + 0.9)], np.repeat(at, 2)) * size
    return np.asarray(read + noise * np.random.default_rng(0).standard_normal(len(t)))


SHORT = (0.5, 1.0, 0.5, 0.98, 0.5, 1.0)
"""A joint that is told 1.0 all the time comes to rest in the middle three times, and there at others."""


def test_a_joint_that_is_led_nowhere_is_held_by_nothing() -> None:
    """Friction and a soft controller leave it short of where it is told to stay."""
    read = rests(SHORT, 0.3, 3e-4)
    told = np.full(len(read), 0.3)
    assert blocked([trial("stays", told, read)], ROBOT) == []
    told[:10] = -0.1
    assert blocked([trial("led", told, read)], ROBOT), "led there from farther than it is behind"


def test_a_joint_that_only_sways_with_others_is_held_by_nothing() -> None:
    """By a step or two of its encoder, while another moves a hundred times as far."""
    robot = with_noise(two_joint_arm(), 2e-4)
    step = 2 * np.pi / 4096  # of an encoder
    sway = np.round(rests(SHORT, 4 * step) / step) * step
    told = np.full(len(sway), 4 * step)
    told[:10] = -step
    found = []
    for size in (1.0, 0.0):
        wide = size * np.interp(np.arange(len(sway)), [0, len(sway)], [-0.6, 0.6])
        read = {"shoulder": wide, "elbow": sway}
        commands = np.stack([wide, told], axis=1)
        log = SensorLog(
            times_s=STEP_S * np.arange(len(sway)),
            sensors=np.stack([read[s.target] if s.kind == "position" else 0 * sway for s in robot.sensors], axis=1),
            commands=commands,
            sensor_names=robot.sensor_names,
            sensor_units=tuple(s.unit for s in robot.sensors),
            motor_names=robot.motor_names,
        )
        found.append(blocked([MeasuredTrial("arm", log, commands_held=True)], robot))
    assert found[0] == [] and len(found[1]) == 1, "the same of a joint that does all that is done"


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
