"""Trajectories that are sent ahead: joined by straight lines, and replaced by those that come later."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import measurement_files as samples
import numpy as np
import small_logs as logs

from ee_dist.measurements.readers.plans import carried_out

T = np.arange(1200) / 100
S = 10**9


def trajectory(start_s: float, points: list[tuple[float, Any]]) -> tuple[int, Any]:
    """(log time, message) of a trajectory without a stamp: it begins at once."""
    after = lambda s: {"sec": int(s), "nanosec": round((s - int(s)) * 1e9)}  # noqa: E731
    made = [{"positions": [float(x) for x in p], "time_from_start": after(s)} for s, p in points]
    return samples.START_NS + round(1e9 * start_s), {"joint_names": list(samples.JOINTS), "points": made}


def test_points_of_a_trajectory_are_joined_by_straight_lines(tmp_path: Path) -> None:
    wave = lambda t: np.stack([0.5 * np.sin(1.7 * t), 0.4 * np.cos(2.3 * t)], axis=1)  # noqa: E731
    at = np.arange(0, 11.9, 0.25)
    topics = {
        "/joint_states": logs.states(T, wave(T - 0.03)),
        "/arm/joint_trajectory": [trajectory(0, list(zip(at, wave(at), strict=True)))],
    }
    log, _ = logs.imported(tmp_path, logs.bag(tmp_path, topics))
    assert np.abs(log.commands - wave(log.times_s))[:1150].max() < 0.02, "held, they would be off by 0.2"


def test_a_later_trajectory_replaces_the_rest_of_the_one_before(tmp_path: Path) -> None:
    """A new goal every half second, each to be reached within one: half of every way is never gone."""
    rng, here = np.random.default_rng(1), np.zeros(2)
    sent, asked = [], np.zeros((len(T), 2))
    for k in range(23):
        start, goal = 0.5 * k + 0.013, rng.uniform(-1, 1, 2)
        sent.append(trajectory(start, [(0.1 * i, here + (goal - here) * 0.1 * i) for i in range(1, 11)]))
        later = start <= T
        asked[later] = here + (goal - here) * np.clip(T[later, None] - start, 0, 1)
        here = here + 0.5 * (goal - here)
    topics = {"/joint_states": logs.states(T + 0.02, asked), "/arm/joint_trajectory": sent}
    log, report = logs.imported(tmp_path, logs.bag(tmp_path, topics))
    # The states are the commands 20 ms later, and the log begins with a row of theirs.
    first = int(np.argmin(np.abs(asked[:, None] - log.sensors[0, :2]).sum(axis=2)[:100]))
    truth = asked[first + 2 : first + 2 + len(log)]
    assert np.abs(log.commands[: len(truth)] - truth).max() < 0.01
    assert any("points left out that a later trajectory replaced" in d for d in report.done)


def test_the_last_point_holds_until_the_next_trajectory_begins() -> None:
    start, after = np.array([0, 0, 5, 5]) * S, np.array([1, 2, 1, 2]) * S
    at, fields, replaced = carried_out(start, start + after, {"q": np.array([[1.0], [2.0], [4.0], [6.0]])})
    assert (at / S).tolist() == [1, 2, 5, 6, 7]
    assert fields["q"][:, 0].tolist() == [1, 2, 2, 4, 6]
    assert replaced == 0


def test_a_replaced_way_is_left_where_it_was() -> None:
    start, at = np.array([0, 0, 1]) * S, np.array([0, 4, 3]) * S
    times, fields, replaced = carried_out(start, at, {"q": np.array([0.0, 4.0, 9.0])})
    assert (times / S).tolist() == [0, 1, 3]
    assert fields["q"].tolist() == [0, 1, 9]
    assert replaced == 1
