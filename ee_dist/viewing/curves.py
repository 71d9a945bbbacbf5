"""All curves of a report to pick from by channel and trial, thinned so that the page stays small and no peak is lost."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil

import numpy as np

from ee_dist.trials.log import Array

NUMBERS = 500_000
"""Numbers of all curves of a page together: about 4 MB as text."""
MOST, FEWEST = 1500, 60
"""Points of one curve."""
DIGITS = 5


@dataclass(frozen=True, eq=False)
class Overlay:
    """One channel of one trial: series (T,) measured and as the model says, and as the improved model does, if there is one.

    ``error``: of the channel in that trial, before; larger is shown first.
    """

    channel: str
    trial: str
    unit: str
    times_s: Array
    measured: Array
    predicted: Array
    improved: Array | None = None
    error: float = 0.0

    @property
    def title(self) -> str:
        return f"{self.channel}, {self.trial}"


@dataclass(frozen=True, eq=False)
class Browser:
    """What can be picked: ``curves`` worst first; ``names`` of the models; ``left_out``: how many had no room."""

    curves: tuple[Overlay, ...]
    names: tuple[str, ...]
    left_out: int = 0

    def to_json(self) -> str:
        """Channels and trials in their order, and for each pair that exists its curves."""
        channels, trials = _once(c.channel for c in self.curves), _once(c.trial for c in self.curves)
        cells = []
        for c in self.curves:
            series = [c.measured, c.predicted] + ([] if c.improved is None else [c.improved])
            cells.append(
                {
                    "c": channels.index(c.channel),
                    "t": trials.index(c.trial),
                    "u": c.unit,
                    "x": _short(c.times_s),
                    "y": [_short(s) for s in series],
                }
            )
        content = {"channels": channels, "trials": trials, "names": self.names, "cells": cells}
        text = json.dumps(content, separators=(",", ":"))
        return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def browser(curves: Sequence[Overlay], names: Sequence[str]) -> Browser:
    """Thinned together, so that the whole has room; the least telling are left out where even that is too much."""
    ordered = sorted(curves, key=lambda c: -c.error)
    columns = 2 + len(names)
    room = ordered[: max(1, NUMBERS // (columns * FEWEST))]
    points = int(np.clip(NUMBERS // (columns * max(len(room), 1)), FEWEST, MOST))
    return Browser(tuple(thinned(c, points) for c in room), tuple(names), len(ordered) - len(room))


def thinned(curve: Overlay, points: int) -> Overlay:
    """Of each stretch of time the rows in which a curve, or its distance from what was measured, is largest or smallest, and
    those at which it breaks off."""
    count = len(curve.times_s)
    if count <= points:
        return curve
    looked_at = [curve.measured, curve.measured - curve.predicted]
    if curve.improved is not None:
        looked_at.append(curve.measured - curve.improved)
    size = ceil(count / max(points // (2 * len(looked_at)), 1))
    starts = np.arange(0, count, size)
    padded = np.pad(np.nan_to_num(np.stack(looked_at)), ((0, 0), (0, len(starts) * size - count)), mode="edge")
    blocks = padded.reshape(len(looked_at), len(starts), size)
    kept = np.concatenate([(starts + blocks.argmax(axis=2)).ravel(), (starts + blocks.argmin(axis=2)).ravel()])
    breaks = np.flatnonzero(np.isnan(curve.measured))
    kept = np.append(kept, [0, count - 1, *(breaks if len(breaks) < points else [])])
    rows = np.unique(np.minimum(kept, count - 1))
    return rows_of(curve, rows)


def rows_of(curve: Overlay, rows: Array | slice) -> Overlay:
    """Some rows of a curve."""
    better = None if curve.improved is None else curve.improved[rows]
    return Overlay(
        curve.channel, curve.trial, curve.unit, curve.times_s[rows], curve.measured[rows], curve.predicted[rows], better,
        curve.error,
    )  # fmt: skip


def _once(names: object) -> list[str]:
    return list(dict.fromkeys(names))  # type: ignore[call-overload]


def _short(values: Array) -> list[float | None]:
    """Numbers with as many digits as can be seen; None where there is none, as JSON has no NaN."""
    return [float(f"{v:.{DIGITS}g}") if np.isfinite(v) else None for v in values]
