"""What no joint does between two readings is told, and what a quick joint does is not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ee_dist.measurements.jumps import jumping, jumps
from ee_dist.robots.servo_pendulum import servo_pendulum
from ee_dist.trials.log import Array, SensorLog

ROBOT = servo_pendulum()
T = np.arange(0, 10, 0.01)


def log(position: Array, filled: Array | None = None) -> SensorLog:
    sensors = np.zeros((len(T), len(ROBOT.sensors)))
    units = tuple(s.unit for s in ROBOT.sensors)
    return SensorLog(
        T,
        sensors,
        position[:, None],
        ROBOT.sensor_names,
        units,
        ROBOT.motor_names,
        joints=position[:, None],
        filled=filled,
    )


def test_an_angle_that_wraps_is_told_also_between_rows_that_were_filled_in() -> None:
    swing = 4.0 * np.sin(1.5 * T)
    wrapped = (swing + np.pi) % (2 * np.pi) - np.pi
    (line,) = jumping(ROBOT, [("swing", log(wrapped))])
    assert "unwrap" in line and "servo during swing" in line
    rows = np.arange(len(T))
    filled = rows % 4 != 0
    (line,) = jumping(ROBOT, [("swing", log(np.interp(rows, rows[~filled], wrapped[~filled]), filled))])
    assert "unwrap" in line
    assert jumping(ROBOT, [("swing", log(swing))]) == []


def test_a_row_that_was_not_read_is_told_and_how_far_it_is_off() -> None:
    position = 0.5 * np.sin(2 * T)
    position[300:303] = -1.4
    (line,) = jumping(ROBOT, [("a", log(0.5 * np.sin(2 * T))), ("b", log(position))])
    assert "during b" in line and "unwrap" not in line
    assert (
        f"{abs(position[300] - position[299]):.3g} rad" in line
        or f"{abs(position[303] - position[302]):.3g} rad" in line
    )


@pytest.mark.parametrize("seed", range(5))
def test_quick_motion_and_steps_are_no_jumps(seed: int) -> None:
    rng = np.random.default_rng(seed)
    goal = np.repeat(rng.uniform(-1.5, 1.5, 20), 50)
    position = np.zeros(len(T))
    for k in range(1, len(T)):  # a servo that follows steps with a time constant of 30 ms
        position[k] = position[k - 1] + (goal[k] - position[k - 1]) * 0.3
    assert not any(map(len, jumps(position + 1e-3 * rng.standard_normal(len(T)))))
    assert jumping(replace(ROBOT), [("steps", log(position))]) == []
