"""The choice of trials from a map, on functions whose best is known; and what is said where ribs is absent."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from ee_dist.rivals.gait_map import needed
from ee_dist.rivals.setting import RivalError
from ee_dist.rivals.trial_and_error import NOISE, RHO, Expectation, matern

LINE = np.linspace(0.0, 1.0, 21)[:, None]


def test_the_kernel_is_one_at_home_and_falls_with_distance():
    k = matern(LINE, LINE)
    assert np.allclose(np.diag(k), 1.0)
    assert (np.diff(k[0]) < 0).all()
    s = np.sqrt(5.0)
    assert matern(np.zeros((1, 1)), np.full((1, 1), RHO))[0, 0] == pytest.approx((1 + s + 5 / 3) * np.exp(-s))


def test_what_a_trial_says_is_believed_near_it_and_the_map_elsewhere():
    expectation = Expectation(LINE, np.ones(21))
    expectation.measured(LINE[0], 1.0, 0.2)
    mean, deviation = expectation.read()
    assert mean[0] == pytest.approx(0.2, abs=2 * NOISE)
    assert (np.diff(mean) > 0).all()
    assert mean[-1] > 0.85
    assert deviation[0] < 0.05 < 0.9 < deviation[-1]


def test_it_leaves_what_failed_and_goes_to_the_other_end():
    """The map promises most at one end; on the body that end is lost, and the best is at the other."""
    promised = 1.0 - 0.3 * LINE[:, 0]
    real = np.where(LINE[:, 0] < 0.5, 0.0, promised)
    expectation, tried, went = Expectation(LINE, promised), set(), []
    for _ in range(4):
        chosen = expectation.choice(tried)
        assert chosen is not None and chosen not in tried
        tried.add(chosen)
        went.append(real[chosen])
        expectation.measured(LINE[chosen], promised[chosen], real[chosen])
    assert went[0] == 0.0
    assert went[1] > 0.8 * real.max(), "one failure is enough to leave that end"
    assert went[3] > went[2], "and then it goes where most is left"


def test_no_place_is_tried_twice_and_the_map_may_come_to_its_end():
    expectation, tried = Expectation(LINE[:3], np.zeros(3)), set()
    for _ in range(3):
        tried.add(expectation.choice(tried))
    assert tried == {0, 1, 2}
    assert expectation.choice(tried) is None


def test_an_absent_package_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "ribs.archives", None)
    with pytest.raises(RivalError, match=r"needs the package ribs: pip install 'ee_dist\[rivals\]'"):
        needed("ribs.archives")
