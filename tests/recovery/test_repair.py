"""The first population of a repair pass: relatives of the controllers in the database."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ee_dist.evolution.ga import SCALE
from ee_dist.recovery.loop import Plan
from ee_dist.recovery.repair import relatives


def database(n: int, length: int = 68) -> np.ndarray:
    return np.random.default_rng(n).integers(-SCALE, SCALE, size=(n, length), endpoint=True).astype(np.int16)


@settings(deadline=None, max_examples=40)
@given(n=st.integers(1, 6), count=st.integers(6, 250), seed=st.integers(0, 5))
def test_every_controller_of_the_database_is_there_unchanged_and_all_others_descend_from_it(n, count, seed):
    known = database(n)
    found = relatives(known, count, np.random.default_rng(seed))
    assert found.shape == (count, 68)
    assert np.abs(found).max() <= SCALE
    assert {g.tobytes() for g in known} <= {g.tobytes() for g in found}
    nearest = (found[:, None] == known[None]).mean(axis=2).max(axis=1)
    assert nearest.min() > 0.4, "each shares most of its values with one of the database"
    assert np.array_equal(found, relatives(known, count, np.random.default_rng(seed)))


def test_relatives_are_ever_more_distant():
    known = database(1)
    found = relatives(known, 200, np.random.default_rng(0))
    changed = (found != known).sum(axis=1)
    near, far = changed[1:50].mean(), changed[150:].mean()
    assert 0.3 < near < 1.5
    assert 10 < far < 20


def test_without_a_database_there_are_none():
    assert len(relatives(database(1)[:0], 200, np.random.default_rng(0))) == 0


@pytest.mark.parametrize("share", [-0.1, 1.1])
def test_an_impossible_share_is_refused(share):
    with pytest.raises(ValueError, match="related must be from 0 to 1"):
        Plan(related=share)


def test_less_than_no_restart_is_a_mistake():
    with pytest.raises(ValueError, match="restarts must be 0 or more"):
        Plan(restarts=-1)
