"""Labels of charts, whoever draws them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from textwrap import wrap
from typing import Any

LOSS = -25.0
"""Percent to which a chart of gains goes on at the left: a candidate that fits by heart may lose any number of times as much."""

STANDOFF = 8
"""Pixels from names to their axis. Blanks behind a name are behind the last of its lines only, which then stands off farther."""


def wrapped(name: str, width: int = 30) -> str:
    """A label of an axis in lines of some characters."""
    return "<br>".join(wrap(name, width))


def cut(name: str, most: int) -> str:
    """A name of so many characters at most, its end and beginning kept: those of one kind mostly differ there."""
    half = (most - 1) // 2
    return name if len(name) <= most else f"{name[: most - 1 - half]}…{name[-half:]}"


def left_edge(intervals: Sequence[tuple[float, float]]) -> float:
    """Where a chart of gains begins (percent): it shows all losses, as far as there is room."""
    return max(min([100 * low for low, _ in intervals if math.isfinite(low)] + [0.0]) - 3, LOSS)


def cut_marks(
    names: Sequence[str], gains: Sequence[float], intervals: Sequence[tuple[float, float]]
) -> list[dict[str, Any]]:
    """Annotations of such a chart: a mark where something goes on beyond its left edge, and to what where that is a bar."""
    edge = left_edge(intervals)
    marks = []
    for name, gain, (low, high) in zip(names, gains, intervals, strict=True):
        row = {"y": wrapped(name), "showarrow": False, "xanchor": "left"}
        if edge > 100 * min(gain, low):
            marks.append({**row, "x": edge, "text": "◂"})
        if edge > 100 * gain > -math.inf:
            marks.append({**row, "x": max(100 * high, 0.0), "xshift": 8, "text": f"bar goes on to {100 * gain:.0f} %"})
    return marks
