"""Searches side by side: each finds what it would find alone, and what they ask for is one call."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np
import pytest

from ee_dist.evaluation.gathered import ask, side_by_side


class Doubles:
    """Twice what it is asked."""

    def __init__(self) -> None:
        self.calls: list[list[Any]] = []

    def evaluate(self, jobs: Sequence[Any]) -> list[Any]:
        return ask(self._evaluate, jobs)

    def _evaluate(self, jobs: Sequence[Any]) -> list[Any]:
        self.calls.append(list(jobs))
        return [2 * j for j in jobs]


def climb(doubles: Doubles, value: int, times: int) -> int:
    for _ in range(times):
        (value,) = doubles.evaluate([value])
    return value


def test_what_several_ask_is_one_call_as_long_as_they_go_on() -> None:
    doubles = Doubles()
    assert side_by_side([partial(climb, doubles, v, times) for v, times in ((1, 3), (10, 1), (100, 2))]) == [8, 20, 400]
    assert doubles.calls == [[1, 10, 100], [2, 200], [4]]


def test_one_alone_and_one_that_asks_nothing() -> None:
    doubles = Doubles()
    assert side_by_side([partial(climb, doubles, 3, 2)]) == [12]
    assert side_by_side([lambda: 5, partial(climb, doubles, 1, 1)]) == [5, 2]
    assert side_by_side([]) == []
    assert climb(doubles, 1, 1) == 2, "and beside no search it is asked at once"


def test_each_evaluator_is_asked_for_its_own() -> None:
    one, other = Doubles(), Doubles()
    assert side_by_side([partial(climb, e, v, 1) for e, v in ((one, 1), (other, 2), (one, 3))]) == [2, 4, 6]
    assert (one.calls, other.calls) == ([[1, 3]], [[2]])


def test_searches_within_searches() -> None:
    doubles = Doubles()

    def both(value: int) -> int:
        return sum(side_by_side([partial(climb, doubles, value, 1), partial(climb, doubles, value + 1, 2)]))

    assert side_by_side([partial(both, 1), partial(both, 10)]) == [2 + 8, 20 + 44]
    assert doubles.calls == [[1, 2, 10, 11], [4, 22]]


@pytest.mark.parametrize("error", [ValueError("one"), KeyboardInterrupt()])
def test_what_one_of_them_raises_is_raised_and_the_others_end(error: BaseException) -> None:
    doubles, ended = Doubles(), []

    def fails() -> int:
        doubles.evaluate([1])
        raise error

    def goes_on() -> int:
        try:
            return climb(doubles, 1, 100)
        finally:
            ended.append(True)

    with pytest.raises(type(error)):
        side_by_side([goes_on, fails])
    assert ended and len(doubles.calls) < 5


def test_what_the_evaluator_raises_is_raised() -> None:
    def broken(jobs: Sequence[Any]) -> list[Any]:
        raise RuntimeError("lost")

    searches: list[Callable[[], list[Any]]] = [partial(ask, broken, [k]) for k in range(2)]
    with pytest.raises(RuntimeError, match="lost"):
        side_by_side(searches)


def test_what_numpy_was_told_about_numbers_holds_within() -> None:
    doubles = Doubles()

    def divides() -> float:
        doubles.evaluate([1])
        return float(np.float64(1.0) / np.float64(0.0))

    with np.errstate(divide="raise"), pytest.raises(FloatingPointError):
        side_by_side([divides, divides])
