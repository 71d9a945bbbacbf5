"""How jobs are shared out among workers: all of them, each once, by measured speed."""

from __future__ import annotations

import pytest

from ee_dist.evaluation.ray_actors import WORTH_A_CALL, Shares, helping


def handed_out(total: int, shares: list[float]) -> list[int]:
    """Sizes of the calls when all workers are idle, and then again in the same order."""
    sizes, left = [], total
    while left:
        k = len(sizes) % len(shares)
        sizes.append(helping(left, total, shares[k], shares[k] / sum(shares[k:])))
        left -= sizes[-1]
    return sizes


@pytest.mark.parametrize("total", [1, 7, 50, 97, 200, 5000])
@pytest.mark.parametrize("workers", [1, 2, 3, 1000])
def test_everything_is_handed_out_in_whole_jobs(total, workers):
    sizes = handed_out(total, [1 / workers] * workers)
    assert sum(sizes) == total
    assert min(sizes) >= 1


def test_a_small_lot_is_one_call_a_worker():
    assert handed_out(50, [0.5, 0.5]) == [25, 25]
    assert handed_out(50, [0.6, 0.4]) == [30, 20]
    assert handed_out(50, [0.502, 0.498]) == [25, 25]
    assert handed_out(50, [1 / 3] * 3) == [17, 16, 17]
    assert sorted(handed_out(50, [1 / 16] * 16)) == [3] * 14 + [4] * 2


def test_a_large_lot_ends_in_small_helpings():
    sizes = handed_out(2000, [0.5, 0.5])
    assert sizes[0] == 500
    assert sizes == sorted(sizes, reverse=True)
    assert all(s >= WORTH_A_CALL for s in sizes[:-1])


def test_a_slow_worker_gets_less_and_a_new_one_an_average_share():
    shares = Shares(3)
    assert shares.now() == pytest.approx([1 / 3] * 3)
    shares.measured(0, 100, 1.0)
    shares.measured(1, 300, 1.0)
    assert shares.now() == pytest.approx([1 / 6, 3 / 6, 2 / 6])
