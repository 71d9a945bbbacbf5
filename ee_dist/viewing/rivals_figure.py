"""Rivals side by side: how far each walked again against the hardware trials it made."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
import plotly.graph_objects as go

from ee_dist.viewing.palette import series_colour
from ee_dist.viewing.report_figures import styled

LOWEST = -0.25
"""What a run that never walked forward is drawn at, at the least."""
TICKS = (1, 2, 3, 5, 10, 26, 100, 300, 1000, 4000)
DASHES = ("solid", "dash", "dot")
"""In turn, so that lines that lie upon each other show."""


def by_trials(curves: Mapping[str, Sequence[Sequence[float]]]) -> go.Figure:
    """For each rival its runs, each the best share of the intact distance after trial 1, 2, ...: the median over runs as a
    line, from the worst to the best run as a band. A run that ended early stays where it was."""
    figure = go.Figure()
    for k, (name, runs) in enumerate(curves.items()):
        longest = max(map(len, runs))
        held = np.array([[*run, *[run[-1]] * (longest - len(run))] for run in runs], dtype=float)
        held = np.maximum(np.nan_to_num(held, nan=LOWEST, neginf=LOWEST), LOWEST)
        # Only where something changes: thousands of trials are mostly flat.
        changes = np.flatnonzero(np.any(np.diff(held, axis=1) != 0, axis=0)) + 1
        at = np.unique([0, *changes, longest - 1])
        middle, low, high = np.median(held, axis=0)[at], held.min(axis=0)[at], held.max(axis=0)[at]
        x = (at + 1).tolist()
        red, green, blue = series_colour(k)
        if len(runs) > 1:
            common = {"mode": "lines", "legendgroup": name, "showlegend": False, "hoverinfo": "skip"}
            line = {"width": 0, "shape": "hv"}
            figure.add_scatter(x=x, y=low.tolist(), line=line, **common)
            fill = f"rgba({red},{green},{blue},0.15)"
            figure.add_scatter(x=x, y=high.tolist(), line=line, fill="tonexty", fillcolor=fill, **common)
        figure.add_scatter(
            x=x,
            y=middle.tolist(),
            name=name,
            legendgroup=name,
            mode="lines+markers" if longest < 10 else "lines",
            line={"color": f"rgb({red},{green},{blue})", "width": 3, "shape": "hv", "dash": DASHES[k % 3]},
            hovertemplate=f"{name}: %{{y:.0%}} after %{{x}} trials<extra></extra>",
        )
    for share in (0.9, 1.0):
        figure.add_hline(y=share, line={"color": "#8899aa", "dash": "dot", "width": 1})
    widest = math.log10(max((len(run) for runs in curves.values() for run in runs), default=10)) + 0.05
    styled(figure, 520)
    figure.update_layout(hovermode="closest")
    figure.update_xaxes(
        type="log", title_text="hardware trials after the change", tickvals=TICKS, range=(-0.05, widest)
    )
    figure.update_yaxes(title_text="best distance walked, share of intact", tickformat=".0%")
    return figure
