"""The course of the search: best fitness and best error of each generation, pass after pass.

Bars and not lines, because a rerun plot of lines follows the timeline that is being played; bars have an axis of their
own and so stay in sight while the robot walks.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import rerun as rr

from ee_dist.recording.records import GenerationRecord
from ee_dist.viewing.palette import series_colour

BETWEEN_PASSES = 4
"""Empty places between the bars of two passes."""


def send_curve(stream: rr.RecordingStream, path: str, records: Sequence[GenerationRecord], what: str) -> None:
    """Bars at ``<path>/<what>_<pass>``: best of each generation; the axis counts generations over all passes."""
    begin = 0
    for pass_index in sorted({r.pass_index for r in records}):
        own = sorted((r for r in records if r.pass_index == pass_index), key=lambda r: r.generation)
        place = f"{path}/{what}_{pass_index + 1}"
        stream.log(
            place,
            rr.BarChart(
                np.array([r.best for r in own]),
                color=series_colour(pass_index),
                abscissa=np.array([begin + r.generation for r in own], dtype=float),
            ),
            static=True,
        )
        begin += own[-1].generation + 1 + BETWEEN_PASSES
