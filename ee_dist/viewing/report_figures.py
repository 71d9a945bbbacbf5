"""The plots of the reports: the proof, the map of where it fails, ranked effects, the ladder, bars, clouds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from ee_dist.trials.log import Array
from ee_dist.viewing.curves import Overlay
from ee_dist.viewing.labels import STANDOFF, cut_marks, left_edge, wrapped

MEASURED, PREDICTED, IMPROVED = "#4a90d9", "#e08a00", "#2e9e62"
"""What was measured, what the model says, and the improved one: the same in every figure."""
FLOOR, MARK = "#a678e2", "#d0409a"
DOTS = 700
"""Points of a cloud that are drawn; its mean is of all."""
BAR_ROOM = 56
"""Pixels above a map for the bar of its colours."""
LOW = 0.15
"""Share of an axis below which there is no room for words."""
NAME, SHORT, LETTERS = 18, 10, 150
"""Letters of a line at a step of the ladder, at the most and at the least, and of all steps side by side: names that have no room
are turned, and lie over each other."""
FEWEST = 5
"""Points that a mean is drawn of."""
_FONT = {"family": "Inter, Segoe UI, Helvetica Neue, Arial, sans-serif", "size": 12, "color": "#1d2733"}


@dataclass(frozen=True, eq=False)
class Cloud:
    """Residuals (n,) over something (n,), of the model and perhaps of the improved one."""

    label: str
    x: Array
    before: Array
    after: Array | None = None


RANKS = {"best": "#1769aa", "tied": "#67a9d8", "earned": "#8fa3b5", "not": "rgba(136,153,170,0.12)"}
"""Colours of candidates, by what became of them."""


def styled(figure: go.Figure, height: int) -> go.Figure:
    """On the colour of the page, which draws texts and lines in what suits it."""
    figure.update_layout(
        template="none",
        font=_FONT,
        height=height,
        paper_bgcolor="rgba(0,0,0,0)",
        plot_bgcolor="rgba(0,0,0,0)",
        margin={"l": 60, "r": 16, "t": 34, "b": 45},
        legend={"orientation": "h", "y": 1.0, "yanchor": "bottom", "x": 0},
        modebar={"bgcolor": "rgba(0,0,0,0)", "color": "#8899aa", "activecolor": "#3f7fbf"},
        hovermode="x unified",
    )
    figure.update_annotations(font_size=12)
    figure.update_xaxes(zeroline=False)
    return figure


def proof(curve: Overlay, names: Sequence[str], around: tuple[float, float]) -> go.Figure:
    """Measured and predicted at the stretch of time where it matters most (shaded), and the residuals below."""
    figure = make_subplots(rows=2, cols=1, shared_xaxes=True, row_heights=[0.68, 0.32], vertical_spacing=0.06)
    series = [("measured", curve.measured, MEASURED, 4.0), (names[0], curve.predicted, PREDICTED, 2.0)]
    if curve.improved is not None:
        series.append((names[1], curve.improved, IMPROVED, 2.0))
    for name, values, colour, width in series:
        line = {"color": colour, "width": width}
        figure.add_scatter(x=curve.times_s, y=values, name=name, line=line, opacity=0.7 if name == "measured" else 1.0,
                           legendgroup=name, mode="lines", row=1, col=1)  # fmt: skip
        if name != "measured":
            figure.add_scatter(x=curve.times_s, y=curve.measured - values, line={"color": colour, "width": 1.5}, row=2,
                               col=1, mode="lines", name=f"measured - {name}", legendgroup=name, showlegend=False)  # fmt: skip
    figure.add_vrect(x0=around[0], x1=around[1], fillcolor="#8899aa", opacity=0.14, line_width=0, layer="below")
    figure.add_hline(y=0, line={"color": "#8899aa", "width": 1}, row=2, col=1)
    styled(figure, 400)
    figure.update_yaxes(title_text="" if curve.unit == "1" else curve.unit, row=1, col=1)
    figure.update_yaxes(title_text="residual" if curve.unit == "1" else f"residual, {curve.unit}", row=2, col=1)
    figure.update_xaxes(title_text="s", row=2, col=1)
    return figure


def heat_map(
    tables: Sequence[Array],
    segments: Sequence[str],
    channels: Sequence[str],
    floor: float = 1.0,
    titles: Sequence[str] = ("model", "improved model"),
    label: str = "error (standard deviations)",
) -> go.Figure:
    """(segments, channels) errors, one table or two below each other; what ``floor`` noise leaves is near the background, and NaN
    has no colour."""
    every = range(tables[0].shape[1])
    # Without noise a right model may leave nothing at all: then all rows are shown, and none stands out.
    shown = [k for k in every if any(np.nan_to_num(t[:, k]).any() for t in tables)] or [*every]
    top = max(4.0 * floor, float(np.nanquantile(tables[0][:, shown], 0.98)))
    named = list(titles) if len(tables) > 1 else None
    # Room for a title between two tables, however few rows they have.
    tall = 17 * max(len(shown), 3)
    gap = 30 / (30 + 2 * tall) if len(tables) > 1 else 0.0
    figure = make_subplots(rows=len(tables), cols=1, shared_xaxes=True, subplot_titles=named, vertical_spacing=gap)
    for row, table in enumerate(tables, start=1):
        figure.add_trace(
            go.Heatmap(
                z=table[:, shown].T,
                x=list(segments),
                y=[channels[k].replace("_", " ") for k in shown],
                coloraxis="coloraxis",
                hoverongaps=False,
                hovertemplate="%{y}<br>%{x}<br>%{z:.3g}<extra></extra>",
            ),
            row=row,
            col=1,
        )
    styled(figure, 100 + BAR_ROOM + (30 + tall) * len(tables))
    pale = min(1.3 * floor / top, 0.9)
    light = [[0, "#f7fbff"], [pale, "#e6eef7"], [0.95, "#b5261e"], [1, "#7a0f0a"]]
    dark = [[0, "#1d252e"], [pale, "#2a3542"], [0.95, "#e0564c"], [1, "#ff8a7a"]]
    # At the top of the figure, not of the plot: there it would be given room twice over.
    bar = {"thickness": 10, "orientation": "h", "yref": "container", "y": 1.0, "yanchor": "top", "ypad": 4, "len": 0.45,
           "x": 1.0, "xanchor": "right"}  # fmt: skip
    figure.update_layout(
        coloraxis={"cmin": 0.0, "cmax": top, "colorscale": light, "colorbar": bar},
        hovermode="closest",
        margin={"l": 20, "r": 16, "t": BAR_ROOM, "b": 30},
        meta={
            "light": {"coloraxis.colorscale": light},
            "dark": {"coloraxis.colorscale": dark},
            "narrow": {**_axes("tickfont.size", 8, len(tables)), **_axes("nticks", 9, len(tables), "x")},
            "wide": {**_axes("tickfont.size", 10, len(tables)), **_axes("nticks", 32, len(tables), "x")},
        },
    )
    figure.update_annotations(x=0.0, xanchor="left")
    figure.add_annotation(text=label, showarrow=False, xref="paper", x=0.54, xanchor="right", yref="paper", y=1.0,
                          yanchor="top", yshift=BAR_ROOM, font_size=12)  # fmt: skip
    figure.update_yaxes(autorange="reversed", automargin=True, showgrid=False, dtick=1)
    figure.update_xaxes(tickangle=-60, showgrid=False, automargin=True)
    return figure


def _axes(setting: str, value: object, count: int, which: str = "xy") -> dict[str, object]:
    """A setting of all axes of a figure with so many rows, as the page changes it."""
    return {f"{axis}axis{k or ''}.{setting}": value for axis in which for k in [0, *range(2, count + 1)]}


def ranking(
    names: Sequence[str], gains: Sequence[float], intervals: Sequence[tuple[float, float]], kinds: Sequence[str]
) -> go.Figure:
    """Gain on held-out data with its interval, in percent. ``kinds``: best, tied, earned or not (hatched)."""
    low = [max(0.0, 100 * (g - i[0])) for g, i in zip(gains, intervals, strict=True)]
    high = [max(0.0, 100 * (i[1] - g)) for g, i in zip(gains, intervals, strict=True)]
    figure = go.Figure(
        go.Bar(
            x=[100 * g for g in gains],
            y=[wrapped(n) for n in names],
            orientation="h",
            marker={
                "color": [RANKS[k] for k in kinds],
                "pattern": {
                    "shape": ["/" if k == "not" else "" for k in kinds],
                    "fgcolor": "#8899aa",
                    "fillmode": "overlay",
                    "size": 6,
                },
                "line": {"color": "#8899aa", "width": [1 if k == "not" else 0 for k in kinds]},
            },
            error_x={
                "type": "data",
                "array": high,
                "arrayminus": low,
                "color": "#7d8b9a",
                "thickness": 1.2,
                "width": 4,
            },
            hovertemplate="%{y}: %{x:.1f} %<extra></extra>",
        )
    )
    styled(figure, 80 + 38 * len(names))
    figure.update_xaxes(title_text="gain above the noise, held out (%)", range=[left_edge(intervals), 104])
    for mark in cut_marks(names, gains, intervals):
        figure.add_annotation(mark)
    figure.update_yaxes(autorange="reversed", automargin=True, ticklabelstandoff=STANDOFF)
    figure.update_layout(margin={"l": 20, "r": 20, "t": 10, "b": 45}, hovermode="closest")
    return figure


def ladder(
    names: Sequence[str],
    fit: Sequence[float],
    heldout: Sequence[float],
    held_out: Sequence[str],
    floor: float,
    label: str = "error (standard deviations)",
    apart: Sequence[float] | None = None,
) -> go.Figure:
    """Error of each model from the first to the last, and the noise floor. ``held_out``: what was held out of each; a line
    joins neighbours of which that was the same, and the model that was taken as it is. ``apart``: of each the error on trials
    that were held out from all of it, where there are such; one that is not finite leaves a gap."""
    known = [e for e in apart or () if np.isfinite(e)]
    figure, top = go.Figure(), 1.25 * max(*heldout, *known, floor)
    width = min(NAME, max(SHORT, LETTERS // len(names)))
    places = [wrapped(n, width) for n in names]
    # The model as it is was fitted to nothing, so that it goes with whatever comes next.
    same = [held_out[min(1, len(held_out) - 1)], *held_out[1:]]
    first = 0
    for judged_on, steps in groupby(same):
        part = slice(first, first + len(list(steps)))
        first = part.stop
        figure.add_scatter(
            x=places[part],
            y=list(heldout[part]),
            name="held out" if apart is None else "held out in turn",
            legendgroup="held out",
            showlegend=part.start == 0,
            mode="lines+markers+text",
            line={"color": MEASURED, "width": 3},
            marker={"size": 10},
            text=[f"{v:.3g}" for v in heldout[part]],
            textposition="top center",
            hovertemplate=f"%{{y:.4g}} on {judged_on}<extra></extra>",
        )
    # Above the other, and thinner: often both are the same.
    figure.add_scatter(
        x=places, y=list(fit), name="fitted", mode="lines+markers", legendrank=1,
        line={"color": PREDICTED, "dash": "dot"}, marker={"size": 5},
    )  # fmt: skip
    if apart is not None:
        figure.add_scatter(
            x=places,
            y=[e if np.isfinite(e) else None for e in apart],
            name="held out from all of it",
            mode="lines+markers",
            line={"color": MARK, "width": 2},
            marker={"size": 8, "symbol": "diamond"},
        )
    # Below a line that is near the axis its words would lie on the numbers there.
    figure.add_hline(y=floor, line={"color": FLOOR, "width": 2}, annotation_text=f"noise floor {floor:.3g}",
                     annotation_position="bottom left" if floor > LOW * top else "top left")  # fmt: skip
    styled(figure, 340)
    figure.update_xaxes(range=[-0.4, len(names) - 0.6], automargin=True)
    figure.update_layout(yaxis_range=[0, top])
    figure.update_yaxes(title_text=label, rangemode="tozero")
    return figure


def values(title: str, at: Sequence[tuple[str, float, float, float]], neutral: float) -> go.Figure:
    """One quantity at each of its places, (place, value, low and high end of its interval), beside the value at which it does
    nothing. A bound may cut an interval on one side."""
    figure = go.Figure()
    reach = np.array([(high - value, value - low) for _, value, low, high in at])
    above, below = np.where(np.isfinite(reach), np.maximum(reach, 0.0), 0.0).T
    # What is said of a place after its name has a line of its own: plotly cuts what is wider than half of a figure.
    names = [place.replace(", ", "<br>") for place, *_ in at]
    figure.add_scatter(
        x=[value for _, value, _, _ in at],
        y=names,
        mode="markers",
        marker={"size": 9, "color": IMPROVED},
        error_x={
            "type": "data", "symmetric": False, "array": above, "arrayminus": below,
            "color": IMPROVED, "thickness": 2, "width": 5,
        },
        text=[f"{low:.4g} to {high:.4g}" for _, _, low, high in at],
        hovertemplate="%{y}: %{x:.4g}, %{text}<extra></extra>",
    )  # fmt: skip
    figure.add_vline(x=neutral, line={"color": "#8899aa", "width": 1})
    styled(figure, 78 + sum(10 + 14 * (1 + name.count("<br>")) for name in names))
    figure.update_yaxes(autorange="reversed", automargin=True, ticklabelstandoff=STANDOFF, type="category")
    figure.update_layout(
        title={"text": title, "font": {"size": 12}, "x": 0.02, "y": 0.97},
        hovermode="closest",
        margin={"l": 20, "r": 14, "t": 30, "b": 30},
    )
    return figure


def cloud(title: str, part: Cloud) -> go.Figure:
    """One channel's residuals against one thing, with their means over each stretch of its range; dashed, the mark that the
    effect promises: what the improved model predicts there less what the model does, whatever was measured."""
    figure = go.Figure()
    series = [(part.before, PREDICTED)] + ([] if part.after is None else [(part.after, IMPROVED)])
    thin = slice(None, None, max(1, len(part.x) // DOTS))
    for y, colour in series:
        marker = {"color": colour, "size": 4, "opacity": 0.22}
        figure.add_scatter(x=_short(part.x[thin]), y=_short(y[thin]), mode="markers", marker=marker, hoverinfo="x+y")
    lines = [(y, {"color": colour, "width": 4}) for y, colour in series]
    if part.after is not None:
        lines.append((part.before - part.after, {"color": MARK, "width": 2.5, "dash": "5px,3px"}))
    for y, line in lines:
        at, mean = _trend(part.x, y)
        figure.add_scatter(x=_short(at), y=_short(mean), mode="lines", line=line, hoverinfo="skip")
    figure.add_hline(y=0, line={"color": "#8899aa", "width": 1})
    styled(figure, 250)
    left, right = _most(part.x)
    figure.update_xaxes(title_text=part.label, title_standoff=4, range=[left, right])
    figure.update_yaxes(range=_most(np.concatenate([y for y, _ in series])), automargin=True)
    figure.update_layout(
        title={"text": title, "font": {"size": 12}, "x": 0.02, "y": 0.97},
        showlegend=False,
        hovermode="closest",
        margin={"l": 40, "r": 10, "t": 30, "b": 40},
    )
    return figure


def _short(values: Array) -> list[float]:
    """With as many digits as can be seen."""
    return [float(f"{v:.4g}") for v in values]


def _most(values: Array) -> list[float]:
    """A range that holds nearly all: a few far ones would squeeze the rest into a line."""
    low, high = np.nanquantile(values, [0.004, 0.996])
    room = 0.08 * max(float(high - low), 1e-12)
    return [float(low) - room, float(high) + room]


def _trend(x: Array, y: Array, bins: int = 24) -> tuple[Array, Array]:
    """Middles and means of the bins that hold enough."""
    left, right = _most(x)
    inside = (x >= left) & (x <= right)
    x, y = x[inside], y[inside]
    edges = np.linspace(left, right, bins + 1)
    which = np.clip(np.digitize(x, edges) - 1, 0, bins - 1)
    count = np.bincount(which, minlength=bins)
    mean = np.bincount(which, weights=np.nan_to_num(y), minlength=bins) / np.maximum(count, 1)
    middle = (edges[:-1] + edges[1:]) / 2
    told = count >= FEWEST
    return middle[told], mean[told]


def bars(
    names: Sequence[str], values: Sequence[float], label: str, floor: float | None = None,
    after: Sequence[float] | None = None,
) -> go.Figure:  # fmt: skip
    """Horizontal bars, of the model and perhaps the improved one, and a line where noise alone would end them."""
    places = [wrapped(n, 26) for n in names]
    figure = go.Figure(go.Bar(x=list(values), y=places, orientation="h", marker_color=PREDICTED, name="model"))
    if after is not None:
        figure.add_bar(x=list(after), y=places, orientation="h", marker_color=IMPROVED, name="improved model")
    if floor is not None:
        figure.add_vline(x=floor, line={"color": FLOOR, "width": 2}, annotation_text=f"noise floor {floor:.3g}",
                         annotation_position="top")  # fmt: skip
    styled(figure, 110 + (24 if after is None else 34) * len(names))
    figure.update_xaxes(title_text=label, rangemode="tozero")
    figure.update_yaxes(autorange="reversed", automargin=True, ticklabelstandoff=STANDOFF)
    figure.update_layout(
        margin={"l": 20, "r": 20, "t": 34, "b": 45}, hovermode="closest", bargap=0.25, showlegend=False
    )
    return figure
