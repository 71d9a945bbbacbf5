"""What no joint does between two readings is told, and what a quick joint does is not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ee_dist.measurements.jumps import jumping, jumps, losing_time
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


def of_joints(positions: Array) -> SensorLog:
    names = tuple("ab"[: positions.shape[1]])
    return SensorLog(T, positions, positions, names, ("rad",) * len(names), names, joints=positions)


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


@pytest.mark.parametrize("joints", [1, 2])
def test_rows_that_a_logger_lost_under_even_times_are_told(joints: int) -> None:
    """Of ten rows at four places one is kept, and the times count on. One joint, which hops alone, or two that hop together."""
    true_s = T + sum(0.09 * (at_s < T) for at_s in (1.0, 3.1, 5.2, 8.3))
    position = np.stack([np.sin(1.3 * true_s), np.cos(0.9 * true_s)][:joints], axis=1)
    late = of_joints(position)
    (line,) = losing_time([("swing", late)])
    assert "at 4 places, in swing at 1.0" in line
    if joints == 1:
        assert jumping(ROBOT, [("swing", log(position[:, 0]))]) == [line]


def test_one_joint_of_two_that_hops_was_hit_or_slipped() -> None:
    true_s = T + sum(0.09 * (at_s < T) for at_s in (1.0, 3.1, 5.2, 8.3))
    position = np.stack([np.sin(1.3 * true_s), np.cos(0.9 * T)], axis=1)
    assert losing_time([("swing", of_joints(position))]) == []


def test_readings_whose_own_times_say_that_they_were_late_are_not_lost() -> None:
    kept = np.ones(len(T), dtype=bool)
    for at in (100, 310, 520, 830):
        kept[at : at + 9] = False
    read = np.interp(T, T[kept], np.sin(1.3 * T[kept]))
    assert losing_time([("swing", log(read, ~kept))]) == []
    assert losing_time([("noise", log(np.random.default_rng(1).standard_normal(len(T))))]) == []
    assert losing_time([("stuck", log(np.floor(np.sin(0.3 * T) * 50) / 50))]) == []


def test_rows_that_were_stamped_late_beside_a_gap_of_the_times_are_not_lost() -> None:
    """The last reading before each gap was taken behind it: the times have the gap, one row later."""
    kept = np.ones(len(T), dtype=bool)
    for at in (100, 310, 520, 830):
        kept[at : at + 9] = False
    position = np.zeros(len(T))
    position[kept] = np.sin(1.3 * np.r_[T[kept][1:], T[-1] + 0.01])
    assert losing_time([("swing", log(position, ~kept))]) == []
    evenly = np.r_[position[kept], np.full(int((~kept).sum()), position[kept][-1])]
    (line,) = losing_time([("swing", log(evenly))])
    assert "at 4 places, in swing at 0.9" in line


def test_what_a_joint_did_while_rows_were_lost_is_no_question() -> None:
    swing, filled = 2.0 * np.sin(1.5 * T), np.zeros(len(T), dtype=bool)
    filled[300:350] = True
    bridged = np.where(filled, np.interp(T, T[~filled], swing[~filled]), swing)
    assert jumping(ROBOT, [("swing", log(bridged, filled))]) == []
    # The same jump where no row is known to be lost is one.
    assert jumping(ROBOT, [("swing", replace(log(swing), joints=np.where(T > 3.0, swing - 1.0, swing)[:, None]))])
