"""Stretches of True, whatever an array of yes and no begins and ends with."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from ee_dist.basics.runs import runs


def test_stretches_reach_to_both_ends() -> None:
    assert runs(np.array([True, True, False, True, False, False, True])) == [(0, 2), (3, 4), (6, 7)]
    assert runs(np.zeros(3, dtype=bool)) == runs(np.zeros(0, dtype=bool)) == []
    assert runs(np.ones(4, dtype=bool)) == [(0, 4)]


@given(st.lists(st.booleans(), max_size=40))
def test_they_are_all_of_it_and_apart(told: list[bool]) -> None:
    found = runs(np.array(told, dtype=bool))
    again = np.zeros(len(told), dtype=bool)
    for first, last in found:
        assert first < last
        again[first:last] = True
    assert again.tolist() == told
    assert all(a[1] < b[0] for a, b in pairwise(found))
