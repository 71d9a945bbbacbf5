"""Records of one motion are no evidence for another, wherever in it they begin."""

from __future__ import annotations

import numpy as np
import pytest

from ee_dist.discrepancy.evidence.repeats import between_rows, near, near_later

T = np.arange(0, 12, 0.05)


def gait(start_s: float, pace: float = 1.0, lift: float = 1.0) -> np.ndarray:
    """A course (T, 2) of two joints."""
    t = pace * (T + start_s)
    return np.stack([0.4 * np.sin(3 * t), -1.0 + lift * 0.2 * np.sin(3 * t + 1.0)], axis=1)


@pytest.mark.parametrize("start_s", [0.0, 0.3, 0.513, 1.7])
def test_a_gait_that_begins_later_is_the_same(start_s: float) -> None:
    one, other = gait(0.0), gait(start_s)
    assert near_later(one, other, 0.15) and near_later(other, one, 0.15)
    assert near(one, other, 0.02) == (start_s == 0.0)
    assert near_later(one[:150], other, 0.15), "a shorter record of it"


@pytest.mark.parametrize(
    "other",
    [gait(0.3, pace=1.3), gait(0.3, lift=3.0), gait(0.3)[:, ::-1], -gait(0.3)],
    ids=["pace", "lift", "joints", "place"],
)
def test_another_gait_is_another(other: np.ndarray) -> None:
    assert not near_later(gait(0.0), other, 0.15)


def test_that_two_rest_alike_says_nothing() -> None:
    one, other = (np.zeros((300, 1)) for _ in range(2))
    one[220:, 0], other[220:, 0] = np.sin(T[:80]), np.sin(3 * T[:80] + 2)
    assert not near_later(one, other, 0.15)
    assert not near_later(np.zeros((300, 1)), np.zeros((300, 1)), 0.15), "nothing moves"
    assert not near_later(np.full((300, 1), np.nan), one, 0.15), "released"


def test_what_lies_between_rows_is_no_difference() -> None:
    fine, seldom = gait(0.0), gait(0.0)[::8]
    assert between_rows(fine) < 0.05 < 0.2 < between_rows(seldom) < 0.4
    held = np.repeat(gait(0.23)[::8], 8, axis=0)
    assert near_later(np.repeat(seldom, 8, axis=0), held, float(np.hypot(0.15, between_rows(seldom))))
    assert between_rows(np.ones((5, 2))) == 0.0
