"""The course of the search: best fitness and best error of each generation, pass after pass.

Bars and not lines, because a rerun plot of lines follows the timeline that is being played; bars have an axis of their
own and so stay in sight while the robot walks.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
import rerun as rr

from ee_dist.recording.records import GenerationRecord, HypothesisRecord
from ee_dist.viewing.palette import HINDSIGHT, ZERO_LINE, pass_colour
from ee_dist.viewing.story import below_zero

BETWEEN_PASSES = 4
"""Empty places between the bars of two passes."""
BELIEVED, NOUGHT = "believed", "zero"
LINE = 0.015
"""Height of the line at zero, as a share of all that the bars span: a bar of no height is not drawn."""


def anything(records: Sequence[GenerationRecord]) -> bool:
    """Whether any bar would be seen: bars of nothing but zeros are an empty panel."""
    return any(r.best for r in records)


def send_curve(
    stream: rr.RecordingStream,
    path: str,
    records: Sequence[GenerationRecord],
    what: str,
    believed: Mapping[int, HypothesisRecord] | None = None,
) -> None:
    """Bars at ``<path>/<what>_<pass>``: best of each generation; the axis counts generations over all passes.

    Where any stands below zero, a line at ``<path>/zero`` tells which do: that of the viewer is hardly seen. ``believed``: what
    each diagnosis came to after polish and prune, one more bar behind those of its pass.
    """
    begin = 0
    ends: list[tuple[float, float]] = []
    for pass_index in sorted({r.pass_index for r in records}):
        own = sorted((r for r in records if r.pass_index == pass_index), key=lambda r: r.generation)
        place = f"{path}/{what}_{pass_index + 1}"
        stream.log(
            place,
            rr.BarChart(
                np.array([r.best for r in own]),
                color=pass_colour(pass_index),
                abscissa=np.array([begin + r.generation for r in own], dtype=float),
            ),
            static=True,
        )
        begin += own[-1].generation + 1
        if believed and pass_index in believed:
            ends.append((begin + 0.5, believed[pass_index].error))
            begin += 2
        begin += BETWEEN_PASSES
    if below_zero(records):
        best = [r.best for r in records if math.isfinite(r.best)]
        height = LINE * (max(0.0, *best) - min(best))
        across = [float(begin - BETWEEN_PASSES)]
        line = rr.BarChart(np.array([height]), color=ZERO_LINE, abscissa=np.array([0.0]), widths=across)
        stream.log(f"{path}/{NOUGHT}", line, static=True)
    if ends:
        at, errors = np.array(ends).T
        chart = rr.BarChart(errors, color=HINDSIGHT, abscissa=at, widths=[2.0] * len(ends))
        stream.log(f"{path}/{BELIEVED}", chart, static=True)
