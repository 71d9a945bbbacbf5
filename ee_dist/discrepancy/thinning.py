"""Some of the parts that a trial is cut into, where a search would take too long on all of them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TypeVar

GOLDEN = (math.sqrt(5) - 1) / 2

T = TypeVar("T")


def one_of_each(slots: Iterable[Sequence[T]]) -> list[T]:
    """One of each slot of neighbours, at places that no period of a motion falls together with."""
    return [own[int((k * GOLDEN) % 1.0 * len(own))] for k, own in enumerate(slots)]
