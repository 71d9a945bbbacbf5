"""Pictures of a trial that was not made yet: what explanations predict of it, and what will be commanded."""

from __future__ import annotations

from collections.abc import Sequence

import plotly.graph_objects as go
from plotly.subplots import make_subplots

from ee_dist.trials.log import Array
from ee_dist.viewing.report_figures import styled

COLOURS = ("#4a90d9", "#e08a00", "#2e9e62", "#d0409a", "#a678e2", "#8a6d3b")
DASHES = ("solid", "dash", "dot", "dashdot", "longdash", "longdashdot")
"""Explanations that are alike lie on one another: between the dashes of a later one the one below is seen."""
MOST_POINTS = 1500


def parted(
    times_s: Array, curves: Array, names: Sequence[str], unit: str, around: tuple[float, float], pair: tuple[int, int]
) -> go.Figure:
    """Predictions (explanations, T), and below how far each is from the first of the two that are most similar."""
    figure = make_subplots(rows=2, cols=1, shared_xaxes=True, row_heights=[0.6, 0.4], vertical_spacing=0.06)
    for place, k in enumerate(sorted(range(len(names)), key=lambda k: k not in pair)):
        values, name = curves[k], names[k]
        line = {
            "color": COLOURS[k % len(COLOURS)],
            "width": 3 if k in pair else 1.5,
            "dash": DASHES[place % len(DASHES)],
        }
        figure.add_scatter(x=times_s, y=values, name=name, line=line, mode="lines", legendgroup=name, legendrank=k + 1,
                           row=1, col=1)  # fmt: skip
        figure.add_scatter(x=times_s, y=values - curves[pair[0]], name=name, line=line, mode="lines", legendgroup=name,
                           showlegend=False, row=2, col=1)  # fmt: skip
    figure.add_vrect(x0=around[0], x1=around[1], fillcolor="#8899aa", opacity=0.14, line_width=0, layer="below")
    styled(figure, 420)
    figure.update_yaxes(title_text=unit, row=1, col=1)
    figure.update_yaxes(title_text=f"difference, {unit}" if unit else "difference", row=2, col=1)
    figure.update_xaxes(title_text="s", row=2, col=1)
    return figure


def commanded(times_s: Array, commands: Array, names: Sequence[str], unit: str) -> go.Figure:
    """Commands (T, M) over the whole trial."""
    thin = slice(None, None, max(1, len(times_s) // MOST_POINTS))
    figure = go.Figure()
    for k, name in enumerate(names):
        line = {"color": COLOURS[k % len(COLOURS)], "width": 1.5}
        figure.add_scatter(x=times_s[thin], y=commands[thin, k], name=name, line=line, mode="lines")
    styled(figure, 280)
    figure.update_yaxes(title_text=unit)
    figure.update_xaxes(title_text="s")
    return figure
