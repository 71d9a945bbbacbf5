"""By how much commands lead, and with which sign, where the motion repeats itself or one joint runs the other way."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import measurement_files as samples
import numpy as np
import pytest
import small_logs as logs

from ee_dist.measurements.proposal.model import LIKELY, SURE
from ee_dist.measurements.signals import derivative, lags, lead

T = np.arange(1500) / 100


@pytest.mark.parametrize("hz", [1.2, 1.4, 2.6])
@pytest.mark.parametrize("late_s", [0.02, 0.05])
def test_one_frequency_turns_no_sign(hz: float, late_s: float) -> None:
    goal, seen = (np.sin(2 * np.pi * hz * (T - late))[:, None] for late in (0.0, late_s))
    found = lead(goal, seen, 0.01)
    assert found.lead_s == pytest.approx(late_s, abs=0.011)
    assert found.correlation > 0.99
    assert found.repeats, "half a period later the other sign fits as well"


@pytest.mark.parametrize("step_s", [0.002, 0.004, 0.02])
def test_the_rate_of_a_short_motion_is_wholly_its_change(step_s: float) -> None:
    t = np.arange(0.0, 2.0, step_s)[:, None]
    found = derivative(0.4 * np.sin(3 * t), 1.2 * np.cos(3 * t), step_s)
    assert found.correlation > 0.9999 and found.slope == pytest.approx(1, rel=1e-3)


def test_a_motion_that_does_not_repeat_itself_has_one_lead() -> None:
    wave = lambda t: (np.sin(1.7 * t) + 0.4 * np.sin(4.1 * t))[:, None]  # noqa: E731
    found = lead(-wave(T), wave(T - 0.05), 0.01)
    assert (round(found.lead_s, 2), found.correlation < -0.99, found.repeats) == (0.05, True, False)


@pytest.mark.parametrize(("late_s", "found_s"), [(0.9, 0.9), (0.3, 0.3), (-0.7, -0.7), (2.6, None)])
def test_who_is_led_over_a_network_is_a_second_late(late_s: float, found_s: float | None) -> None:
    """At the end of what is tried the best is none: farther on there may be a better one, or there is none."""
    step = 1 / 30
    t = np.arange(0.0, 30.0, step)
    rng = np.random.default_rng(0)
    knots = np.arange(-5.0, 36.0, 1.5)
    course = np.stack([np.interp(t, knots, np.cumsum(rng.standard_normal(len(knots)))) for _ in range(3)], axis=1)
    late = np.stack([np.interp(t - late_s, t, c) for c in course.T], axis=1)
    found = lead(course, late, step)
    if found_s is None:
        assert abs(found.lead_s) <= 0.5, "of a lag that is not found no farther one is made up"
        return
    assert found.lead_s == pytest.approx(found_s, abs=step)
    assert found.correlation > 0.98 and found.slope == pytest.approx(1.0, abs=0.05)


def goals_that_stay(s: np.ndarray) -> np.ndarray:
    """Two joints led from goal to goal, each of which stays for 0.6 s."""
    goals = np.cumsum(np.random.default_rng(1).standard_normal((40, 2)), axis=0)
    return goals[np.clip(np.floor(s / 0.6).astype(int) + 5, 0, 39)]


def smooth_course(s: np.ndarray) -> np.ndarray:
    return np.stack([0.5 * np.sin(1.7 * s) + 0.2 * np.sin(4.1 * s), 0.4 * np.cos(2.3 * s)], axis=1)


@pytest.mark.parametrize("course", [goals_that_stay, smooth_course])
@pytest.mark.parametrize("late_s", [0.0, 0.03, 0.16, 0.3])
def test_how_late_joints_are_is_the_same_of_goals_that_stay_as_of_a_smooth_course(
    course: Callable[[np.ndarray], np.ndarray], late_s: float
) -> None:
    seen = course(T - late_s) + np.random.default_rng(0).normal(scale=1e-3, size=(len(T), 2))
    assert [*lags(course(T), seen, 0.01).values()] == pytest.approx([late_s] * 2, abs=0.002)


def test_a_lag_of_a_smooth_course_is_told_finer_than_a_step() -> None:
    found = lags(smooth_course(T), smooth_course(T - 0.003), 0.01)
    assert [*found.values()] == pytest.approx([0.003] * 2, abs=4e-4)


def test_no_lag_is_told_where_another_fits_nearly_as_well() -> None:
    ramp = T[:, None]
    stairs = np.floor(T / 0.9)[:, None]
    assert not lags(ramp, ramp - 0.2, 0.01), "a ramp goes with itself whenever it is read"
    assert not lags(stairs, ramp / 0.9, 0.01), "of a joint that creeps along stairs nothing tells"
    assert not lags(smooth_course(T), smooth_course(T - 0.9), 0.01), "later than was tried"
    assert not lags(stairs[:3], ramp[:3], 0.01) and not lags(0 * ramp, ramp, 0.01)


def follower(asked: np.ndarray, step_s: float, slow_s: float, dead_rows: int) -> np.ndarray:
    """What a joint does that comes to what it is told (T,) with a time constant, so many rows later."""
    seen = np.zeros_like(asked)
    for i in range(1, len(asked)):
        seen[i] = seen[i - 1] + (asked[max(0, i - 1 - dead_rows)] - seen[i - 1]) * (1 - np.exp(-step_s / slow_s))
    return seen


@pytest.mark.parametrize("slow_s", [0.05, 0.1, 0.2, 0.3])
@pytest.mark.parametrize("dead_rows", [0, 2, 4])
def test_goals_that_come_evenly_go_with_a_joint_an_interval_earlier_too(slow_s: float, dead_rows: int) -> None:
    step = 0.05
    stairs = np.floor(np.arange(0, 4.5, step) / 0.5 + 1e-9) + 1
    seen = follower(stairs, step, slow_s, dead_rows)
    late = lags(stairs[:, None], seen[:, None], step)
    assert all(found > 0.03 for found in late.values())
    assert lead(stairs[:, None], seen[:, None], step, asked=True).lead_s > 0


def test_of_goals_that_come_evenly_what_is_asked_for_leads() -> None:
    t = np.arange(0, 4.5, 0.05) + 1e-9
    stairs, seen = (np.floor((t + early) / 0.5)[:, None] for early in (0.0, 0.2))
    assert lead(stairs, seen, 0.05).lead_s == pytest.approx(-0.2)
    assert lead(stairs, seen, 0.05, asked=True).lead_s == pytest.approx(0.3), (
        "0.2 s before the next is 0.3 s behind this"
    )


def test_what_is_asked_for_and_comes_late_is_not_turned_to_lead() -> None:
    asked = smooth_course(T - 0.2)
    assert lead(asked, smooth_course(T), 0.01, asked=True).lead_s == pytest.approx(-0.2, abs=0.011)


def test_commands_of_a_single_sine_are_likely_and_as_they_stand(tmp_path: Path) -> None:
    sine = lambda t: np.sin(8.8 * t)[:, None] * [0.4, 0.3]  # noqa: E731
    file = logs.written(tmp_path, logs.frame_of(T, sine(T - 0.035), sine(T)))
    _, proposal = logs.proposed(tmp_path, file)
    commands = [c for c in proposal.choices if c.group == "commands"]
    assert all(c.sure == LIKELY and "sign" not in (c.entry or {}) for c in commands)
    assert "the motion repeats itself" in commands[0].why


@pytest.mark.parametrize(("turned", "sure"), [([1, 1], SURE), ([1, -1], LIKELY)])
def test_an_encoder_mounted_the_other_way_turns_its_own_sign(tmp_path: Path, turned: list[int], sure: str) -> None:
    m = samples.motion()
    file = logs.written(tmp_path, logs.frame_of(m["t"], m["q"] * turned, m["g"]))
    _, proposal = logs.proposed(tmp_path, file)
    assert not proposal.questions
    commands = [c for c in proposal.choices if c.group == "commands"]
    assert [(c.entry or {}).get("sign", 1) for c in commands] == turned
    assert {c.sure for c in commands} == {sure}


def test_commands_that_the_motion_hardly_follows_are_not_sure(tmp_path: Path) -> None:
    m = samples.motion()
    astray = m["q"] + 0.25 * np.sin(13 * m["t"])[:, None]
    file = logs.written(tmp_path, logs.frame_of(m["t"], m["q"], astray))
    _, proposal = logs.proposed(tmp_path, file)
    assert {c.sure for c in proposal.choices if c.group == "commands"} == {LIKELY}


def test_commands_do_not_drift_against_states_whose_rate_is_a_little_off(tmp_path: Path) -> None:
    """Rows of 10.008 ms are taken as 10 ms ones: commands of another topic are still those of the same moment."""
    wave = lambda s: np.stack([0.5 * np.sin(1.7 * s), 0.4 * np.cos(2.3 * s)], axis=1)  # noqa: E731
    seen, sent = np.arange(6000) * 0.010008, np.arange(0.003, 60, 0.02)
    topics = {"/joint_states": logs.states(seen, wave(seen - 0.05)), "/joint_command": logs.states(sent, wave(sent))}
    log, report = logs.imported(tmp_path, logs.bag(tmp_path, topics))
    assert not report.resampled
    asked = wave(0.003 + seen[: len(log)])
    assert np.abs(log.commands - asked)[-500:].max() < 0.03, "held for 20 ms, and no 48 ms late"


def test_a_clock_that_loses_time_in_few_steps_is_resampled(tmp_path: Path) -> None:
    m = samples.motion()
    late = m["t"] + 0.00018 * np.cumsum(np.arange(samples.ROWS) % 3 == 1)
    _, report = logs.imported(tmp_path, logs.written(tmp_path, logs.frame_of(late, m["q"], m["g"])))
    assert report.resampled, "the median step is right, their mean is not"
