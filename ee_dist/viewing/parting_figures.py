"""Where logs of damaged robots part, as the paper's Fig. 5: one sensor under two nearly equal damages and a different one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import plotly.graph_objects as go

from ee_dist.trials.log import Array
from ee_dist.viewing.report_figures import styled

NEARLY = 0.05
"""Of a sensor's full range: logs are apart once one sensor differs by more."""
COLOURS = ("#3b7dd8", "#7fb0ee", "#e08a1e")
HEIGHT = 340


@dataclass(frozen=True, eq=False)
class Parting:
    """Logs of one controller. ``names``: a damage, one nearly equal to it, and a different one; ``curves`` (3, T): what the
    sensor ``sensor`` said, in shares of its scale; ``near`` and ``far``: after how many steps the log of the first and those of
    the others are apart by any of the angle sensors."""

    names: tuple[str, str, str]
    sensor: str
    curves: Array
    near: int
    far: int


def apart_after(one: Array, other: Array, limits: Array) -> int:
    """Steps until two courses (T, S) differ at any sensor by more than ``limits`` (S,); T where they never do."""
    beyond = (np.abs(one - other) > limits).any(axis=1)
    return int(np.argmax(beyond)) if beyond.any() else len(one)


def partings(shown: Parting) -> go.Figure:
    """The three courses over the steps, and where the first leaves the others."""
    figure = go.Figure()
    seen = min(len(shown.curves[0]), max(3 * max(shown.near, shown.far), 150))
    for name, curve, colour in zip(shown.names, shown.curves, COLOURS, strict=True):
        dash = "dot" if name == shown.names[1] else None
        figure.add_scatter(x=list(range(seen)), y=[float(f"{v:.4g}") for v in curve[:seen]], name=name, mode="lines",
                           line={"color": colour, "width": 2, "dash": dash})  # fmt: skip
    low, high = float(shown.curves[:, :seen].min()), float(shown.curves[:, :seen].max())
    room = 0.12 * ((high - low) or 1.0)
    marks = [(shown.far, COLOURS[2], "different", low - room), (shown.near, COLOURS[0], "nearly equal", high + room)]
    for steps, colour, what, y in marks:
        if steps < seen:
            figure.add_vline(x=steps, line={"color": colour, "width": 1, "dash": "dash"})
            figure.add_annotation(x=steps, y=y, text=f"{what}: apart after {steps}", showarrow=False, xanchor="left",
                                  font={"color": colour})  # fmt: skip
    styled(figure, HEIGHT)
    figure.update_xaxes(title_text="step (10 ms)", rangemode="tozero", range=[0, seen])
    figure.update_yaxes(title_text=shown.sensor.replace("_", " "), range=[low - 1.6 * room, high + 1.6 * room])
    return figure


def summed(found: Sequence[Parting]) -> list[list[str]]:
    """A row for each controller: which, and after how many steps."""
    return [[str(k + 1), str(p.near), str(p.far)] for k, p in enumerate(found)]
