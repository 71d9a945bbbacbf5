"""A long record as several trials: what stands apart can be held out, and what is not wanted is left out."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ee_dist.basics.quoted import quoted
from ee_dist.engines.drivers import Commands
from ee_dist.measurements.errors import MeasurementError
from ee_dist.recording.records import TrialRecord
from ee_dist.trials.log import SensorLog

KEY = "task.pieces"
EXPECTED = f"{KEY}=30 for pieces of 30 s each, or {KEY}=[[0,30],[45,60]] for seconds since the trial began"
SHORT = 0.5
"""Share of a piece below which the rest of a trial is no piece of its own, but belongs to the last."""
Span = tuple[float, float]
"""From and to, s since a trial began."""


def pieces_asked(asked: Any) -> float | tuple[Span, ...] | None:
    """The length of each piece, s, or their spans. Raises MeasurementError."""
    if asked is None:
        return None
    if _number(asked):
        if asked > 0:
            return float(asked)
    elif isinstance(asked, (list, tuple)) and asked:
        flat = all(map(_number, asked)) and len(asked) == 2
        spans = [asked] if flat else asked
        if all(isinstance(s, (list, tuple)) and len(s) == 2 and all(map(_number, s)) for s in spans):
            found = tuple((float(a), float(b)) for a, b in spans)
            wrong = [s for s in found if not 0 <= s[0] < s[1]]
            if wrong:
                raise MeasurementError(
                    f"{KEY}: from {wrong[0][0]:g} to {wrong[0][1]:g} s is no piece; expected {EXPECTED}"
                )
            # What is in two trials would be held out and fitted.
            for one, other in zip(sorted(found), sorted(found)[1:], strict=False):
                if other[0] < one[1]:
                    raise MeasurementError(
                        f"{KEY}: {one[0]:g} to {one[1]:g} s and {other[0]:g} to {other[1]:g} s overlap; every row is in one "
                        "piece at most"
                    )
            return found
    raise MeasurementError(f"{KEY}: cannot be {quoted(asked)}; expected {EXPECTED}")


def in_pieces(records: Sequence[TrialRecord], asked: float | tuple[Span, ...] | None) -> list[TrialRecord]:
    """Every trial as its pieces, each a trial that begins at 0 s, called by its seconds. Raises MeasurementError where
    a trial has no such seconds."""
    if asked is None:
        return list(records)
    found: list[TrialRecord] = []
    for record in records:
        for span in _spans(record, asked):
            found.append(_piece(record, span, len(found)))
    return found


def _spans(record: TrialRecord, asked: float | tuple[Span, ...]) -> list[Span]:
    length = _length(record.log)
    if not isinstance(asked, float):
        for first, last in asked:
            if first >= length:
                raise MeasurementError(
                    f"{KEY}: trial {record.name} has {length:.4g} s, none from {first:g} to {last:g} s; expected {EXPECTED}"
                )
        return [(a, min(b, length)) for a, b in asked]
    count = max(1, math.floor(length / asked + 1.0 - SHORT))
    return [(k * asked, (k + 1) * asked if k < count - 1 else length) for k in range(count)]


def _length(log: SensorLog) -> float:
    step = float(np.median(np.diff(log.times_s))) if len(log) > 1 else 0.0
    return float(log.times_s[-1] - log.times_s[0]) + step


def _piece(record: TrialRecord, span: Span, index: int) -> TrialRecord:
    whole = record.log
    at_s = whole.times_s - whole.times_s[0]
    # A row belongs to the piece in which it begins, whatever the last digit of its time is.
    tiny = 1e-6 * (at_s[1] if len(at_s) > 1 else 1.0)
    first, last = (int(np.searchsorted(at_s, s - tiny)) for s in span)
    log = whole.part(first, last)
    if not len(log):
        raise MeasurementError(f"{KEY}: trial {record.name} has no row from {span[0]:g} to {span[1]:g} s")
    log = replace(log, times_s=log.times_s - log.times_s[0])
    name = f"{record.name} {span[0]:.6g}-{span[1]:.6g} s"
    return replace(record, index=index, name=name, driver=Commands(log.commands.copy()), log=log)


def _number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)
