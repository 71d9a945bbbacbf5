"""Statistics of pairs: is one of two values of each run larger than the other, by how much, and how many runs could tell.

Wilcoxon's signed rank test, exact; effect sizes: the matched-pairs rank biserial correlation (Kerby 2014) and the median of
Walsh averages with its exact interval (Hodges and Lehmann 1963); Holm's correction for several tests.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import PermutationMethod, binomtest, rankdata, wilcoxon

SURE = 0.05
"""Of a corrected test: what counts as more than luck."""
LEVEL = 0.95
"""Of an interval, where the number of pairs allows it."""
MOST_PERMUTED = 13
"""Pairs of which all signs are gone through where values are tied; more are judged by the normal approximation."""


@dataclass(frozen=True)
class Paired:
    """What differences say. ``n`` are pairs, those that differ by nothing included; ``p`` is two-sided, of one pair it
    is none; ``least`` the smallest p
    that so many pairs can give. ``biserial`` is from -1 (every pair the one way) to 1. ``shift`` is the Hodges-Lehmann
    difference in the values' unit, ``low`` and ``high`` its interval, which covers ``level`` (with few pairs less than
    LEVEL). ``corrected`` is p for as many tests as there were."""

    n: int
    p: float
    least: float
    biserial: float
    shift: float
    low: float
    high: float
    level: float
    corrected: float = math.nan
    least_corrected: float = math.nan

    @property
    def sure(self) -> bool:
        return self.corrected < SURE

    @property
    def could_tell(self) -> bool:
        """Whether so many pairs can make p small enough at all, corrected as it is."""
        return self.least_corrected < SURE

    def as_dict(self) -> dict[str, Any]:
        return {"n": self.n, "p": self.p, "p_corrected": self.corrected, "least_p": self.least,
                "least_p_corrected": self.least_corrected, "rank_biserial": self.biserial, "shift_m": self.shift,
                "interval_m": [self.low, self.high], "level": self.level}  # fmt: skip


def paired(differences: Sequence[float]) -> Paired:
    """Of differences, one for each pair; none of them gives numbers that are none."""
    d = np.array(differences, dtype=float)
    if not len(d):
        return Paired(0, *[math.nan] * 7)
    other = d[d != 0.0]
    ranks = rankdata(np.abs(other))
    up, down = float(ranks[other > 0].sum()), float(ranks[other < 0].sum())
    low, high, level = _interval(d)
    return Paired(
        n=len(d),
        p=_p(other) if len(d) > 1 else math.nan,
        least=least_p(len(d)),
        biserial=(up - down) / (up + down) if len(other) else 0.0,
        shift=float(np.median(walsh(d))),
        low=low,
        high=high,
        level=level,
    )


def least_p(n: int) -> float:
    """The smallest two-sided p of n pairs: all differ the same way, one of 2^n equally likely ways, or the other."""
    return min(1.0, 2.0 ** (1 - n))


def _p(other: NDArray[np.float64]) -> float:
    if not len(other):
        return 1.0
    tied = len(np.unique(np.abs(other))) < len(other)
    if tied and len(other) <= MOST_PERMUTED:
        return float(wilcoxon(other, method=PermutationMethod(n_resamples=2 ** len(other))).pvalue)
    return float(wilcoxon(other, method="approx" if tied else "exact").pvalue)


def walsh(d: NDArray[np.float64]) -> NDArray[np.float64]:
    """Means of all pairs of values, each with itself too, in order."""
    first, second = np.triu_indices(len(d))
    return np.sort((d[first] + d[second]) / 2)


def _interval(d: NDArray[np.float64]) -> tuple[float, float, float]:
    """The narrowest interval between Walsh averages that covers LEVEL, or the widest there is, and what it covers."""
    averages, ways = walsh(d), _ways(len(d))
    below = np.cumsum(ways) / ways.sum()
    # Without the k smallest and largest averages the interval covers 1 - 2 P(rank sum < k + 1).
    inner = max(int(np.searchsorted(below, (1 - LEVEL) / 2, side="right")) - 1, 0)
    return float(averages[inner]), float(averages[-1 - inner]), float(max(0.0, 1 - 2 * below[inner]))


def _ways(n: int) -> NDArray[np.float64]:
    """In how many of 2^n ways the ranks 1 to n with a plus add up to 0, 1, 2, ..."""
    ways = np.ones(1)
    for rank in range(1, n + 1):
        ways = np.concatenate([ways, np.zeros(rank)]) + np.concatenate([np.zeros(rank), ways])
    return ways


def holm(values: Sequence[float]) -> list[float]:
    """Each p corrected for how many there are (Holm 1979); those that are no numbers are no tests and stay."""
    found = list(values)
    tested = sorted((k for k, p in enumerate(values) if not math.isnan(p)), key=lambda k: values[k])
    most = 0.0
    for step, k in enumerate(tested):
        most = max(most, min(1.0, (len(tested) - step) * values[k]))
        found[k] = most
    return found


def corrected(tests: Sequence[Paired]) -> list[Paired]:
    """The tests with p corrected for their number. The smallest p that they could have given is that of all of them being as
    clear as they can be."""
    least = [math.nan if math.isnan(t.p) else t.least for t in tests]
    both = zip(tests, holm([t.p for t in tests]), holm(least), strict=True)
    return [replace(t, corrected=p, least_corrected=q) for t, p, q in both]


def share_interval(count: int, of: int) -> tuple[float, float]:
    """What share of all possible runs this is, from a count of those that were made (Clopper and Pearson, 95 %)."""
    if not of:
        return 0.0, 1.0
    found = binomtest(count, of).proportion_ci(LEVEL)
    return float(found.low), float(found.high)
