"""Some of the parts that a trial is cut into, where a search would take too long on all of them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TypeVar

GOLDEN = (math.sqrt(5) - 1) / 2

T = TypeVar("T")


def one_of_each(slots: Iterable[Sequence[T]], first: int = 0) -> list[T]:
    """One of each slot of neighbours, at places that no period of a motion falls together with; ``first``: how many slots, of
    other trials, went before: of one slot each they would all give what comes first."""
    return [own[int(place(k) * len(own))] for k, own in enumerate(slots, first)]


def place(number: int) -> float:
    """Where in its slot, from 0 to 1, that of this number is taken."""
    return (number * GOLDEN) % 1.0
