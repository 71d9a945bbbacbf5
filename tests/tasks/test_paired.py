"""Statistics of pairs, against scipy directly and against examples computed by hand."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from scipy.stats import wilcoxon

from ee_dist.tasks.results.paired import corrected, holm, least_p, paired, share_interval


@pytest.mark.parametrize("n", [2, 3, 5, 6, 10, 13, 20])
def test_p_is_scipys_exact_one(n):
    d = np.random.default_rng(n).normal(0.5, 1.0, n)
    assert paired(d).p == wilcoxon(d, method="exact").pvalue


def by_all_signs(d):
    """The exact two-sided p of differences that may be tied or zero, by going through all signs."""
    from scipy.stats import rankdata

    d = np.array([x for x in d if x])
    ranks = rankdata(np.abs(d))
    middle = ranks.sum() / 2
    far = abs(ranks[d > 0].sum() - middle)
    all_signs = [abs(np.dot(s, ranks) - middle) for s in itertools.product((0, 1), repeat=len(d))]
    return float(np.mean([x >= far - 1e-9 for x in all_signs]))


@pytest.mark.parametrize("d", [[1, 1, 1, 2], [1, -1, 2, 2, 3, 3], [0, 1, 1, 0, 2], [0.5, -0.5, 0.5]], ids=str)
def test_p_is_exact_with_ties_and_zeros(d):
    assert paired(d).p == pytest.approx(by_all_signs(d))


def test_an_example_by_hand():
    """Differences 1, 2, -3, 4: ranks 1, 2, 4 gain, 3 loses; 5 of 16 ways add up to 3 or less."""
    found = paired([1.0, 2.0, -3.0, 4.0])
    assert found.p == pytest.approx(2 * 5 / 16), "none, 1, 2, 3, and 1 with 2"
    assert found.biserial == pytest.approx((7 - 3) / 10)
    # Walsh averages: -3 -1 -.5 .5 1 1.5 2 2.5 3 4
    assert found.shift == pytest.approx(1.25)
    assert (found.low, found.high) == (-3.0, 4.0)
    assert found.level == pytest.approx(1 - 2 / 16)


def test_intervals_are_those_of_the_tables():
    """Of ten pairs the 95 % interval leaves out 8 averages at either end (critical value of the signed rank test)."""
    d = np.random.default_rng(0).normal(size=10)
    averages = sorted((a + b) / 2 for a, b in itertools.combinations_with_replacement(d, 2))
    found = paired(d)
    assert (found.low, found.high) == (pytest.approx(averages[8]), pytest.approx(averages[-9]))
    assert found.level == pytest.approx(1 - 50 / 1024), "25 of 1024 ways add up to 8 or less"
    assert paired(range(1, 7)).level == pytest.approx(1 - 2 / 64), "the fewest pairs that cover 95 %"


def test_an_interval_covers_what_it_says():
    rng = np.random.default_rng(1)
    inside = [(found := paired(rng.normal(0.3, 1.0, 8))).low <= 0.3 <= found.high for _ in range(400)]
    assert np.mean(inside) == pytest.approx(found.level, abs=0.03)


def test_few_pairs_say_what_they_cannot():
    assert [least_p(n) for n in (1, 2, 5, 10)] == [1.0, 0.5, 0.0625, 2 / 1024]
    assert paired([1.0, 2.0, 3.0]).p == paired([1.0, 2.0, 3.0]).least == 0.25
    one = paired([2.0])
    assert math.isnan(one.p) and one.shift == 2.0
    none = paired([])
    assert none.n == 0 and math.isnan(none.shift)
    same = paired([0.0, 0.0, 0.0])
    assert (same.p, same.biserial, same.shift) == (1.0, 0.0, 0.0)


def test_holm_by_hand():
    assert holm([0.01, 0.04, 0.03]) == pytest.approx([0.03, 0.06, 0.06])
    assert holm([0.02, 0.02, 0.5]) == pytest.approx([0.06, 0.06, 0.5])
    assert holm([0.6, 0.9]) == [1.0, 1.0]
    with_none = holm([0.01, math.nan])
    assert with_none[0] == 0.01 and math.isnan(with_none[1])


def test_ten_seeds_are_what_thirteen_situations_take():
    nine, ten = (corrected([paired(range(1, n + 1))] * 13)[0] for n in (9, 10))
    assert not nine.could_tell and not nine.sure
    assert ten.could_tell and ten.sure and ten.corrected == pytest.approx(13 * 2 / 1024)


def test_interval_of_a_share():
    assert share_interval(3, 3) == (pytest.approx(0.025 ** (1 / 3)), 1.0), "3 of 3 may be luck of a share of 29 %"
    assert share_interval(0, 0) == (0.0, 1.0)
